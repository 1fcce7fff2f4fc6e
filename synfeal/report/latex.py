"""LaTeX around tables: text, documents, and the three common packages that tables need."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from synfeal.files import atomic_path
from synfeal.report.results import read_text

PACKAGES = ("booktabs", "graphicx", "xcolor")
HEADER = f"% Needs \\usepackage{{{','.join(PACKAGES)}}}\n"
# Plain xcolor mixes, so that no package option is needed; both stay apart from black in grey print.
TONES = {"better": "green!45!black", "worse": "red!85!black"}
SPECIAL = str.maketrans(
    {
        **{character: f"\\{character}" for character in "&%#_${}"},
        **{"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"},
        **{"|": r"\textbar{}", "…": r"\ldots{}", "–": "--", "°": r"$^\circ$", "ᵀ": r"$^\top$"},
        **{"²": "$^2$", "³": "$^3$", "−": "$-$", "±": r"$\pm$", "×": r"$\times$", "·": r"$\cdot$"},
        **{"→": r"$\to$", "≥": r"$\ge$", "≤": r"$\le$", "√": r"$\surd$", "Σ": r"$\Sigma$"},
        **{"τ": r"$\tau$", "β": r"$\beta$", "θ": r"$\theta$", "π": r"$\pi$"},
    }
)


def write_document(tables: Sequence[Path], out_tex: Path) -> None:
    """Write a complete document that holds the given tables, in order, and nothing else."""
    write_text(out_tex, document_latex(table_bodies(tables)))


def table_bodies(tables: Sequence[Path]) -> list[str]:
    """The table environments of files that :func:`synfeal.report.sheet.write_latex` wrote."""
    return [read_text(table).removeprefix(HEADER).rstrip() for table in tables]


def document_latex(pages: Sequence[str], packages: Sequence[str] = PACKAGES) -> str:
    """A complete document of bodies that each begin a page."""
    lines = [
        r"\documentclass{article}",
        r"\usepackage[a4paper,margin=18mm]{geometry}",
        *(f"\\usepackage{{{package}}}" for package in packages),
        r"\begin{document}",
        "\n\n\\clearpage\n".join(pages),
        r"\end{document}",
    ]
    return "\n".join(lines) + "\n"


def escape(text: str) -> str:
    """Unicode text as LaTeX; a sign before a number becomes a minus sign, not a hyphen."""
    return text.translate(SPECIAL)


def write_text(path: Path, text: str) -> None:
    """Write a file as a whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
