"""``report.tex``: claims, tables and figures as one document that compiles by itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from synfeal.frames import read_records
from synfeal.report.figures import CAPTIONS
from synfeal.report.hard_cases.latex import hard_cases_latex
from synfeal.report.hard_cases.table import COLUMNS
from synfeal.report.hard_cases.table import NAME as HARD_CASES
from synfeal.report.latex import PACKAGES, document_latex, escape, table_bodies, write_text

CLAIM_PACKAGES = (*PACKAGES, "longtable", "array")
WIDTHS_MM = (8, 42, 24, 30, 30, 20, 20)
CLAIM_COLUMNS = (
    *("id", "statement", "published", "measured_labels", "measured_true"),
    *("verdict_labels", "verdict_true"),
)
HEADINGS = (
    *("", "Claim", "Published", "Measured against the labels (the paper's protocol)"),
    *("Measured against the true poses", "Verdict, labels", "Verdict, true poses"),
)


def write_report_document(root: Path, tables: Sequence[Path], out_tex: Path) -> None:
    """Write claims, ``tables`` in their order and figures as one document that compiles there."""
    claims = _rows(root / "claims.csv", [*CLAIM_COLUMNS, "footnote"])
    hard_cases = root / "tables" / f"{HARD_CASES}.csv"
    names = [name for name in CAPTIONS if (root / "figures" / f"{name}.png").is_file()]
    pages = [
        f"{title_latex(root.name)}\n{claims_latex(claims)}",
        *table_bodies(tables),
        *([hard_cases_latex(_rows(hard_cases, COLUMNS))] if hard_cases.is_file() else []),
        *(figure_latex(name, CAPTIONS[name]) for name in names),
    ]
    write_text(out_tex, document_latex(pages, CLAIM_PACKAGES))


def _rows(path: Path, columns: Sequence[str]) -> list[dict[str, str]]:
    return [row for _, row in read_records(path, columns)]


def title_latex(profile: str) -> str:
    """What the document is."""
    return rf"\section*{{Synfeal, reproduced: profile {escape(profile)}}}"


def claims_latex(claims: Sequence[Mapping[str, str]]) -> str:
    """The claims as a table that may run over pages, footnotes below."""
    columns = "".join(rf">{{\raggedright\arraybackslash}}p{{{width}mm}}" for width in WIDTHS_MM)
    notes = [
        rf"\noindent {row['id']}: {escape(row['footnote'])}" for row in claims if row["footnote"]
    ]
    lines = [
        r"{\scriptsize\setlength{\tabcolsep}{1mm}",
        rf"\begin{{longtable}}{{{columns}}}",
        rf"\toprule {' & '.join(map(escape, HEADINGS))} \\ \midrule \endhead",
        *map(_claim, claims),
        r"\bottomrule",
        r"\end{longtable}",
        r"\addtocounter{table}{-1}",  # the paper's tables keep their numbers
        "\n\n".join(notes),
        "}",
    ]
    return "\n".join(lines)


def _claim(row: Mapping[str, str]) -> str:
    return " & ".join(escape(row[name]) for name in CLAIM_COLUMNS) + r" \\ \addlinespace"


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
