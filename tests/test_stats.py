"""From the scores of repetitions to a cell, by hand."""

import json
import math
from itertools import count, product

import pytest

from synfeal.errors import InputError
from synfeal.report.stats import MEASURES, combine, percent_change, read_metrics, score_of
from tests.report_results import failed_metrics, metrics

KEYS = [*MEASURES, *(f"{m}_{end}" for m in MEASURES for end in ("low", "high"))]


def run_of(first):
    """Scores that all differ: ``first``, ``first + 1``, ... in the order of ``KEYS``."""
    values = metrics("6k", 1.0, 1.0) | dict(zip(KEYS, map(float, count(first)), strict=False))
    return values | {"position_rms_m": first + 50.0, "floor_position_m": first + 60.0}


def test_a_cell_is_the_mean_of_its_runs_and_those_without_a_score_count():
    cell = combine([run_of(0), run_of(2), run_of(10)])  # offsets 0, 2, 10: mean 4, sd sqrt(28)
    for place, measure in enumerate(MEASURES):
        low = len(MEASURES) + 2 * place
        assert cell[measure] == place + 4
        # To the mean distance of the limits of the test paths comes the spread over seeds.
        of_seeds = 1.96 * math.sqrt(28 / 3)
        high = place + 4 + math.hypot(low + 1 - place, of_seeds)
        assert cell[f"{measure}_high"] == pytest.approx(high)
        assert cell[f"{measure}_low"] == max(place + 4 - math.hypot(low - place, of_seeds), 0)
        assert cell[f"{measure}_sd"] == pytest.approx(math.sqrt(28))
    assert (cell["position_rms_m"], cell["floor_position_m"]) == (54, 60)
    assert (cell["n_train"], cell["n_test"]) == (300, 125)
    assert (cell["n_seeds"], cell["n_finished"], cell["failed"]) == (3, 3, 0)
    cell = combine([failed_metrics("6k"), run_of(3) | {"failed": 7}])
    assert cell["position_m"] == 3
    assert cell["position_m_sd"] is None
    assert cell["baseline_position_m_true"] == 1  # guessing the mean needs no score
    assert cell["position_rms_m"] == 53
    assert (cell["n_seeds"], cell["n_finished"], cell["failed"]) == (2, 1, 125 + 7)
    nothing = combine([failed_metrics("6k")])
    assert nothing["orientation_deg"] is None
    assert (nothing["position_rms_m"], nothing["n_finished"], nothing["n_test"]) == (None, 0, 125)
    score = score_of([run_of(0), run_of(2) | {"position_m_high": None}], "position_m")
    assert (score["position_m"], score["position_m_high"]) == (1, None)
    assert score["position_m_sd"] == pytest.approx(math.sqrt(2))


@pytest.mark.parametrize(
    ("new", "old", "percent"),
    [
        (3, 2, 50),
        (1, 2, -50),
        (2, 2, 0),
        (0, 2, -100),
        (None, 2, None),
        (2, None, None),
        (2, 0, None),
    ],
)
def test_percent_change(new, old, percent):
    assert percent_change(new, old) == percent


def test_metrics_are_read_back_as_they_are(tmp_path):
    path = tmp_path / "metrics.json"
    values = run_of(0) | {"position_m_high": None, "more": "of it"}
    path.write_text(json.dumps(values))
    assert read_metrics(path) == values


GONE = object()


@pytest.mark.parametrize(
    ("keys", "values"),
    [
        ([*KEYS, "position_rms_m", "baseline_orientation_deg"], [-1.0, "one", [1.0]]),
        (["n_train", "n_test", "failed"], [-1, 0.5, None]),
        ([*KEYS, "position_rms_m", "n_train", "failed"], [GONE]),
    ],
    ids=["no error", "no count", "missing"],
)
def test_a_score_that_is_none_is_refused_by_name(tmp_path, keys, values):
    path = tmp_path / "metrics.json"
    for key, value in product(keys, values):
        changed = {k: v for k, v in (run_of(0) | {key: value}).items() if v is not GONE}
        path.write_text(json.dumps(changed))
        with pytest.raises(InputError, match=f"{key}.*score that run again") as refusal:
            read_metrics(path)
        assert str(refusal.value).startswith(str(path))
