"""Tables of text: aligned for a terminal, or as Markdown."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

PLAIN, MARKDOWN = "plain", "pipe"


def text_table(rows: Sequence[Sequence[str]], n_left: int = 1, form: str = PLAIN) -> str:
    """Rows, the first of them the headings; columns are right-aligned but the first ``n_left``."""
    sides = ["left" if i < n_left else "right" for i in range(len(rows[0]))]
    frame = pd.DataFrame(rows[1:], columns=list(rows[0]))
    text = frame.to_markdown(index=False, tablefmt=form, disable_numparse=True, colalign=sides)
    return "".join(f"{line.rstrip()}\n" for line in text.splitlines())
