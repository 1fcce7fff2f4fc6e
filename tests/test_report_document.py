"""report.tex: everything in one document, which compiles; LaTeX of a table, letter by letter."""

import shutil
import subprocess

import pandas as pd
import pytest
from PIL import Image

from synfeal.errors import InputError
from synfeal.frames import TEXT, read_frame, write_frame
from synfeal.report.cells import FOLDER
from synfeal.report.document import CLAIM_COLUMNS, write_report_document
from synfeal.report.figures import CAPTIONS
from synfeal.report.sheet import LINE, PAPER, VALUE, Sheet, sheet_latex, sheet_markdown, write_latex

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


def small_sheet():
    lines = pd.DataFrame(
        [
            ("", 0, "labels", "6k", "", "labels"),
            ("", 0, PAPER, "6k", "", "paper"),
            ("", 1, "labels", "20k", "", "labels"),
        ],
        columns=list(LINE),
    )
    values = [
        *((0, "PoseNet", 0, "0.50 m"), (0, "PoseNet", 1, "9.00°"), (0, "PoseNet2", 0, "0.40 m")),
        *((0, "PoseNet2", 1, "8.00°"), (1, "PoseNet", 0, "0.29 m")),
        (1, "PoseNet2", 0, "0.14 m", False, "", "Misprint."),
        *((2, "PoseNet", 0, "0.45 m", True), (2, "PoseNet", 1, "7.00°", True)),
        (2, "PoseNet2", 0, "+2.0%", False, "worse"),
    ]
    whole = [(*value, *(False, "", "")[len(value) - 4 :]) for value in values]
    headings = ("Set", "Error against", "PoseNet", "PoseNet2")
    table = pd.DataFrame(whole, columns=list(VALUE))
    return Sheet("small", "Errors of 2 & 3.", headings, lines, table, ("A remark.",))


def test_a_small_table_letter_by_letter():
    assert sheet_latex(small_sheet()) == GOLDEN
    assert sheet_markdown(small_sheet()) == (
        "**Errors of 2 & 3.**\n\n"
        "| Set | Error against | PoseNet | PoseNet2 |\n"
        "|---|---|---|---|\n"
        "| 6k | labels | 0.50 m, 9.00° | 0.40 m, 8.00° |\n"
        "| *6k* | *paper* | *0.29 m* | *0.14 m* (a) |\n"
        "| 20k | labels | **0.45 m**, **7.00°** | +2.0% |\n\n"
        "(a) Misprint.  \n"
    )


@pytest.fixture
def root(tmp_path):
    """Results with one table, every published claim, and two figures."""
    write_latex(tmp_path / "tables" / "small.tex", small_sheet())
    published = read_frame(FOLDER / "claims.csv", {"id": TEXT, "statement": TEXT, "footnote": TEXT})
    filled = {name: "p −55 % [−60, −50] & _τ_" for name in CLAIM_COLUMNS if name not in published}
    write_frame(tmp_path / "claims.csv", published.assign(**filled))
    (tmp_path / "figures").mkdir()
    for name in list(CAPTIONS)[:2]:
        Image.new("RGB", (60, 40), (200, 30, 30)).save(tmp_path / "figures" / f"{name}.png")
    return tmp_path


def test_document_holds_claims_tables_and_the_figures_there_are(root):
    write_report_document(root, [root / "tables" / "small.tex"], root / "report.tex")
    text = (root / "report.tex").read_text(encoding="utf-8")
    assert all(f"\nC{number} & " in text for number in range(1, 17))
    assert text.count(r"\includegraphics") == 2
    assert r"\label{tab:small}" in text
    assert "55 \\%" in text
    (root / "claims.csv").unlink()
    with pytest.raises(InputError, match=r"claims\.csv"):
        write_report_document(root, [], root / "report.tex")


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_document_compiles(root):
    write_report_document(root, [root / "tables" / "small.tex"], root / "report.tex")
    command = ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "report.tex"]
    for _ in range(2):
        done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout[-2000:]
    assert (root / "report.pdf").stat().st_size > 10_000
