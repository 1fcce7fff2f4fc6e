"""Settings of a server."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from baselines.references.confidence import LEAST_CONFIDENCE, check_confidence
from baselines.references.map_localizer import World
from synfeal.camera.photograph import PhotographCamera
from synfeal.errors import Argument, InputError

MOST_PORT = 65535


@dataclass(frozen=True)
class ServeJob:
    """Settings of a server: its place, its address, and how much it takes at once.

    Attributes:
        place: Folder of a place or of a map.
        camera: Camera of photographs that come without one.
        world: World that poses are given in, where the place was scanned from a sequence.
        least_confidence: Poses with less are not given.
        refine: Mesh that the map shows, to refine poses on.
        host: Address to listen on.
        port: Port to listen on; 0 takes one that is free.
        cores: Photographs that are localized at once.
        queue: Photographs that may wait for that.
        megabytes: Largest request, 10^6 bytes.
        megapixels: Largest photograph, 10^6 pixels.

    Raises:
        InputError: A number is out of its range.
    """

    place: Path
    camera: PhotographCamera
    world: World = "sequence"
    least_confidence: float = LEAST_CONFIDENCE
    refine: Path | None = None
    host: str = "127.0.0.1"
    port: int = 8000
    cores: int = 1
    queue: int = 16
    megabytes: int = 32
    megapixels: int = 64

    def __post_init__(self) -> None:
        check_confidence(self.least_confidence)
        if not 0 <= self.port <= MOST_PORT:
            raise InputError(Argument("port"), f"must be 0 to {MOST_PORT}, found {self.port}")
        for name, least in (("cores", 1), ("queue", 0), ("megabytes", 1), ("megapixels", 1)):
            value = getattr(self, name)
            if value < least:
                raise InputError(Argument(name), f"must be at least {least}, found {value}")

    @property
    def most_bytes(self) -> int:
        """Bytes of the largest request."""
        return self.megabytes * 10**6

    @property
    def most_pixels(self) -> int:
        """Width times height of the largest photograph."""
        return self.megapixels * 10**6
