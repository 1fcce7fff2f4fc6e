"""Captures as sequences that a map is built from."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from baselines.references.map_frames import MapFrames
from synfeal.captures.formats import is_capture, read_capture
from synfeal.captures.unpack import unpack
from synfeal.records.progress import Progress

log = logging.getLogger("synfeal")

# Layouts that are read as they lie.
SEQUENCES = ("7scenes", "tum")
# Longer side of photographs in a map, pixels: features of larger ones are no more exact than the
# poses, and there are a thousand of a frame anyway.
LONGEST_PX = 800


@dataclass(frozen=True)
class Sequence:
    """A posed sequence, and what its frames are called where they come from.

    Attributes:
        source: What a person named.
        folder: The sequence.
        names: Names of its frames in the capture; None where it is a sequence itself.
    """

    source: Path
    folder: Path
    names: tuple[str, ...] | None = None

    def named(self, frames: MapFrames) -> MapFrames:
        """Call frames as the capture does."""
        if self.names is None:
            return frames
        names = tuple(self.names[int(name.rpartition("-")[2])] for name in frames.names)
        return replace(frames, source=self.source, names=names)


@contextmanager
def as_sequence(path: Path) -> Iterator[Sequence]:
    """Unpack a capture in another layout than a sequence's for as long as the block runs.

    Args:
        path: A data set, a sequence or a capture.
    """
    if not is_capture(path, besides=SEQUENCES):
        yield Sequence(path, path)
        return
    capture = read_capture(path)
    with TemporaryDirectory(prefix="synfeal-") as temporary:
        folder = Path(temporary) / "frames"
        with Progress(len(capture), "unpacked") as progress:
            done = unpack(capture, folder, longest_px=LONGEST_PX, on_frame=progress.update)
        for note in done.notes:
            log.warning("%s: %s", path, note)
        yield Sequence(path, folder, done.names)
