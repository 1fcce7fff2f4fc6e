"""The table of learned features beside SIFT, and what the docs say of it."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binomtest

from benchmarks.learned_features import Measured, row_of, summary

ROOT = Path(__file__).parents[2]


def test_the_page_shows_the_table():
    table = pd.read_csv(ROOT / "results/benchmarks/learned_features.csv")
    page = (ROOT / "docs/localizing.md").read_text()
    for line in summary(table).splitlines():
        assert line in page


def measured(errors_m):
    """Photographs with these errors, NaN where not localized, each at 1° and 0.25 s."""
    error_m = np.array(errors_m)
    return Measured(
        map_s=10.0,
        localized=np.isfinite(error_m),
        error_m=error_m,
        error_deg=np.where(np.isfinite(error_m), 1.0, np.nan),
        seconds=np.full(len(error_m), 0.25),
    )


def test_a_row_in_closed_form():
    """Of 40 photographs, ten more are within 5 cm, none fewer; two more localized, one wrong."""
    sift = measured([0.01] * 20 + [0.08] * 18 + [np.nan] * 2)
    other = measured([0.01] * 30 + [0.08] * 8 + [0.9, 0.08])
    row = row_of(other, sift)
    assert row["photographs"] == row["localized"] == 40
    assert row["within_5cm_5deg"] == 0.75
    assert (row["within_gained"], row["within_lost"]) == (10, 0)
    assert (row["localized_gained"], row["localized_lost"]) == (2, 0)
    assert row["off_over_50cm"] == 1
    assert row["photograph_s"] == 0.25
    # Either sign as likely, ten of ten: 2 / 2^10.
    assert row["within_mcnemar_p"] == pytest.approx(2 / 2**10, abs=1e-4)
    exact = binomtest(30, 40).proportion_ci(0.95, method="exact")
    assert (row["within_low"], row["within_high"]) == pytest.approx(tuple(exact), abs=1e-4)
    # The third block of four gains all ten: resamples without it, one in 0.75^-4, gain none.
    assert row["within_change_low"] == 0
    assert row["within_change_high"] == 0.75


def test_sift_gains_nothing_on_itself():
    sift = measured([0.01] * 10 + [np.nan] * 10)
    row = row_of(sift, sift)
    assert [row["within_gained"], row["within_lost"], row["localized_gained"]] == [0, 0, 0]
    assert row["within_mcnemar_p"] == 1
    assert row["median_m"] == 0.01
