"""Tables of what two commands come to on captures, and of photographs of other places."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from baselines.references.map_localizer import HEADER
from benchmarks import other_places, two_commands
from benchmarks.stated_errors import ORIENTATION, POSITION
from synfeal.dataset.pose_table import STATED

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("benchmark", [two_commands, other_places])
def test_the_page_of_places_shows_what_the_table_comes_to(benchmark):
    name = benchmark.__name__.rpartition(".")[2]
    table = pd.read_csv(ROOT / f"results/benchmarks/{name}.csv")
    page = (ROOT / "docs/places.md").read_text()
    for line in benchmark.summary(table).splitlines():
        assert line in page


def test_scores_in_closed_form():
    """Errors of 1 to 10 cm, each stated to be within 8 cm; one lost, one wrong that states none."""
    errors = pd.DataFrame(
        {
            "status": ["localized"] * 11 + ["not localized"],
            POSITION: [*np.arange(1, 11) / 100, 7.0, np.nan],
            ORIENTATION: [*np.full(11, 1.0), np.nan],
            "position_95_m": [*np.full(10, 0.0801), np.nan, np.nan],
        }
    )
    assert two_commands.scores(errors) == {
        "photographs": 12,
        "localized": 11,
        "position_m": 0.06,
        "orientation_deg": 1.0,
        "within_5cm_5deg_percent": 41.7,
        "within_stated_95_percent": 80.0,
        "over_50cm": 1,
    }


def test_photographs_of_other_places_are_counted_by_what_became_of_them(tmp_path):
    """Of 100 photographs one is localized and states an error, one states none, two ambiguous."""
    statuses = ["localized", "localized", "ambiguous", "ambiguous", *["not localized"] * 96]
    poses = pd.DataFrame(dict.fromkeys(HEADER, np.nan), index=range(100)).astype(object)
    poses["status"] = statuses
    poses.loc[0, list(STATED)] = 0.1
    poses.to_csv(tmp_path / "poses.csv", index=False)
    counted = other_places.counts(tmp_path / "poses.csv")
    assert list(counted.values()) == [100, 2, 2, 1]
    table = pd.DataFrame([{"place": "hall", "photographs_of": "attic", **counted}])
    lines = other_places.summary(table).splitlines()
    assert lines[2] == "| hall | 100 | 2 | 2 | 96 | 1 |"
    # Clopper-Pearson's limits of 98 and of 1 in 100, as tabulated.
    assert "without a pose 98.0 % (95 %: 93.0 to 99.8 %)" in lines[-1]
    assert "states an error 1.0 % (95 %: 0.0 to 5.4 %)" in lines[-1]
