"""The page of results: every number from a file of the run, nothing loaded, nothing invented."""

import base64
import io
import re
import shutil
import xml.etree.ElementTree as ET
from html import unescape

import numpy as np
import pytest
from PIL import Image

from reproduction.claims.tables import read_claims
from reproduction.report.html import page
from reproduction.report.html.page import LARGEST_SIDE_PX, data_address, figure_files, missing_rows
from reproduction.report.html.tables import claims_table, score_table
from reproduction.tables.cells import read_cells
from synfeal.errors import InputError
from synfeal.records.files import read_json, write_json
from tests.support.report_page import large_room_design, page_results
from tests.support.report_results import (
    change_cell,
    design_of,
    failed_metrics,
    fill,
    shipped_design,
    write_run,
)

RUN = "runs/large_room/6k/sfm/pretrained/posenet/seed0/metrics.json"
TABLE5 = "table5_from_scratch"


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    return page_results(tmp_path_factory.mktemp("page") / "tiny")


@pytest.fixture
def root(finished, tmp_path, monkeypatch):
    """A copy to change; the view of the scene is another test's."""
    monkeypatch.setattr(page, "room_html", lambda scene, *_: f"<p>{scene} in 3D</p>")
    return shutil.copytree(finished, tmp_path / "tiny")


def text_of(html):
    """Return the text that a person reads: no tags, no styles, no scripts."""
    html = re.sub(r"(?s)<(style|script)\b.*?</\1>", "", html)
    return " ".join(unescape(re.sub(r"<[^>]*>", " ", html)).split())


def written(root):
    page.write_report(design_of(large_room_design()), root, root / "report.html")
    return (root / "report.html").read_text()


def table_of(name, root, design=None):
    rows = [row for row in design or shipped_design() if row.table == name]
    return ET.fromstring(score_table(name, read_cells(name, design_of(rows), root)))


def numbers_of(row, style):
    """Texts of the ten cells of a row under one style, without interval."""
    cells = [cell.find(f"div[@class='{style}']") for cell in row.findall("td[@class='number']")]
    return [["".join(part.itertext()) for part in cell if part.tag != "small"] for cell in cells]


# By table: a column, what is written into it, and how that reads on the page.
CHANGED = {
    "claim_effects": ("value", "-47.25", "−47 % (−"),
    "tables/table1_meshes": ("vertices", "51234", "51,234"),
    "tables/recall": ("recall_5cm_5deg", "0.6251", "62.5 %"),
    "tables/assistance": ("last_m_before_median", "77.875", "77.88 m, "),
    "tables/label_error": ("position_m_median", "0.07654", " 0.0765 "),
    "tables/speed_vs_error": ("faces", "4567", "4,567"),
}


@pytest.mark.parametrize("name", CHANGED)
def test_every_table_decides_what_the_page_says(root, name):
    column, value, shown = CHANGED[name]
    assert shown not in text_of(written(root))
    change_cell(root / f"{name}.csv", column, value, row=slice(None))
    assert shown in text_of(written(root))


def test_a_score_changes_the_table_and_the_switch_has_both(root):
    assert "7.77 m" not in text_of(written(root))
    scores = {"position_m": 7.77, "position_m_low": 7.01, "position_m_true": 6.66}
    write_json(root / RUN, read_json(root / RUN) | scores)
    table = table_of("table2_ground_truth", root)
    sfm = table.find(".//tbody/tr")
    assert numbers_of(sfm, "labels")[0] == ["7.77 m"]
    assert numbers_of(sfm, "true")[0] == ["6.66 m"]
    cell = sfm.find("td[@class='number']")
    assert (cell.get("data-labels"), cell.get("data-true")) == ("7.77", "6.66")
    assert (
        cell.find("div[@class='labels']/small").text == "7.01–1.20, paths only"
    )  # 1.2 m untouched
    assert "".join(cell.find("div[@class='paper']").itertext()) == "0.34 m"
    assert "7.77 m" in text_of(written(root))
    rows = [row for row in shipped_design() if row.table == TABLE5]
    fill(root, rows)
    write_run(root, rows[0], "hourglass", failed_metrics("6k"))
    first = table_of(TABLE5, root).find(".//tbody/tr")
    change = first.find("td[@class='number']/div[@class='labels']/span[@class='change worse']")
    assert change.text == "+100.0%"
    failed = first.findall("td[@class='number']")[4]
    assert failed.find("div[@class='labels']/span").text == "failed"
    assert failed.get("data-labels") == ""  # sorts last


