"""Every file of every frame: there, numbered without gaps, readable, of one size, and not blank."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.config.dataset import CameraConfig
from synfeal.dataset.depth import MILLIMETRES, own_units_per_m, read_depth_m
from synfeal.dataset.frame_files import FrameFile
from synfeal.dataset.images import LOOKED_AT, is_of_one_color, read_rgb
from synfeal.dataset.sequence_listing import (
    COLOR,
    DEPTH,
    RIGHT_COLOR,
    RIGHT_DEPTH,
    Frame,
    SequenceListing,
    frames_of,
    kinds_of,
    name_problems,
)
from synfeal.errors import InputError
from synfeal.validation.check import PNG, Check

Pixels = NDArray[Any]

# Share of the frames: a camera may come close to a plain wall, and rooms without a ceiling have
# empty frames, of which collect says how many.
ONE_COLOR_FRAMES, EMPTY_FRAMES = "of one colour", "more than half empty"
MOST = {ONE_COLOR_FRAMES: 0.05, EMPTY_FRAMES: 0.25}
REMEDIES = {
    ONE_COLOR_FRAMES: "look at preview.png; collect with `min_clearance_m` keeps cameras off"
    " walls, `shade` lights a mesh of plain colours",
    EMPTY_FRAMES: "look at preview.png; collect with `min_seen=0.9` refuses views past the mesh",
}


def check_names(sequences: Sequence[SequenceListing]) -> Check:
    """Check that frames are numbered 0, 1, 2, ... and have a file of each kind."""
    kinds = kinds_of(sequences)
    failures = name_problems(sequences)
    n_frames = len(frames_of(sequences))
    text = f"{n_frames} frames in {len(sequences)} sequences, each with {', '.join(kinds)}"
    return Check("names", text, failures)


def check_images(
    sequences: Sequence[SequenceListing],
    camera: CameraConfig | None,
    on_frame: Callable[[], object],
) -> list[Check]:
    """Check that every image decodes fully, has the camera's size, and shows something.

    Args:
        sequences: Sequences of the data set.
        camera: Camera of the frames. Without one, all images must be of the size of the first, and
            depth, which then comes from a sensor, does not tell what is empty.
        on_frame: Called after each frame.
    """
    size = (camera.width, camera.height) if camera else None
    read_color = partial(read_rgb, formats=PNG)
    readers: dict[str, Callable[[FrameFile], Pixels]] = {
        COLOR: read_color,
        DEPTH: read_depth_m,
        RIGHT_COLOR: read_color,
        RIGHT_DEPTH: read_depth_m,
    }
    failures: list[str] = []
    blank: dict[str, list[Frame]] = {what: [] for what in MOST}
    n_frames = n_images = 0
    for sequence in sequences:
        if camera and DEPTH in sequence.numbers and sequence.numbers[DEPTH]:
            failures += _other_units(sequence, camera)
        for frame in sequence.frames:
            images: dict[str, Pixels] = {}
            for kind, read in readers.items():
                if frame.number not in sequence.numbers[kind]:
                    continue  # the check of the names says so
                n_images += 1
                try:
                    images[kind] = read(frame.path(kind))
                except InputError as error:
                    failures.append(str(error))
                    continue
                height, width = images[kind].shape[:2]
                size = size or (width, height)
                if (width, height) != size:
                    wrong = f"is {width} x {height}, must be {size[0]} x {size[1]}"
                    failures.append(f"{frame.path(kind)}: {wrong}")
                elif kind == DEPTH and camera:
                    near_m = _median_m(images[kind])
                    if near_m < camera.near_m - 0.001:
                        failures.append(
                            f"{frame.path(kind)}: shows surfaces {near_m:.3g} m away, before the"
                            f" near plane of the camera at {camera.near_m:g} m; store depth in"
                            " millimetres"
                        )
            if COLOR in images:
                n_frames += 1
                if is_of_one_color(images[COLOR]):
                    blank[ONE_COLOR_FRAMES].append(frame)
                if _is_mostly_empty(images[COLOR], images.get(DEPTH) if camera else None):
                    blank[EMPTY_FRAMES].append(frame)
            on_frame()
    text = f"{n_images} images decoded" + (f", {size[0]} x {size[1]}" if size else "")
    return [Check("images", text, tuple(failures)), _content(n_frames, blank)]


def _other_units(sequence: SequenceListing, camera: CameraConfig) -> list[str]:
    """Compare the units that the first depth image of a sequence says with those of the camera.

    Returns:
        The failure, if they differ.
    """
    first = min(sequence.numbers[DEPTH])  # depth of the first frame may be what is missing
    file = Frame(sequence.path, first).path(DEPTH)
    try:
        said = own_units_per_m(file) or MILLIMETRES
    except InputError:
        return []  # reading it says what is wrong
    expected = camera.depth_units_per_m or MILLIMETRES
    if said == expected:
        return []
    return [
        f"{file}: says that a metre is stored as {said:g}, the manifest"
        f" (camera.depth_units_per_m) {expected:g}; collect the data set again"
    ]


def _median_m(depth_m: Pixels) -> float:
    """Return the median of the known depths, metres; infinite where there are none."""
    depth_m = depth_m[::LOOKED_AT, ::LOOKED_AT]
    known = depth_m[np.isfinite(depth_m)]
    return float(np.median(known)) if known.size else math.inf


def _content(n_frames: int, blank: Mapping[str, list[Frame]]) -> Check:
    """Check that not too many frames are blank."""
    failures, said = [], []
    for what, frames in blank.items():
        said.append(f"{len(frames)} {what} (bound {MOST[what]:.0%})")
        if len(frames) > MOST[what] * n_frames:
            failures.append(
                f"{frames[0].path(COLOR)}: is {what}, as are {len(frames)} of {n_frames} frames;"
                f" {REMEDIES[what]}"
            )
    return Check("content", f"of {n_frames} frames {', '.join(said)}", tuple(failures))


def _is_mostly_empty(rgb: Pixels, depth_m: Pixels | None) -> bool:
    """Tell whether most of an image shows nothing; without depth, black counts as empty."""
    black = (rgb[::LOOKED_AT, ::LOOKED_AT] == 0).all(axis=2)
    empty = black if depth_m is None else ~np.isfinite(depth_m)
    return bool(np.mean(empty) > 0.5)
