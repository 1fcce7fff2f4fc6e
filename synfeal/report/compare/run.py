"""What ``synfeal compare`` does."""

from __future__ import annotations

from pathlib import Path

from synfeal.dataset.directories import refuse_foreign
from synfeal.files import atomic_path
from synfeal.report.compare.figure import comparison_figure
from synfeal.report.compare.page import markdown_of, text_of
from synfeal.report.compare.trees import Comparison, RunComparison, compare_trees
from synfeal.report.stats import MEASURES
from synfeal.report.tables import Value, write_rows

OUTPUTS = ("compare.csv", "compare.md", "compare.png")
COUNTS = ("n_test", "n_paths", "n_seeds", "failed")
COLUMNS = (
    *("scene", "size", "labels", "init", "model", "measure"),
    *("a", "b", "difference", "low", "high", "change_percent", "verdict"),
    *("sd_a", "sd_b", "se_seeds", "test_frames", "test_labels"),
    *(f"{count}_{tree}" for count in COUNTS for tree in "ab"),
)


def compare(root_a: Path, root_b: Path, out: Path | None) -> str:
    """Compare two result trees; the text to print.

    Args:
        root_a: results before, e.g. ``results/mini``.
        root_b: results after.
        out: directory for ``compare.csv``, ``compare.md`` and ``compare.png``, made if need be;
            earlier files of these names are replaced.

    Raises:
        InputError: the trees cannot be compared, or ``out`` holds other files.
    """
    if out is not None:
        refuse_foreign(out, OUTPUTS, "a comparison")
    comparison = compare_trees(root_a, root_b)
    if out is not None:
        write_comparison(comparison, out)
    return text_of(comparison)


def write_comparison(comparison: Comparison, out: Path) -> None:
    """Write the three files of a comparison."""
    figure = comparison_figure(comparison)
    with atomic_path(out / "compare.png") as temporary:
        figure.savefig(temporary, dpi=150)
    with atomic_path(out / "compare.md") as temporary:
        temporary.write_text(markdown_of(comparison), encoding="utf-8")
    rows = [record_of(run, measure) for run in comparison.runs for measure in MEASURES]
    write_rows(out / "compare.csv", COLUMNS, rows)


def record_of(run: RunComparison, measure: str) -> dict[str, Value]:
    """One CSV row by column name; a failed run's error is ``inf``."""
    difference = run.differences[measure]
    record: dict[str, Value] = dict(run.key._asdict())
    record |= {
        "measure": measure,
        "a": difference.a,
        "b": difference.b,
        "difference": difference.value,
        "low": difference.low,
        "high": difference.high,
        "change_percent": difference.percent,
        "verdict": difference.verdict,
        "sd_a": difference.sd_a,
        "sd_b": difference.sd_b,
        "se_seeds": difference.se_seeds,
        "test_frames": run.plans,
        "test_labels": run.labels,
    }
    for count in COUNTS:
        record |= dict(zip((f"{count}_a", f"{count}_b"), getattr(run, count), strict=True))
    return record