def test_claims_carry_both_scores_escaped_and_no_unknown_verdict(finished, root):
    html = claims_table(read_claims(finished))
    labels = re.findall(r'<div class="labels">(.*?)</div>', html)
    true = re.findall(r'<div class="true">(.*?)</div>', html)
    both = "<br>".join(
        f"exact labels instead of SfM, {name}: {{0}}" + ";" * (name == "position")
        for name in ("position", "orientation")
    )
    assert labels[0] == both.format("−42 % (−50 to −9 %)")
    assert true[0] == both.format("−34 % (−44 to +3 %)")
    assert text_of(labels[1]) == "✓ holds"
    assert text_of(true[1]) == "? undecided stays <short>"
    # What the run could not test has one verdict for both scores.
    assert [*map(text_of, labels[2:])] == ["–", "– not testable here no row <40k>"]
    assert labels[2:] == true[2:]
    path = root / "claims.csv"
    path.write_text(path.read_text().replace(",holds,", ",perhaps,"))
    with pytest.raises(InputError, match="claim 'C2': verdict must be one of"):
        read_claims(root)


def test_the_page_names_what_it_lacks(root):
    for name in ("claims.csv", "claim_effects.csv", "provenance.json", "tables/speed_vs_error.csv"):
        (root / name).unlink()
        assert f"{name} is missing." in text_of(written(root))
    for path in (root / "figures").iterdir():
        path.unlink()
    assert "figures is missing from this run." in text_of(written(root))
    assert "for lack of its data in this profile: figure error_by_noise." in text_of(written(root))


def test_untested_claims_and_rows_left_out_are_listed_and_nothing_else_is_needed(root):
    text = text_of(written(root))
    assert "C15 is not testable here: no row <40k>" in text
    assert (
        "Table 4: 4 of the paper's 8 rows are not in this profile's table of experiments:"
        " Sanctuary 6k; Sanctuary 20k; Sanctuary 40k; Sanctuary 95k." in text
    )
    html = written(root)
    assert not re.findall(r"https?://|@import|url\(|<link|src=\"(?!data:)", html)
    assert "default-src 'none'" in html
    links = re.findall(r'href="#([^"]*)"', html)
    assert links
    assert set(links) <= set(re.findall(r'id="([^"]*)"', html))
    assert len(html) < 15e6


def test_figures_are_shown_in_order_as_vectors_or_made_small(finished, tmp_path):
    found = figure_files(finished / "figures", {"of_my_own": "x", "not there": "y"})
    assert [path.name for path in found.values()] == ["of_my_own.png", "error_by_size.svg"]
    address = data_address(found["error_by_size"])
    assert address.startswith("data:image/svg+xml;base64,")
    content = base64.b64decode(address.partition(",")[2])
    assert content == found["error_by_size"].read_bytes()
    noise = np.random.default_rng(0).integers(0, 255, (300, 2000, 3), dtype=np.uint8)
    Image.fromarray(noise).save(tmp_path / "large.png")
    kind, _, content = data_address(tmp_path / "large.png").partition(",")
    assert kind == "data:image/webp;base64"
    assert len(content) < (tmp_path / "large.png").stat().st_size / 3
    with Image.open(io.BytesIO(base64.b64decode(content))) as image:
        assert image.size == (LARGEST_SIDE_PX, 300 * LARGEST_SIDE_PX // 2000)
    assert missing_rows(shipped_design()) == []
