"""LaTeX documents that compile by themselves: all tables; claims, tables and figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from reproduction.figures.registry import CAPTIONS
from reproduction.hard_cases import table as hard_cases
from reproduction.runs.results import read_text
from reproduction.tables.columns import side_sheet
from reproduction.tables.sheet import HEADER, PACKAGES, escape, sheet_latex
from synfeal.records.files import write_text
from synfeal.records.tables import TEXT, read_frame, records_of

LONG_PACKAGES = (*PACKAGES, "longtable", "array")
# Headings and widths in millimetres.
CLAIMS = {
    **{"": 8, "Claim": 36, "Published": 22},
    "Measured against the labels (the paper's protocol)": 27,
    **{"Measured against the true poses": 27, "Verdict, labels": 20, "Verdict, true poses": 20},
}
CLAIM_COLUMNS = (
    *("id", "statement", "published", "measured_labels", "measured_true"),
    *("verdict_labels", "verdict_true"),
)


def write_document(tables: Sequence[Path], out_tex: Path) -> None:
    """Write a complete document that holds the given tables, in order, and nothing else."""
    write_text(out_tex, document_latex(table_bodies(tables)))


def write_report_document(root: Path, tables: Sequence[Path], out_tex: Path) -> None:
    """Write claims, ``tables`` in their order and figures as one document that compiles there."""
    claims = read_frame(root / "claims.csv", dict.fromkeys((*CLAIM_COLUMNS, "footnote"), TEXT))
    cases = root / "tables" / f"{hard_cases.NAME}.csv"
    names = [name for name in CAPTIONS if (root / "figures" / f"{name}.png").is_file()]
    title = rf"\section*{{Synfeal, reproduced: profile {escape(root.name)}}}"
    pages = [f"{title}\n{claims_latex(records_of(claims))}", *table_bodies(tables)]
    if cases.is_file():
        found = hard_cases.side_table(read_frame(cases, hard_cases.SCHEMA))
        pages.append(sheet_latex(side_sheet(found)))
    pages += [figure_latex(name, CAPTIONS[name]) for name in names]
    write_text(out_tex, document_latex(pages, LONG_PACKAGES))


def table_bodies(tables: Sequence[Path]) -> list[str]:
    """The table environments of files that :func:`reproduction.tables.sheet.write_latex` wrote."""
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


def claims_latex(claims: Sequence[Mapping[str, str]]) -> str:
    """The claims over as many pages as they take, footnotes below."""
    columns = "".join(rf">{{\raggedright\arraybackslash}}p{{{mm}mm}}" for mm in CLAIMS.values())
    lines = [
        " & ".join(escape(row[name]) for name in CLAIM_COLUMNS) + r" \\ \addlinespace"
        for row in claims
    ]
    notes = [
        rf"\noindent {row['id']}: {escape(row['footnote'])}" for row in claims if row["footnote"]
    ]
    parts = [
        r"{\scriptsize\setlength{\tabcolsep}{1mm}",
        rf"\begin{{longtable}}{{{columns}}}",
        rf"\toprule {' & '.join(map(escape, CLAIMS))} \\ \midrule \endhead",
        *lines,
        r"\bottomrule",
        r"\end{longtable}",
        r"\addtocounter{table}{-1}",  # the paper's tables keep their numbers
        "\n\n".join(notes),
        "}",
    ]
    return "\n".join(parts)


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
