"""The outcome of one check."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Check:
    """One line of the report.

    Attributes:
        name: what was checked, one or two words.
        text: how much was checked, and the worst value beside its bound.
        failures: one sentence each, naming the file; the first is printed.
        skipped: nothing was checked, and ``text`` says why.
    """

    name: str
    text: str
    failures: tuple[str, ...] = ()
    skipped: bool = False

    @property
    def verdict(self) -> str:
        """``ok``, ``FAILED`` or ``not checked``."""
        if self.skipped:
            return "not checked"
        return "FAILED" if self.failures else "ok"
