"""`python -m benchmarks.reproduce_errors`: two runs of one design, cell by cell."""

import pandas as pd
import pytest

from benchmarks.reproduce_errors import ERRORS, cells_of, compared, main
from synfeal.errors import InputError
from tests import ROOT

MINI = ROOT / "results/published/mini"


def cells_with(position_m):
    """Cells by localizer and size with these position errors, and 10 degrees."""
    frame = pd.DataFrame(
        [("table4_size", "", "hall", size, "", "", "", model) for model, size in position_m],
        columns=["table", "block", "scene", "size", "labels", "noise_m", "noise_deg", "model"],
    )
    for error in ERRORS:
        frame[error] = list(position_m.values()) if error.startswith("position") else 10.0
    return frame


def test_ratios_are_geometric_means_over_the_cells_of_both():
    sizes = [("a", "6k"), ("a", "20k"), ("b", "6k")]
    before = cells_with(dict(zip(sizes, [1.0, 1.0, 4.0], strict=True)))
    now = cells_with(dict(zip([*sizes, ("b", "20k")], [0.5, 2.0, 4.0, 9.0], strict=True)))
    table = compared(before, now).set_index("localizer")
    assert table.cells.to_dict() == {"a": 2, "b": 1, "all": 3}
    assert table.position_m_ratio["a"] == pytest.approx(1.0)  # halved here and doubled there
    assert table.position_m_now["a"] == pytest.approx(1.25)
    assert table.position_m_before["all"] == pytest.approx(2.0)
    assert table.orientation_deg_ratio["all"] == pytest.approx(1.0)


def test_runs_without_a_common_cell_are_refused():
    with pytest.raises(InputError, match="no cell in common"):
        compared(cells_with({("a", "6k"): 1.0}), cells_with({("b", "6k"): 1.0}))


def test_a_published_run_is_as_good_as_itself(tmp_path):
    assert (
        main(["--before", str(MINI), "--now", str(MINI), "--out", str(tmp_path / "out.csv")]) == 0
    )
    table = pd.read_csv(tmp_path / "out.csv").set_index("localizer")
    assert table.cells["all"] == len(cells_of(MINI)) == 5 * 28
    assert (table[[f"{error}_ratio" for error in ERRORS]] == 1.0).all(axis=None)
