"""LaTeX of a grid: booktabs, in the paper's layout, for any document with three common packages."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from synfeal.files import atomic_path
from synfeal.report.grid import Entry, Grid, Group, Line, Value, footnotes
from synfeal.report.results import read_text

PACKAGES = ("booktabs", "graphicx", "xcolor")
HEADER = f"% Needs \\usepackage{{{','.join(PACKAGES)}}}\n"
# Plain xcolor mixes, so that no package option is needed; both stay apart from black in grey print.
TONES = {"better": "green!45!black", "worse": "red!85!black"}
SPECIAL = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "#": r"\#",
    "_": r"\_",
    "$": r"\$",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "°": r"$^\circ$",
    "±": r"$\pm$",
    "−": "$-$",
    "→": r"$\to$",
    "≥": r"$\ge$",
    "≤": r"$\le$",
    "×": r"$\times$",
    "·": r"$\cdot$",
    "τ": r"$\tau$",
    "β": r"$\beta$",
    "θ": r"$\theta$",
    "π": r"$\pi$",
    "Σ": r"$\Sigma$",
    "|": r"\textbar{}",
    "√": r"$\surd$",
    "ᵀ": r"$^\top$",
    "²": r"$^2$",
    "…": r"\ldots{}",
    "³": r"$^3$",
    "–": "--",
}


def write_latex(path: Path, grid: Grid) -> None:
    """Write one table environment, ready to be input by a document."""
    write_text(path, HEADER + table_latex(grid))


def write_document(tables: Sequence[Path], out_tex: Path) -> None:
    """Write a complete document that holds the given tables, in order, and nothing else."""
    write_text(out_tex, document_latex(table_bodies(tables)))


def table_bodies(tables: Sequence[Path]) -> list[str]:
    """The table environments of files that :func:`write_latex` wrote.

    Raises:
        InputError: one of them cannot be read.
    """
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
    return "".join(SPECIAL.get(character, character) for character in text)


def table_latex(grid: Grid) -> str:
    """The table environment of a grid, ending in a newline."""
    marks = {note: chr(ord("a") + i) for i, note in enumerate(footnotes(grid))}
    blocks = any(group.title for group in grid.groups)
    heading = [*([""] if blocks else []), *map(escape, grid.columns)]
    bodies = [_group(group, blocks, marks) for group in grid.groups]
    lines = [
        r"\begin{table*}[tp]",
        r"\centering\footnotesize",
        rf"\caption{{{escape(grid.caption)}}}",
        rf"\label{{tab:{grid.name}}}\smallskip",
        r"\resizebox{\ifdim\width>\linewidth\linewidth\else\width\fi}{!}{%",
        rf"\begin{{tabular}}{{{'l' * len(heading)}}}",
        r"\toprule",
        " & ".join(heading) + r" \\",
        r"\midrule",
        "\n\\midrule\n".join(bodies),
        r"\bottomrule",
        r"\end{tabular}}",
        *_remarks(grid, marks),
        r"\end{table*}",
    ]
    return "\n".join(lines) + "\n"


def _group(group: Group, blocks: bool, marks: dict[str, str]) -> str:
    """All lines of a block; a thin gap between its rows, its title upright at the middle."""
    rows = [[_line(line, marks) for line in row] for row in group.rows]
    if blocks:
        count = sum(map(len, rows))
        titles = iter([_title(group.title, count) if i == count // 2 else "" for i in range(count)])
        rows = [[f"{next(titles)} & {line}" for line in row] for row in rows]
    return "\n\\addlinespace\n".join("\n".join(row) for row in rows)


def _title(title: str, n_lines: int) -> str:
    """A block's title, upright where the block is tall enough for it."""
    bold = rf"\textbf{{{escape(title)}}}"
    if len(title) > 2 * n_lines:
        return bold
    # A box without height leaves the line spacing alone; no package for tall cells is needed.
    return rf"\smash{{\rotatebox[origin=c]{{90}}{{{bold}}}}}"


def _line(line: Line, marks: dict[str, str]) -> str:
    label = escape(line.label) + _mark(line.label_note, marks)
    entries = [_entry(entry, marks) for entry in line.entries]
    cells = [label, escape(line.against), *entries]
    if line.kind == "paper":
        cells = [rf"\textcolor{{gray}}{{{cell}}}" if cell else "" for cell in cells]
    return " & ".join(cells) + r" \\"


def _entry(entry: Entry, marks: dict[str, str]) -> str:
    return ", ".join(map(_value, entry.values)) + _mark(entry.note, marks)


def _value(value: Value) -> str:
    text = escape(value.text)
    if value.tone:
        sign = text.replace("-", "$-$").replace("+", "$+$")
        return rf"\textcolor{{{TONES[value.tone]}}}{{{sign}}}"
    return rf"\textbf{{{text}}}" if value.bold else text


def _mark(note: str, marks: dict[str, str]) -> str:
    return rf"$^{{{marks[note]}}}$" if note else ""


def _remarks(grid: Grid, marks: dict[str, str]) -> list[str]:
    notes = [rf"$^{{{mark}}}$ {escape(note)}" for note, mark in marks.items()]
    remarks = [*map(escape, grid.remarks), *notes]
    body = r"\scriptsize " + r" \par ".join(remarks)
    return [r"\par\smallskip", rf"\begin{{minipage}}{{\linewidth}}{body}\end{{minipage}}"]


def write_text(path: Path, text: str) -> None:
    """Write a file as a whole or not at all."""
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
