"""A table as it is read on paper: LaTeX by pandas' Styler, Markdown by tabulate.

A sheet has lines (the regenerated errors of a data set, the same against the true poses, the
paper's) and values, one row per printed number. Text is Unicode; the writers translate it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from synfeal.files import write_text
from synfeal.frames import rows_of

# Columns of lines: a rule stands between blocks, a thin gap between rows.
LINE = ("block", "row", "kind", "label", "label_note", "against")
# Columns of values: `line` counts the lines, `column` is a heading, `place` an order in the cell.
VALUE = ("line", "column", "place", "text", "bold", "tone", "note")
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
        **{"τ": r"$\tau$", "β": r"$\beta$", "θ": r"$\theta$", "π": r"$\pi$", "✗": r"$\times$"},
        **{"<": "$<$", ">": "$>$"},
    }
)
PAPER = "paper"
PLAIN, MARKDOWN = "plain", "pipe"  # tables of text for a terminal, for a page


@dataclass(frozen=True)
class Sheet:
    """A table and what stands around it."""

    name: str  # file name without suffix; also the label references use
    caption: str  # one or two sentences
    headings: tuple[str, ...]  # of the label, of what errors are against, and of every column
    # Columns ``LINE``, one row per printed line; those of kind ``PAPER`` are grey.
    lines: pd.DataFrame
    values: pd.DataFrame  # columns ``VALUE``; a ``tone`` is ``better``, ``worse`` or empty
    remarks: tuple[str, ...] = ()  # sentences below the table that belong to no single cell


@dataclass(frozen=True)
class _Format:
    """How a language writes a number, the mark of a footnote, and a cell of a line."""

    value: Callable[[Any, str], str]
    mark: Callable[[str], str]
    cell: Callable[[str, str], str] = lambda text, kind: text


def footnotes(sheet: Sheet) -> dict[str, str]:
    """Marks (a, b, c, ...) of all distinct footnotes in reading order."""
    order = {heading: place for place, heading in enumerate(sheet.headings)}
    labels = sheet.lines.assign(line=sheet.lines.index, at=-1, note=sheet.lines.label_note)
    cells = sheet.values.assign(at=sheet.values["column"].map(order))
    notes = pd.concat([frame[["line", "at", "note"]] for frame in (labels, cells)])
    found = notes[notes.note != ""].sort_values(["line", "at"], kind="stable").note.unique()
    return {note: chr(ord("a") + place) for place, note in enumerate(found)}


def write_latex(path: Path, sheet: Sheet) -> None:
    """Write one table environment, ready to be input by a document."""
    write_text(path, HEADER + sheet_latex(sheet))


def sheet_latex(sheet: Sheet) -> str:
    """The table environment of a sheet, ending in a newline."""
    marks = footnotes(sheet)
    table = _table(sheet, _LATEX, marks)
    table.columns = pd.Index(map(_heading, sheet.headings, range(len(sheet.headings))))
    if sheet.lines.block.any():
        table.insert(0, "", _upright(sheet.lines.block), allow_duplicates=True)
    layout = "l" * table.shape[1]
    tabular = table.style.hide(axis="index").to_latex(hrules=True, column_format=layout)
    head, _, tail = tabular.partition("\\midrule\n")
    body, _, end = tail.partition("\\bottomrule\n")
    notes = [rf"$^{{{mark}}}$ {escape(note)}" for note, mark in marks.items()]
    below = r"\scriptsize " + r" \par ".join([*map(escape, sheet.remarks), *notes])
    lines = [
        r"\begin{table*}[tp]",
        r"\centering\footnotesize",
        rf"\caption{{{escape(sheet.caption)}}}",
        rf"\label{{tab:{sheet.name}}}\smallskip",
        r"\resizebox{\ifdim\width>\linewidth\linewidth\else\width\fi}{!}{%",
        f"{head}\\midrule",
        *_ruled(body.splitlines(), sheet.lines),
        f"\\bottomrule\n{end.rstrip()}}}",
        r"\par\smallskip",
        rf"\begin{{minipage}}{{\linewidth}}{below}\end{{minipage}}",
        r"\end{table*}",
    ]
    return "\n".join(lines) + "\n"


def _heading(heading: str, place: int) -> str:
    """A heading; what follows a comma stands below but in the first column."""
    first, comma, rest = escape(heading).partition(", ")
    return rf"\shortstack[l]{{{first}\\{rest}}}" if place and comma else first + comma + rest


def escape(text: str) -> str:
    """Unicode text as LaTeX; a sign before a number becomes a minus sign, not a hyphen."""
    return text.translate(SPECIAL)


def sheet_markdown(sheet: Sheet) -> str:
    """A table with its caption above and its footnotes below, ending in a newline."""
    marks = footnotes(sheet)
    table = _table(sheet, _MARKDOWN, marks)
    if sheet.lines.block.any():
        first = sheet.lines.block != sheet.lines.block.shift()
        table.insert(0, "", sheet.lines.block.where(first, ""), allow_duplicates=True)
    notes = "\n".join(f"({mark}) {note}  " for note, mark in marks.items())
    parts = (f"**{sheet.caption}**", markdown_table(table), notes)
    return "\n\n".join(part for part in parts if part) + "\n"


def markdown_table(table: pd.DataFrame) -> str:
    """A frame of texts as Markdown, its cells as wide as what they hold."""
    padded = table.to_markdown(index=False, disable_numparse=True)
    return re.sub(r":?-{3,}:?", "---", re.sub(r" {2,}(?=\|)", " ", padded))


def text_table(rows: Sequence[Sequence[str]], n_left: int = 1, form: str = PLAIN) -> str:
    """Rows, the first of them the headings; columns are right-aligned but the first ``n_left``."""
    sides = ["left" if i < n_left else "right" for i in range(len(rows[0]))]
    frame = pd.DataFrame(rows[1:], columns=list(rows[0]))
    text = frame.to_markdown(index=False, tablefmt=form, disable_numparse=True, colalign=sides)
    return "".join(f"{line.rstrip()}\n" for line in text.splitlines())


def _table(sheet: Sheet, form: _Format, marks: Mapping[str, str]) -> pd.DataFrame:
    """Lines by heading, as text of a language."""
    cells = dict(iter(sheet.values.groupby(["line", "column"], sort=False)))
    rows = []
    for line in rows_of(sheet.lines):
        texts = [form.value(_Plain(text), line.kind) for text in (line.label, line.against)]
        texts[0] += form.mark(marks[line.label_note]) if line.label_note else ""
        for heading in sheet.headings[2:]:
            cell = cells.get((line.Index, heading))
            texts.append("" if cell is None else _cell(cell, line.kind, form, marks))
        rows.append([form.cell(text, line.kind) for text in texts])
    return pd.DataFrame(rows, columns=list(sheet.headings), index=sheet.lines.index)


def _cell(values: pd.DataFrame, kind: str, form: _Format, marks: Mapping[str, str]) -> str:
    """The numbers of a cell, and the mark of its footnote."""
    texts = [form.value(value, kind) for value in rows_of(values.sort_values("place"))]
    note = values.note.iloc[0]
    return ", ".join(texts) + (form.mark(marks[note]) if note else "")


@dataclass(frozen=True)
class _Plain:
    text: str
    bold: bool = False
    tone: str = ""


def _latex_value(value: Any, kind: str) -> str:
    text = escape(value.text)
    if value.tone:
        sign = text.replace("-", "$-$").replace("+", "$+$")
        return rf"\textcolor{{{TONES[value.tone]}}}{{{sign}}}"
    return rf"\textbf{{{text}}}" if value.bold else text


def _markdown_value(value: Any, kind: str) -> str:
    # Each number is emphasised by itself: renderers disagree on emphasis inside emphasis.
    emphasis = ("*" if kind == PAPER else "") + ("**" if value.bold else "")
    return f"{emphasis}{value.text}{emphasis}" if value.text else ""


_LATEX = _Format(
    _latex_value,
    lambda mark: rf"$^{{{mark}}}$",
    lambda text, kind: rf"\textcolor{{gray}}{{{text}}}" if kind == PAPER and text else text,
)
_MARKDOWN = _Format(_markdown_value, lambda mark: f" ({mark})")


def _upright(blocks: pd.Series) -> list[str]:
    """A block's title at its middle, upright where the block is tall enough for it."""
    titles = [""] * len(blocks)
    for title, lines in blocks.groupby(blocks, sort=False):
        bold = rf"\textbf{{{escape(str(title))}}}"
        if len(str(title)) <= 2 * len(lines):
            # A box without height leaves the line spacing alone; no package for it is needed.
            bold = rf"\smash{{\rotatebox[origin=c]{{90}}{{{bold}}}}}"
        titles[blocks.index.get_loc(lines.index[len(lines) // 2])] = bold
    return titles


def _ruled(body: Sequence[str], lines: pd.DataFrame) -> list[str]:
    """Lines of a table with a rule before each new block, a thin gap before each new row."""
    ruled: list[str] = []
    blocks, rows = (lines[name].ne(lines[name].shift()) for name in ("block", "row"))
    for text, block, row in zip(body, blocks, rows, strict=True):
        if ruled and (block or row):
            ruled.append(r"\midrule" if block else r"\addlinespace")
        ruled.append(text)
    return ruled
