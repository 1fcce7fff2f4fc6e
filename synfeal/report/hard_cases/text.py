"""How rows of the table read, in HTML and in LaTeX alike."""

from __future__ import annotations

import math
from collections.abc import Mapping

from synfeal.report.hard_cases.case import REFUSAL

Row = Mapping[str, str]


def judged(row: Row) -> str:
    """What the error of a row is of, and its unit."""
    return row["quantity"] if row["unit"] == "1" else f"{row['quantity']}, {row['unit']}"


def error_text(row: Row, column: str) -> str:
    """An error of a row as it is printed; of a case to be refused, whether it was."""
    error = float(row[column])
    if row["quantity"] == REFUSAL:
        return "refused" if error == 0 else "answered"
    return short(error)


def short(error: float) -> str:
    """An error at two digits; ``none`` where there is no finite one."""
    if math.isinf(error):
        return "none"
    if error == 0 or 1e-3 <= error < 1e4:
        return f"{error:.2g}" if error < 100 else f"{error:,.0f}"
    mantissa, exponent = f"{error:.1e}".split("e")
    return f"{mantissa}e{int(exponent)}".replace("-", "\u2212")
