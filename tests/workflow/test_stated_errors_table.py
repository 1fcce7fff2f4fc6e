"""The table of errors that photographs were measured to have, and what the docs say of it."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from benchmarks.stated_errors import ORIENTATION, POSITION, summary
from synfeal.dataset.pose_table import STATED

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def table():
    return pd.read_csv(ROOT / "results/benchmarks/stated_errors.csv")


def test_the_page_of_places_shows_what_the_table_comes_to(table):
    page = (ROOT / "docs/places.md").read_text()
    for line in summary(table).splitlines():
        assert line in page


def test_the_readme_tells_the_same(table):
    readme = (ROOT / "README.md").read_text()
    rows = [line for line in readme.splitlines() if " | " in line]
    for place, told in (
        ("corridor", "corridor"),
        ("freiburg1_rpy", "desk"),
        ("RedKitchen", "kitchen"),
    ):
        of_place = table[table.place == place]
        found = of_place[of_place.status == "localized"]
        stated = found[found["position_95_m"].notna()]
        held = 100 * (stated[POSITION] <= stated["position_95_m"]).mean()
        error = f"{100 * found[POSITION].median():.1f} cm, {found[ORIENTATION].median():.1f}°"
        (row,) = (row for row in rows if row.startswith(f"| {told}, "))
        none = len(found) - len(stated)
        without = f" ({none} state none)" if none else ""
        expected = f"| {len(found)} of {len(of_place)} | {error} | {held:.0f} %{without} |"
        assert row.endswith(expected)


def test_a_summary_in_closed_form():
    """Errors of 1 to 10 cm, stated to be within 9 cm in 95 of 100 cases; one lost, two wrong."""
    found = pd.DataFrame(
        {
            "place": "hall",
            "photograph": [f"{row}.jpg" for row in range(13)],
            "status": ["localized"] * 12 + ["not localized"],
            POSITION: [*np.arange(1, 11) / 100, 7.0, 7.0, np.nan],
            ORIENTATION: [*np.full(12, 1.0), np.nan],
            **dict(zip(STATED, (0.05, 0.0901, 1.0001, 2.0), strict=True)),
        }
    )
    found.loc[10:, list(STATED)] = np.nan
    lines = summary(found).splitlines()
    assert lines[2] == "| hall | 13 | 12 | 6.5 cm / 1.00° | 38 % | 2 | 0 |"
    # Of those that state errors; the radius is 0.901 of the 10 cm that hold 95 % of ten.
    position, orientation = (line.split(" | ") for line in lines[-2:])
    assert position[2] == "50 % (0.71)"
    assert position[5] == "90 % (0.90)"
    assert position[7] == "9.0 cm |"
    assert orientation[5] == "100 % (2.00)"
