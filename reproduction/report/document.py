"""Join the paper's tables in one LaTeX document."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from reproduction.runs.results import read_text
from reproduction.tables.sheet import HEADER, PACKAGES
from synfeal.records.files import write_text


def write_document(tables: Sequence[Path], out_tex: Path) -> None:
    """Write a document that compiles by itself and has a table on each page.

    Args:
        tables: Files that :func:`reproduction.tables.sheet.write_latex` wrote, in order.
        out_tex: The document.
    """
    bodies = [read_text(table).removeprefix(HEADER).rstrip() for table in tables]
    lines = [
        r"\documentclass{article}",
        r"\usepackage[a4paper,margin=18mm]{geometry}",
        *(f"\\usepackage{{{package}}}" for package in PACKAGES),
        r"\begin{document}",
        "\n\n\\clearpage\n".join(bodies),
        r"\end{document}",
    ]
    write_text(out_tex, "\n".join(lines) + "\n")
