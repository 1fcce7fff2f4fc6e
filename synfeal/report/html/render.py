"""Pieces of the page from their templates, and tables that a reader can sort."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

ENVIRONMENT = Environment(
    loader=PackageLoader("synfeal.report.html"),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)


def render(template: str, **values: Any) -> Markup:
    """A template of the folder ``templates`` with its values."""
    return Markup(ENVIRONMENT.get_template(template).render(**values))


# The score that the switch on the page shows, and how names of its columns end.
SCORES = {"labels": "", "true": "_true"}


@dataclass(frozen=True)
class Column:
    """A column of a table on the page."""

    title: str  # its heading
    name: str = ""  # of the frame's column that it shows
    form: str = ""  # how its numbers are written, for :meth:`str.format`; empty for text
    factor: float = 1.0  # so many times the number is shown
    text: str = ""  # column of the frame that says how a number is written, in place of ``form``
    paper: str = ""  # column with the paper's number, set below
    small: str = ""  # column with more text, set small below
    bad: str = ""  # column that says whether a number is marked as bad
    # There are two numbers, against the labels and the true poses (``<name>_true``), with 95 %
    # limits (``_low``, ``_high``).
    scored: bool = False

    @property
    def is_number(self) -> bool:
        """Set to the right, digits aligned."""
        return bool(self.form or self.text)


def sortable(name: str, caption: str, columns: Sequence[Column], frame: pd.DataFrame) -> Markup:
    """A table with a row per row of a frame; ``caption`` is HTML.

    A column ``style`` of the frame, where there is one, names a class for each row.
    """
    rows = [
        {"style": row.get("style", ""), "cells": [_cell(row, column) for column in columns]}
        for row in frame.to_dict("records")
    ]
    values = {"name": name, "caption": Markup(caption), "columns": columns}
    return render("plain_table.html", **values, rows=rows)


NOTHING = {"scores": [], "is_number": False, "sort": "", "paper": "", "bad": False}


def _cell(row: dict[Any, Any], column: Column) -> dict[str, Any]:
    small = row[column.small] if column.small else ""
    if column.scored:
        return NOTHING | {"scores": [_score(row, column, style) for style in SCORES]}
    value = row[column.name]
    if not column.is_number:
        return NOTHING | {"text": value, "small": small}
    return {
        "scores": [],
        "is_number": True,
        "sort": "" if pd.isna(value) else value,
        "text": row[column.text] if column.text else shown(value, column),
        "paper": shown(row[column.paper], column, "") if column.paper else "",
        "small": small,
        "bad": bool(column.bad) and row[column.bad],
    }


def _score(row: dict[Any, Any], column: Column, style: str) -> dict[str, Any]:
    """One of two scores with its limits."""
    name = f"{column.name}{SCORES[style]}"
    number = column.form.partition("}")[0] + "}"  # without its unit
    value, low, high = (row[f"{name}{end}"] for end in ("", "_low", "_high"))
    limits = (
        ""
        if pd.isna([low, high]).any()
        else "–".join(number.format(column.factor * limit) for limit in (low, high))
    )
    sort = "" if pd.isna(value) else value
    return {"style": style, "sort": sort, "text": shown(value, column), "small": limits}


def shown(value: float, column: Column, missing: str = "–") -> str:
    """A number as a column writes it."""
    return missing if pd.isna(value) else column.form.format(column.factor * value)
