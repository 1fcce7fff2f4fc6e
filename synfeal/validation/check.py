"""Outcome of a check."""

from __future__ import annotations

from dataclasses import dataclass

PNG = ("PNG",)  # the format of every image of a data set, whatever its name


@dataclass(frozen=True)
class Check:
    """One line of the report."""

    name: str  # what was checked, one or two words
    text: str  # how much was checked, and the worst value beside its bound
    failures: tuple[str, ...] = ()  # one sentence each, naming the file; the first is printed
    skipped: bool = False  # nothing was checked, and ``text`` says why

    @property
    def verdict(self) -> str:
        """``ok``, ``FAILED`` or ``not checked``."""
        if self.skipped:
            return "not checked"
        return "FAILED" if self.failures else "ok"
