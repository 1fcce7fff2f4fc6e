"""Names of label sets: a source, and for injected errors their size, as in ``noise-p0.1-r5``."""

from __future__ import annotations

import re
from typing import NamedTuple

# Wildcards of the rules; numbers are written as briefly as they can be.
INJECTED_PATTERN = "{error_kind}-p{noise_m}-r{noise_deg}"
_INJECTED = re.compile(r"(?P<source>[\w-]+)-p(?P<noise_m>[\d.]+)-r(?P<noise_deg>[\d.]+)")


class LabelSet(NamedTuple):
    """A label set, whose text is the name of its directory.

    Attributes:
        source: ``synfeal``, a label method, or the kind of an injected error.
        noise_m: Size of an injected error of position, metres, as its row names it.
        noise_deg: The same of orientation, degrees.
    """

    source: str
    noise_m: float = 0.0
    noise_deg: float = 0.0

    @classmethod
    def parse(cls, name: str) -> LabelSet:
        """Read a name; what names no size of errors is a source."""
        found = _INJECTED.fullmatch(name)
        if found is None:
            return cls(name)
        return cls(found["source"], float(found["noise_m"]), float(found["noise_deg"]))

    @property
    def is_injected(self) -> bool:
        """Whether errors of some size were put into true poses."""
        return self.noise_m > 0 or self.noise_deg > 0

    def __str__(self) -> str:
        """Return its name."""
        if not self.is_injected:
            return self.source
        return INJECTED_PATTERN.format(
            error_kind=self.source, noise_m=f"{self.noise_m:g}", noise_deg=f"{self.noise_deg:g}"
        )
