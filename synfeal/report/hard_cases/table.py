"""``hard_cases.csv``: every hard case with the errors and times of both formulas."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from baselines.hard_cases.registry import CASES as CASES_BELOW
from synfeal.hard_cases.case import Case, examine
from synfeal.report.hard_cases import shares
from synfeal.report.tables import Value, write_rows

NAME = "hard_cases"
COLUMNS = (
    *("family", "case", "quantity", "unit", "naive", "ours", "naive_error", "our_error"),
    *("bound", "ok", "reference", "naive_seconds", "our_seconds"),
)
CASES = (*CASES_BELOW, *shares.CASES)


def write_hard_cases(out_csv: Path) -> None:
    """Examine all cases and write one row for each; only the times differ between runs."""
    write_rows(out_csv, COLUMNS, rows_of(CASES))


def rows_of(cases: Iterable[Case]) -> list[dict[str, Value]]:
    """Rows by column; ``ok`` is 1 where our error is within the bound. Errors may be ``inf``."""
    return [_row(case) for case in cases]


def _row(case: Case) -> dict[str, Value]:
    outcome = examine(case)
    return {
        "family": case.family,
        "case": case.name,
        "quantity": case.quantity,
        "unit": case.unit,
        "naive": case.naive,
        "ours": case.ours,
        "naive_error": outcome.naive_error,
        "our_error": outcome.our_error,
        "bound": case.bound,
        "ok": int(outcome.our_error <= case.bound),
        "reference": case.reference,
        "naive_seconds": outcome.naive_seconds,
        "our_seconds": outcome.our_seconds,
    }
