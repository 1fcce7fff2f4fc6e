"""Do the images show anything? A data set can be whole, exact and blank."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from synfeal.validation.check import Check
from synfeal.validation.images import Pixels
from synfeal.validation.listing import COLOR, Frame

EVERY = 4  # rows and columns that are looked at
SAME = 2  # grey levels
ONE_COLOUR = 0.95  # of a frame's pixels
MOSTLY = 0.5
MOST_OF_ONE_COLOUR = 0.05  # of the frames: a camera may come close to a plain wall
MOST_EMPTY = 0.25  # of the frames: rooms without a ceiling have such, and collect says how many


@dataclass
class Content:
    """Frames that show nothing, or mostly nothing, as they are read."""

    n_frames: int = 0
    of_one_colour: list[Frame] = field(default_factory=list)
    mostly_empty: list[Frame] = field(default_factory=list)

    def add(self, frame: Frame, rgb: NDArray[np.uint8], depth_mm: Pixels | None) -> None:
        """Look at a frame; without its depth what is black counts as empty."""
        self.n_frames += 1
        rgb = rgb[::EVERY, ::EVERY]
        usual = np.median(rgb.reshape(-1, 3), axis=0)
        if np.mean((np.abs(rgb - usual) <= SAME).all(axis=2)) >= ONE_COLOUR:
            self.of_one_colour.append(frame)
        no_depth = None if depth_mm is None else (depth_mm == 0) | (depth_mm == 65535)
        empty = (rgb == 0).all(axis=2) if no_depth is None else no_depth
        if np.mean(empty) > MOSTLY:
            self.mostly_empty.append(frame)

    def check(self) -> Check:
        """Whether too many frames were blank."""
        failures, said = [], []
        for frames, what, bound in (
            (self.of_one_colour, "of one colour", MOST_OF_ONE_COLOUR),
            (self.mostly_empty, "more than half empty", MOST_EMPTY),
        ):
            said.append(f"{len(frames)} {what} (bound {bound:.0%})")
            if len(frames) > bound * self.n_frames:
                failures.append(
                    f"{frames[0].path(COLOR)}: is {what}, as are {len(frames)} of {self.n_frames}"
                    " frames; look at preview.png, and at synfeal inspect of the mesh"
                )
        return Check("content", f"of {self.n_frames} frames {', '.join(said)}", tuple(failures))
