"""The page in a browser: it switches, sorts and draws; it complains of and asks for nothing."""

import numpy as np
import pytest

from reproduction.report.html.page import SPLITS, paths_of, trajectories, write_report
from tests.support.report_page import PLANS, large_room_design, page_results, straight
from tests.support.report_results import design_of
from tests.synfeal.test_inspect_page import CHROMIUM, answer

# Answers with what PROBE finds, after the views were drawn.
SCRIPT = """
const drawn = () => new Promise((done) => requestAnimationFrame(done));  // after the views
const lines = (cell) => cell.innerText.split("\\n").map((line) => line.trim());
const shown = (cell) => lines(cell).filter(Boolean);
const table = (name) => document.querySelector(`#${name} table`);
const column = (name, i) => [...table(name).tBodies[0].rows].map((row) => shown(row.cells[i])[0]);
const heading = (name, i) => table(name).querySelector(`th[data-column="${i}"]`);
const choose = (name) => document.getElementById(`score-${name}`).click();
function blue() {
  const canvas = document.querySelector("canvas"), copy = document.createElement("canvas");
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const context = copy.getContext("2d");
  context.drawImage(canvas, 0, 0);
  const data = context.getImageData(0, 0, copy.width, copy.height).data, found = [0, 0];
  for (let i = 0; i < data.length; i += 4) {
    const [r, g, b] = data.slice(i, i + 3);
    if (b > 2 * r) found[0] += 1; else if (r > 2 * b) found[1] += 1;
  }
  return found;
}
(async () => {
  let answer;
  try { answer = await (async () => { PROBE })(); } catch (error) { answer = String(error); }
  fetch("REPLY", { method: "POST", mode: "no-cors", body: JSON.stringify(answer) });
})();
"""
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    root = page_results(tmp_path_factory.mktemp("browser") / "tiny")
    write_report(design_of(large_room_design()), root, root / "report.html")
    return root / "report.html"


def asked(page, tmp_path, probe):
    """Return what a script of ours finds on the page, which must leave the console empty."""
    found, console = answer(page.read_text(), tmp_path, SCRIPT.replace("PROBE", probe))
    assert [line for line in console if "ReadPixels" not in line] == []  # we are slow, not the page
    return found


def test_one_switch_changes_every_table(page, tmp_path):
    probe = """
      const read = () => [shown(table("table2_ground_truth").tBodies[0].rows[0].cells[1]),
        shown(table("claims-table").tBodies[0].rows[0].cells[4]), document.body.innerText.length];
      const before = read(); choose("true"); const after = read(); choose("labels");
      return [before, after, read()];
    """
    before, after, again = asked(page, tmp_path, probe)
    assert before[:2] == [["1.00 m", "0.90–1.20, paths only", "0.34 m"], ["✓ holds"]]
    true = [["0.50 m", "0.45–0.60, paths only", "0.34 m"], ["? undecided", "stays <short>"]]
    assert after[:2] == true
    assert again == before


def test_headings_sort_up_down_and_back(page, tmp_path):
    probe = """
      const name = "table4_size", place = heading(name, 1), button = place.querySelector("button");
      const states = [[column(name, 1), place.ariaSort]];
      button.focus();
      const focused = document.activeElement === button && button.tabIndex === 0;
      for (let i = 0; i < 3; i++) {
        button.click();
        states.push([column(name, 1), place.ariaSort]);
      }
      button.click(); heading(name, 2).querySelector("button").click();
      return [focused, states, place.ariaSort, heading(name, 2).ariaSort];
    """
    focused, states, left, taken = asked(page, tmp_path, probe)
    values = [f"{300**0.5 / n**0.5:.2f} m" for n in (300, 1000, 2000, 4000)]
    assert focused  # a focused button is pressed with Enter and Space by every browser
    expected = ["none", "ascending", "descending", "none"]
    orders = [values, values[::-1], values, values]
    assert states == [[order, state] for order, state in zip(orders, expected, strict=True)]
    assert (left, taken) == ("none", "ascending")


def test_the_scene_is_drawn_and_paths_can_be_hidden(page, tmp_path):
    probe = """
      const box = document.querySelector(".trajectory"), found = [];
      for (let i = 0; i < 2; i++) {
        box.dispatchEvent(new Event("change"));
        await drawn();
        found.push(blue());
        box.click();
      }
      return [found, [...document.querySelectorAll(".trajectory")].map((box) => box.checked)];
    """
    ((with_line, red), (without, _)), checked = asked(page, tmp_path, probe)
    assert with_line > 30
    assert red > 5000
    assert without == 0
    assert checked == [True, True, False, False, False, False]


def test_nothing_is_requested_and_nothing_sticks_out(page, tmp_path):
    probe = """
      const names = performance.getEntriesByType("resource").map((entry) => entry.name);
      const wide = document.documentElement;
      return [names.filter((name) => !name.startsWith("data:")), wide.scrollWidth - innerWidth,
        [...document.images].map((image) => image.naturalWidth > 0)];
    """
    requested, overhang, images = asked(page, tmp_path, probe)
    assert requested == []
    assert overhang <= 0
    # The paper beside ours, cells and effects; the findings; and two figures.
    assert images == [True] * 5


def test_paths_are_cut_where_their_number_changes_and_trajectories_those_of_the_files(page):
    table = straight([[0.0, 0, 0], [1, 0, 0], [5, 5, 5], [2, 0, 0], [3, 0, 0], [4, 0, 0]])
    table.path[:] = [0, 0, 1, 2, 2, 2]
    first, last = paths_of(table)
    np.testing.assert_array_equal(first[:, 0], [0, 1])
    np.testing.assert_array_equal(last[:, 0], [2, 3, 4])
    found = trajectories("large_room", page.parent, design_of(large_room_design()))
    assert [t.title for t in found] == [
        *(title for title, _ in SPLITS.values()),
        *("SfM labels, 6k", "RGB-D SLAM w/ TORO labels, 6k", "RGB-D SLAM w/ g2o labels, 6k"),
        "KinectFusion labels, 6k",
    ]
    assert [path.tolist() for path in found[0].paths_m] == [PLANS["train"]]
    shifted = [(np.array(PLANS[split]) + 0.25).tolist() for split in SPLITS]
    assert [path.tolist() for path in found[2].paths_m] == shifted
    assert len({t.rgb for t in found}) == len(found)
