"""What was named or repaired while one mesh file was read."""

from __future__ import annotations

import logging
from pathlib import Path

log = logging.getLogger("synfeal")


class Findings:
    """Sentences in the order they were found, each once."""

    def __init__(self, path: Path) -> None:
        """Collect what is found in the file at ``path``."""
        self._path = path
        self._sentences: dict[str, None] = {}

    def note(self, sentence: str) -> None:
        """Keep a sentence: what was done is what its author would expect."""
        self._sentences.setdefault(sentence)

    def warn(self, sentence: str) -> None:
        """Keep a sentence and log it at once: the images differ from what the author sees."""
        if sentence not in self._sentences:
            log.warning("%s: %s", self._path, sentence)
        self.note(sentence)

    @property
    def sentences(self) -> tuple[str, ...]:
        """All findings so far."""
        return tuple(self._sentences)
