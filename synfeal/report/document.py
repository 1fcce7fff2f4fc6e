"""LaTeX documents that compile by themselves: all tables; claims, tables and figures."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from synfeal.files import write_text
from synfeal.frames import read_records
from synfeal.report.figures import CAPTIONS
from synfeal.report.hard_cases.exact import Row, error_text, judged, short
from synfeal.report.hard_cases.table import NAME as HARD_CASES
from synfeal.report.hard_cases.table import SCHEMA
from synfeal.report.results import read_text
from synfeal.report.sheet import HEADER, PACKAGES, TONES, escape

LONG_PACKAGES = (*PACKAGES, "longtable", "array")
# Headings and widths in millimetres.
CLAIMS = {
    **{"": 8, "Claim": 42, "Published": 24},
    "Measured against the labels (the paper's protocol)": 30,
    **{"Measured against the true poses": 30, "Verdict, labels": 20, "Verdict, true poses": 20},
}
CASES = {"": 22, "Case": 48, "First thought": 36, "its error": 18, "Our error": 18, "Bound": 18}
CLAIM_COLUMNS = (
    *("id", "statement", "published", "measured_labels", "measured_true"),
    *("verdict_labels", "verdict_true"),
)
CASES_CAPTION = (
    r"\noindent\textbf{Hard cases.} Errors against exact answers, of the formula somebody would"
    r" write first and of ours; in colour: above the bound that ours promises."
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


def write_report_document(root: Path, tables: Sequence[Path], out_tex: Path) -> None:
    """Write claims, ``tables`` in their order and figures as one document that compiles there."""
    claims = _rows(root / "claims.csv", [*CLAIM_COLUMNS, "footnote"])
    hard_cases = root / "tables" / f"{HARD_CASES}.csv"
    names = [name for name in CAPTIONS if (root / "figures" / f"{name}.png").is_file()]
    title = rf"\section*{{Synfeal, reproduced: profile {escape(root.name)}}}"
    pages = [
        f"{title}\n{claims_latex(claims)}",
        *table_bodies(tables),
        *([hard_cases_latex(_rows(hard_cases, [*SCHEMA]))] if hard_cases.is_file() else []),
        *(figure_latex(name, CAPTIONS[name]) for name in names),
    ]
    write_text(out_tex, document_latex(pages, LONG_PACKAGES))


def _rows(path: Path, columns: Sequence[str]) -> list[dict[str, str]]:
    return [row for _, row in read_records(path, columns)]


def claims_latex(claims: Sequence[Row]) -> str:
    """The claims, footnotes below."""
    lines = [
        " & ".join(escape(row[name]) for name in CLAIM_COLUMNS) + r" \\ \addlinespace"
        for row in claims
    ]
    notes = [
        rf"\noindent {row['id']}: {escape(row['footnote'])}" for row in claims if row["footnote"]
    ]
    return long_table(CLAIMS, lines, "\n\n".join(notes))


def hard_cases_latex(rows: Sequence[Row]) -> str:
    """Rows of ``hard_cases.csv``: errors only, no times."""
    return f"{CASES_CAPTION}\n\n{long_table(CASES, map(_case, rows))}"


def long_table(widths_mm: Mapping[str, int], lines: Iterable[str], *below: str) -> str:
    """A table over as many pages as it takes, widths of its columns by heading."""
    columns = "".join(
        rf">{{\raggedright\arraybackslash}}p{{{width}mm}}" for width in widths_mm.values()
    )
    parts = [
        r"{\scriptsize\setlength{\tabcolsep}{1mm}",
        rf"\begin{{longtable}}{{{columns}}}",
        rf"\toprule {' & '.join(map(escape, widths_mm))} \\ \midrule \endhead",
        *lines,
        r"\bottomrule",
        r"\end{longtable}",
        r"\addtocounter{table}{-1}",  # the paper's tables keep their numbers
        *below,
        "}",
    ]
    return "\n".join(parts)


def _case(row: Row) -> str:
    texts = (row["family"], f"{row['case']} ({judged(row)})", row["naive"])
    errors = [_error(row, column) for column in ("naive_error", "our_error")]
    return " & ".join([*map(escape, texts), *errors, escape(short(float(row["bound"])))]) + r" \\"


def _error(row: Row, column: str) -> str:
    text = escape(error_text(row, column))
    if float(row[column]) <= float(row["bound"]):
        return text
    return rf"\textcolor{{{TONES['worse']}}}{{\textbf{{{text}}}}}"


def figure_latex(name: str, caption: str) -> str:
    """A figure as wide as the page, or as high as it."""
    return "\n".join(
        [
            r"\begin{figure}[p]",
            r"\centering",
            r"\includegraphics[width=\linewidth,height=0.85\textheight,keepaspectratio]"
            f"{{figures/{name}.png}}",
            rf"\caption{{{escape(caption)}}}",
            r"\end{figure}",
        ]
    )
