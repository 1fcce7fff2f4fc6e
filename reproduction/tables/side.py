"""Write side tables: what each is made from, and how its files are written and read."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, ClassVar, NamedTuple

import pandas as pd

from reproduction.design.experiments import Design
from reproduction.design.side_tables import SIDE_TABLES, SideTable
from reproduction.tables.columns import SideLayout, write_side
from synfeal.records.tables import Schema, read_frame, write_frame

__all__ = ["SideTable", "Source", "Table", "table_named", "write_side_table"]


class Source(NamedTuple):
    """Inputs of a side table.

    Attributes:
        root: Results of the profile, below which lie the files that the table needs.
        design: The profile's table of experiments.
        settings: Parts of the profile that the table's declaration names, ready to be validated.
    """

    root: Path
    design: Design
    settings: Mapping[str, Any] = {}

    @property
    def scenes(self) -> list[str]:
        """Scenes of the design, by name."""
        return sorted({row.scene for row in self.design.rows})


class Table(ABC):
    """A side table; its class is declared by :class:`SideTable`.

    Attributes:
        schema: Columns of its CSV, and their kinds.
        float_format: Format of its floats, ``%`` style.
    """

    schema: ClassVar[Schema]
    float_format: ClassVar[str] = "%.6g"

    @abstractmethod
    def rows(self, source: Source) -> pd.DataFrame:
        """Compute the table, columns ``schema``.

        Raises:
            InputError: a file cannot be read, or was damaged.
        """

    @abstractmethod
    def layout(self, rows: pd.DataFrame, /) -> SideLayout:
        """Lay out the rows for the page, LaTeX and Markdown."""

    def findings(self, rows: pd.DataFrame, /) -> Sequence[str]:
        """List sentences about the rows for the head of ``summary.md``."""
        return ()


def table_named(name: str) -> Table:
    """Import a side table.

    Args:
        name: Key of ``SIDE_TABLES``.
    """
    table: Table = resolve_name(SIDE_TABLES[name].place)()
    return table


def write_side_table(
    side: str,
    design: Design,
    settings: dict[str, Any],
    root: Path,
    out_csv: Path,
    out_tex: Path,
) -> None:
    """Write a side table.

    Args:
        side: Key of ``SIDE_TABLES``.
        design: The profile's table of experiments.
        settings: Parts of the profile that its declaration names.
        root: Results of the profile.
        out_csv: CSV to write, columns of the table's schema.
        out_tex: LaTeX to write.

    Raises:
        InputError: a file that the table needs cannot be read, or was damaged.
    """
    table = table_named(side)
    rows = table.rows(Source(root, design, settings))
    write_frame(out_csv, rows, table.float_format)
    write_side(out_tex, table.layout(rows))


def read_side_table(name: str, path: Path) -> tuple[pd.DataFrame, SideLayout]:
    """Read a side table that was written before, and lay it out.

    Args:
        name: Key of ``SIDE_TABLES``.
        path: Its CSV.
    """
    table = table_named(name)
    rows = read_frame(path, table.schema)
    return rows, table.layout(rows)
