"""`python -m benchmarks`: rows are what its sweep says, neither lost nor mixed."""

import re
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
import yaml
from matplotlib.figure import Figure

from benchmarks.__main__ import SWEEPS
from benchmarks.page import mark_front
from benchmarks.sweep import read_sweep, runs_of
from tests import ROOT
from tests.support.colored_frames import write_split

pytestmark = pytest.mark.slow
RATE = "localizers.posenet2.learning_rate"
SWEEP = {
    "title": "Rates",
    "notes": "What a rate is worth.",
    "measure": "training",
    "given": {
        "model": "posenet2",
        "train_frames": "{results}/train.npy",
        "train_labels": "{results}/train.csv",
        "test_frames": "{results}/test.npy",
        "test_labels": "{results}/test.csv",
        "samples_seen": 640,
        "network.input_px": 32,
        "network.width": 0.125,
        "training.device": "cpu",
        "training.batch_size": 16,
        "protocol.images": "plain",
    },
    "vary": {"rate": {"usual": {RATE: 4e-3}, "next to none": {RATE: 1e-9}}},
    "show": {
        "train_cpu_s": {"title": "CPU s", "digits": 1},
        "orientation_deg": {"title": "orientation, °"},
    },
    "picture": {"x": "train_cpu_s", "y": ["orientation_deg"], "group": "rate"},
}


def run(sweep, folder, *options):
    file = folder / "rates.yaml"
    file.write_text(yaml.safe_dump(sweep, sort_keys=False), encoding="utf-8")
    command = [sys.executable, "-m", "benchmarks", file, "--results", folder]
    return subprocess.run(
        [*command, "--out", folder / "rates", *options],
        cwd=ROOT, capture_output=True, text=True,
    )  # fmt: skip


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """A sweep of two training runs."""
    folder = tmp_path_factory.mktemp("sweep")
    for seed, (split, count) in enumerate((("train", 96), ("test", 120))):
        write_split(folder, split, count, seed)
    done = run(SWEEP, folder, "--jobs", "2")
    assert done.returncode == 0, done.stderr
    return folder


def test_the_table_and_the_page_tell_the_settings_apart(swept):
    rows = pd.read_csv(swept / "rates.csv").set_index("rate")
    # Without learning, the mean of the labels' prior; yaws reach 29 degrees.
    assert rows.orientation_deg["usual"] < 0.8 * rows.orientation_deg["next to none"]
    assert (rows[["train_cpu_s", "predict_ms_1"]] > 0).all(axis=None)
    page = (swept / "rates.md").read_text()
    for text in ("| usual", "| next to none", "orientation, °", "(rates.png)"):
        assert text in page
    assert (swept / "rates.png").stat().st_size > 1000


def test_what_is_measured_is_not_measured_again(swept):
    table = swept / "rates.csv"
    before = pd.read_csv(table)
    (before.iloc[1:]).to_csv(table, index=False)
    assert run(SWEEP, swept).returncode == 0
    after = pd.read_csv(table)
    pd.testing.assert_frame_equal(after.iloc[:1], before.iloc[1:].reset_index(drop=True))
    scores = ["rate", "settings", "position_m", "orientation_deg"]
    assert after[scores].iloc[1].equals(before[scores].iloc[0])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"given": SWEEP["given"] | {"samples_seen": 128}}, "row of rate .* other settings"),
        ({"given": SWEEP["given"] | {"protocol.order": "none"}}, "order: .* found 'none'"),
        ({"measure": "weather"}, "measure: 'weather' must be one of"),
        ({"picture": {"x": "time", "y": []}}, "'time' must be a column of `show`"),
    ],
)
def test_a_sweep_that_cannot_be_run_says_why_in_one_line(change, message, swept):
    done = run(SWEEP | change, swept)
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1
    assert re.search(f"^error: .*{message}", done.stderr)


def test_a_picture_rings_the_choice_and_covers_what_is_slower_and_worse():
    """Four settings: the second is beaten by the third, the first and the last by none."""
    panel = Figure().subplots()
    means = pd.DataFrame({"cost": [1.0, 3.0, 2.0, 4.0], "error": [9.0, 8.0, 5.0, 1.0]})
    means["setting"] = list("abcd")
    mark_front(panel, means, "cost", "error", {"setting": "c"})
    front, beaten, ring = (line.get_xydata().tolist() for line in panel.lines)
    assert (front, beaten, ring) == ([[1, 9], [2, 5], [4, 1]], [[3, 8]], [[2, 5]])


@pytest.mark.parametrize("path", sorted(SWEEPS.glob("*.yaml")), ids=lambda path: path.stem)
def test_every_setting_of_a_sweep_exists_and_its_value_is_allowed(path):
    assert runs_of(read_sweep(path), Path("results/mini"), 1)
