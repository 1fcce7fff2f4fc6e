"""Write ``hard_cases.csv``, and show it."""

from __future__ import annotations

import math
import sys

import pandas as pd

from reproduction.hard_cases.cases import CASES, REFUSAL, examined
from reproduction.tables.columns import Column, SideLayout
from reproduction.tables.side import SideTable, Source, Table
from synfeal.records.tables import COUNT, LIMITLESS, NUMBER, TEXT, frame_of

NAME = "hard_cases"
SCHEMA = {
    **dict.fromkeys(("family", "case", "quantity", "unit", "naive", "ours"), TEXT),
    "naive_error": LIMITLESS,
    "our_error": LIMITLESS,
    "bound": NUMBER,
    "ok": COUNT,
    "reference": TEXT,
}


COLUMNS = (
    Column("What", "family"),
    Column("Case", "case", small="judged"),
    Column("First thought", "naive_error", text="naive_text", small="naive", bad="naive_bad"),
    Column("Ours", "our_error", text="our_text", small="ours", bad="our_bad"),
    Column("Bound", "bound", text="bound_text"),
    Column("Truth", "reference", on_paper=False),
)
CAPTION = (
    "Errors against exact answers: of the formula somebody would write first, and of the function"
    " this project uses. ✗ marks errors above the bound that ours promises."
)
REMARK = "None: no answer, or no number; cases without one right answer are to be refused."


def side_layout(table: pd.DataFrame) -> SideLayout:
    """Lay out every case with both errors, the formulas that made them, and the bound."""
    unit = ", " + table.unit
    rows = table.assign(
        judged=table.quantity + unit.where(table.unit != "1", ""),
        bound_text=table.bound.map(short),
        style=(table.family != table.family.shift()).map({True: "first", False: ""}),
    )
    for which in ("naive", "our"):
        error = table[f"{which}_error"]
        refusal = error.map(lambda e: "answered" if e else "refused")
        rows[f"{which}_error"] = error.clip(upper=sys.float_info.max)  # to sort by
        rows[f"{which}_text"] = error.map(short).where(table.quantity != REFUSAL, refusal)
        rows[f"{which}_bad"] = error > table.bound
    return SideLayout(NAME, CAPTION, COLUMNS, rows, REMARK, block="family")


def short(error: float) -> str:
    """Format an error with two digits; ``none`` where there is no finite one."""
    if math.isinf(error):
        return "none"
    if error == 0 or 1e-3 <= error < 1e4:
        return f"{error:.2g}" if error < 100 else f"{error:,.0f}"
    mantissa, exponent = f"{error:.1e}".split("e")
    return f"{mantissa}e{int(exponent)}".replace("-", "\u2212")


@SideTable(name="hard_cases", title="Hard cases", rank=100, mem_mb=2000)
class HardCasesTable(Table):
    """A row for each case that is easy to get wrong."""

    schema = SCHEMA
    layout = staticmethod(side_layout)

    def rows(self, source: Source) -> pd.DataFrame:
        """Run our functions on all cases; errors may be infinite."""
        return frame_of(examined(CASES), SCHEMA)
