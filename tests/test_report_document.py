"""report.tex: everything in one document, which compiles; LaTeX of a table, letter by letter."""

from __future__ import annotations

import csv
import shutil
import subprocess
from pathlib import Path

import pytest
from PIL import Image

from synfeal.errors import InputError
from synfeal.report.document import CLAIM_COLUMNS, write_report_document
from synfeal.report.figures import CAPTIONS
from synfeal.report.grid import Entry, Grid, Group, Line, Value, with_bold
from synfeal.report.latex import table_latex, write_latex
from synfeal.report.published import FOLDER

GOLDEN = r"""\begin{table*}[tp]
\centering\footnotesize
\caption{Errors of 2 \& 3.}
\label{tab:small}\smallskip
\resizebox{\ifdim\width>\linewidth\linewidth\else\width\fi}{!}{%
\begin{tabular}{llll}
\toprule
Set & Error against & PoseNet & PoseNet2 \\
\midrule
6k & labels & 0.50 m, 9.00$^\circ$ & 0.40 m, 8.00$^\circ$ \\
\textcolor{gray}{6k} & \textcolor{gray}{paper} & \textcolor{gray}{0.29 m} & \textcolor{gray}{0.14 m$^{a}$} \\
\addlinespace
20k & labels & \textbf{0.45 m}, \textbf{7.00$^\circ$} & \textcolor{red!85!black}{$+$2.0\%} \\
\bottomrule
\end{tabular}}
\par\smallskip
\begin{minipage}{\linewidth}\scriptsize A remark. \par $^{a}$ Misprint.\end{minipage}
\end{table*}
"""  # noqa: E501


def small_grid() -> Grid:
    def line(kind: str, label: str, against: str, *entries: Entry) -> Line:
        return Line(kind, label, against, entries)  # type: ignore[arg-type]

    def pair(metres: float, degrees: float) -> Entry:
        return Entry((Value(f"{metres:.2f} m", metres), Value(f"{degrees:.2f}°", degrees)))

    first = (
        line("labels", "6k", "labels", pair(0.5, 9), pair(0.4, 8)),
        line(
            *("paper", "6k", "paper"),
            *(Entry((Value("0.29 m", 0.29),)), Entry((Value("0.14 m", 0.14),), "Misprint.")),
        ),
    )
    worse = Entry((Value("+2.0%", tone="worse"),))
    second = (line("labels", "20k", "labels", pair(0.45, 7), worse),)
    columns = ("Set", "Error against", "PoseNet", "PoseNet2")
    rows = with_bold([first, second])
    return Grid("small", "Errors of 2 & 3.", columns, (Group("", rows),), ("A remark.",))


def test_latex_of_a_small_table_letter_by_letter() -> None:
    # PoseNet2's second row has no number, so the first of its column wins against nothing.
    assert table_latex(small_grid()) == GOLDEN


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """Results with one table, every published claim, and two figures."""
    write_latex(tmp_path / "tables" / "small.tex", small_grid())
    with (FOLDER / "claims.csv").open(encoding="utf-8", newline="") as file:
        published = list(csv.DictReader(file))
    columns = [*CLAIM_COLUMNS, "footnote"]
    with (tmp_path / "claims.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(
            file, columns, restval="p −55 % [−60, −50] & _τ_", extrasaction="ignore"
        )
        writer.writeheader()
        writer.writerows(published)
    (tmp_path / "figures").mkdir()
    for name in list(CAPTIONS)[:2]:
        Image.new("RGB", (60, 40), (200, 30, 30)).save(tmp_path / "figures" / f"{name}.png")
    return tmp_path


def test_document_holds_claims_tables_and_the_figures_there_are(root: Path) -> None:
    write_report_document(root, [root / "tables" / "small.tex"], root / "report.tex")
    text = (root / "report.tex").read_text(encoding="utf-8")
    assert all(f"\nC{number} & " in text for number in range(1, 17))
    assert text.count(r"\includegraphics") == 2
    assert r"\label{tab:small}" in text
    assert "55 \\%" in text


def test_missing_claims_are_an_input_error(root: Path) -> None:
    (root / "claims.csv").unlink()
    with pytest.raises(InputError, match=r"claims\.csv"):
        write_report_document(root, [], root / "report.tex")


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_document_compiles(root: Path) -> None:
    write_report_document(root, [root / "tables" / "small.tex"], root / "report.tex")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "report.tex"]
    for _ in range(2):
        done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout[-2000:]
    assert (root / "report.pdf").stat().st_size > 10_000
