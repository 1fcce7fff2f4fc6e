"""What training costs, in ``speed_vs_error.csv``: seconds and images counted by hand."""

import pytest

from synfeal.errors import InputError
from synfeal.frames import records_of
from synfeal.report.cells import schema_of
from synfeal.report.speed_vs_error import training_rows
from tests.report_results import write_rows

HEADER = "s\th:m:s\tmax_rss\tcpu_time\n"
COLUMNS = [*schema_of("table4_size", True)]
SEEDS = 2


def cell(scene, size, n_train, model, error_m):
    keys = {"scene": scene, "size": size, "model": model, "position_m_true": error_m}
    return keys | {"n_train": n_train, "n_seeds": SEEDS}


CELLS = [
    cell("large_room", "6k", 300, "posenet", 0.9),
    cell("large_room", "80k", 4000, "posenet", 0.4),
    cell("large_room", "80k", 4000, "posenet2", 0.3),
    cell("large_room", "80k", 4000, "hourglass", None),  # all seeds failed
    cell("sanctuary", "95k", 4750, "posenet", 0.5),
]


def fill(root, scene, size, model, repetition, images, seconds):
    name = f"{scene}/{size}/synfeal/pretrained/{model}/seed{repetition}"
    history = root / "runs" / name / "history.csv"
    history.parent.mkdir(parents=True)
    history.write_text(f"samples_seen,loss\n32,1.0\n{images},0.5\n")
    measured = root / "benchmarks/train" / f"{name}.tsv"
    measured.parent.mkdir(parents=True, exist_ok=True)
    # A whole number of looks, all of them busy: processor time is the time on the clock.
    measured.write_text(f"{HEADER}{seconds}\t0:00:01\t300\t{seconds}\n")


@pytest.fixture
def root(tmp_path):
    write_rows(tmp_path / "tables/table4_size.csv", COLUMNS, CELLS)
    fill(tmp_path, "large_room", "80k", "posenet", 0, 1000, 5.0)
    fill(tmp_path, "large_room", "80k", "posenet", 1, 3000, 7.0)
    fill(tmp_path, "large_room", "80k", "posenet2", 0, 1000, 2.0)
    fill(tmp_path, "large_room", "80k", "posenet2", 1, 1000, 4.0)
    return tmp_path


def test_a_localizer_has_a_row_with_seconds_over_images_of_all_seeds(root):
    first, second = records_of(training_rows(root, "large_room"))
    assert (first["variant"], second["variant"]) == ("PoseNet", "PoseNet2")
    assert first["seconds_per_item"] == pytest.approx(12.0 / 4000)
    assert second["seconds_per_item"] == pytest.approx(6.0 / 2000)
    assert (first["error"], second["error"]) == (0.4, 0.3)
    same = {"error_unit": "m", "chosen": 0}
    assert all(same.items() <= row.items() for row in (first, second))


def test_a_design_without_table_4_has_no_rows(tmp_path):
    assert training_rows(tmp_path, "large_room").empty


def test_a_training_without_measurement_or_images_is_named(root):
    with pytest.raises(InputError, match=r"sanctuary/95k/.*/posenet/seed0\.tsv: missing"):
        training_rows(root, "sanctuary")
    path = root / "runs/large_room/80k/synfeal/pretrained/posenet/seed1/history.csv"
    path.write_text("samples_seen,loss\n")
    with pytest.raises(InputError, match=r"seed1/history\.csv: shows no images"):
        training_rows(root, "large_room")
