"""The table of hard cases as LaTeX, over as many pages as it takes; errors only, no times."""

from __future__ import annotations

from collections.abc import Sequence

from synfeal.report.hard_cases.text import Row, error_text, judged, short
from synfeal.report.latex import TONES, escape

WIDTHS_MM = (22, 48, 36, 18, 18, 18)
HEADINGS = ("", "Case", "First thought", "its error", "Our error", "Bound")
CAPTION = (
    r"\noindent\textbf{Hard cases.} Errors against exact answers, of the formula somebody would"
    r" write first and of ours; in colour: above the bound that ours promises."
)


def hard_cases_latex(rows: Sequence[Row]) -> str:
    """A long table of rows of ``hard_cases.csv``; it needs booktabs, longtable, array, xcolor."""
    columns = "".join(rf">{{\raggedright\arraybackslash}}p{{{width}mm}}" for width in WIDTHS_MM)
    lines = [
        CAPTION,
        "",
        r"{\scriptsize\setlength{\tabcolsep}{1mm}",
        rf"\begin{{longtable}}{{{columns}}}",
        rf"\toprule {' & '.join(HEADINGS)} \\ \midrule \endhead",
        *map(_line, rows),
        r"\bottomrule",
        r"\end{longtable}",
        r"\addtocounter{table}{-1}",  # the paper's tables keep their numbers
        "}",
    ]
    return "\n".join(lines)


def _line(row: Row) -> str:
    texts = (row["family"], f"{row['case']} ({judged(row)})", row["naive"])
    errors = [_error(row, column) for column in ("naive_error", "our_error")]
    return " & ".join([*map(escape, texts), *errors, escape(short(float(row["bound"])))]) + r" \\"


def _error(row: Row, column: str) -> str:
    text = escape(error_text(row, column))
    if float(row[column]) <= float(row["bound"]):
        return text
    return rf"\textcolor{{{TONES['worse']}}}{{\textbf{{{text}}}}}"
