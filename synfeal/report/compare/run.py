"""What ``synfeal compare`` does."""

from __future__ import annotations

from pathlib import Path

from synfeal.dataset.directories import refuse_foreign
from synfeal.files import atomic_path
from synfeal.frames import write_frame
from synfeal.report.compare.figure import comparison_figure
from synfeal.report.compare.page import markdown_of, text_of
from synfeal.report.compare.trees import Comparison, compare_trees

OUTPUTS = ("compare.csv", "compare.md", "compare.png")


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
        _write(comparison, out)
    return text_of(comparison)


def _write(comparison: Comparison, out: Path) -> None:
    figure = comparison_figure(comparison)
    with atomic_path(out / "compare.png") as temporary:
        figure.savefig(temporary, dpi=150)
    with atomic_path(out / "compare.md") as temporary:
        temporary.write_text(markdown_of(comparison), encoding="utf-8")
    write_frame(out / "compare.csv", comparison.table)
