"""Injected label errors of one size and different kinds.

`noise` is the paper's (section 4.2).

=========  =========================================  ==============================================
kind       what is wrong                              as it is left by
=========  =========================================  ==============================================
`noise`    each frame by itself                       independent errors of single frames
`offset`   each path, all its frames alike            maps registered piece by piece
`bend`     space, smoothly; nearby frames alike       drift that loop closures spread over a map
`scale`    all distances by one factor                a monocular map of the wrong scale
`drift`    each path, smoothly; frames close in time  depth tracking, and maps of video: what label
           alike (``drift.py``)                       sets of 7-Scenes differ by
=========  =========================================  ==============================================

All have the same median error, ``noise_m`` and ``noise_deg``: exactly so for `noise`, `offset` and
`drift`; `bend` and `scale` are errors of space, one and the same in both splits, and their sizes
are set on the training poses. A scale turns nothing, so it has no orientation error.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from pkgutil import resolve_name

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from baselines.config.labels import NoiseDose
from baselines.registry.declarations import declared
from baselines.registry.kinds import LabelError
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.geometry.rotations import canonical_quat_wxyz

Array = NDArray[np.float64]


@LabelError(name="noise", title="independent noise", rank=1)
def independent_noise(
    table: PoseTable,
    train: PoseTable,
    noise_m: float,
    noise_deg: float,
    rng: np.random.Generator,
) -> PoseTable:
    """Displace and turn each frame by itself.

    Arguments are those of :func:`with_error`; ``train`` is not looked at. See :func:`add_noise`.
    """
    return add_noise(table, noise_m, noise_deg, rng)


def add_noise(
    table: PoseTable, noise_m: float, noise_deg: float, rng: np.random.Generator
) -> PoseTable:
    """Add noise to the poses of all frames; a noise of 0 leaves its part bit-identical.

    Every position is displaced by ``noise_m``, every orientation turned by ``noise_deg``. Both sets
    of directions are drawn whatever the sizes, so with the same seed a variant with position noise
    alone has the same displacements as the one with both.

    Directions and axes are uniform on the sphere, so the median injected Euclidean and geodesic
    errors, the measures the paper reports, are the nominal values. The published code differs. It
    moves positions by ``noise_m * sqrt(3)``, because its error is the RMS over the three axes, and
    adds ``noise_deg / sqrt(3)`` with a random sign to each of three Euler angles, so that the
    geodesic angle varies around the nominal value.

    Args:
        table: Frames and their poses.
        noise_m: Length of the displacement, metres.
        noise_deg: Angle of the turn, degrees.
        rng: Source of directions and axes.

    Raises:
        ValueError: a size is negative.
    """
    if noise_m < 0 or noise_deg < 0:
        raise ValueError(f"noise must not be negative: {noise_m} m, {noise_deg} deg")
    shift, axis = unit_vectors(len(table), rng), unit_vectors(len(table), rng)
    return displaced(table, noise_m * shift, np.radians(noise_deg) * axis)


def displaced(table: PoseTable, shift_m: Array, rotvec_rad: Array) -> PoseTable:
    """Move and then turn poses in the world; where all of a part is zero, it stays bit-identical.

    Args:
        table: The frames and their poses.
        shift_m: Displacements (N, 3), world, metres.
        rotvec_rad: Rotation vectors (N, 3), world, radians.

    Returns:
        The same frames with the displaced poses.
    """
    position_m, quat_wxyz = table.position_m.copy(), table.quat_wxyz.copy()
    if shift_m.any():
        position_m += shift_m
    if rotvec_rad.any():
        turned = Rotation.from_rotvec(rotvec_rad) * Rotation.from_quat(quat_wxyz, scalar_first=True)
        quat_wxyz = canonical_quat_wxyz(turned.as_quat(scalar_first=True))
    return PoseTable(table.frame, table.path, position_m, quat_wxyz)


def unit_vectors(count: int, rng: np.random.Generator) -> Array:
    """Draw unit vectors (count, 3), uniform: normal variates have no preferred direction."""
    vectors = rng.standard_normal((count, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True), dtype=np.float64)


@LabelError(name="offset", title="one error per path", rank=2)
def offset_per_path(
    table: PoseTable,
    train: PoseTable,
    noise_m: float,
    noise_deg: float,
    rng: np.random.Generator,
) -> PoseTable:
    """Give each path one displacement and one rotation, shared by all its frames.

    Arguments are those of :func:`with_error`; ``train`` is not looked at.
    """
    paths, place = np.unique(table.path, return_inverse=True)
    shift, axis = unit_vectors(len(paths), rng), unit_vectors(len(paths), rng)
    return displaced(table, noise_m * shift[place], np.radians(noise_deg) * axis[place])


@LabelError(name="bend", title="a bend of space", rank=3, of_space=True)
def bend_of_space(
    table: PoseTable,
    train: PoseTable,
    noise_m: float,
    noise_deg: float,
    rng: np.random.Generator,
) -> PoseTable:
    """Displace and turn by two smooth fields in space, scaled on the training positions.

    The sizes of both are given, so the rotations are not those that the displacements would imply.
    Arguments are those of :func:`with_error`.
    """
    shift_m = _smooth_field(train.position_m, noise_m, rng)
    rotvec_rad = _smooth_field(train.position_m, np.radians(noise_deg), rng)
    return displaced(table, shift_m(table.position_m), rotvec_rad(table.position_m))


@LabelError(name="scale", title="a wrong scale", rank=4, of_space=True, turns=False)
def wrong_scale(
    table: PoseTable,
    train: PoseTable,
    noise_m: float,
    noise_deg: float,
    rng: np.random.Generator,
) -> PoseTable:
    """Scale distances from the first training camera, where a map would begin, by one factor.

    Arguments are those of :func:`with_error`. The factor follows from ``noise_m`` and ``train``;
    ``noise_deg`` and ``rng`` are not used, since nothing turns and nothing is drawn.
    """
    origin_m = train.position_m[0]
    distance_m = np.median(np.linalg.norm(train.position_m - origin_m, axis=1))
    share = noise_m / distance_m if distance_m > 0 else 0.0
    shift_m = share * (table.position_m - origin_m)
    return displaced(table, shift_m, np.zeros_like(shift_m))


LABEL_ERRORS = declared(LabelError)


def moved_m(noise_m: float, dose: NoiseDose) -> float:
    """Return the median distance that positions are moved by.

    The published code reads a size as the root mean square over the three axes, the unit of its
    errors, so that an error has √3 times that length. Angles are alike in text and code.

    Args:
        noise_m: Size that a row of the design names, metres.
        dose: Reading of the paper that is followed.
    """
    return noise_m * math.sqrt(3) if dose == "code" else noise_m


def with_error(
    kind: str,
    table: PoseTable,
    train: PoseTable,
    noise_m: float,
    noise_deg: float,
    rng: np.random.Generator,
) -> PoseTable:
    """Put an error into poses.

    Args:
        kind: Key of ``LABEL_ERRORS``.
        table: True poses of a split.
        train: True poses of the training split, on which the error has its size.
        noise_m: Median position error, metres.
        noise_deg: Median orientation error, degrees; 0 where the error turns nothing.
        rng: Source of directions and shapes. In the same state for both splits where the error is
            one of space, in another for each split elsewhere.

    Returns:
        The same frames with erroneous poses.
    """
    put = resolve_name(LABEL_ERRORS[kind].place)
    erroneous: PoseTable = put(
        table=table, train=train, noise_m=noise_m, noise_deg=noise_deg, rng=rng
    )
    return erroneous


def seed_names(kind: str, split: str) -> tuple[str, ...]:
    """Return what the seed of a label set depends on, beside scene and size; never on a level."""
    return (kind,) if LABEL_ERRORS[kind].of_space else (kind, split)


def _smooth_field(
    position_m: Array, median: float, rng: np.random.Generator
) -> Callable[[Array], Array]:
    """Draw a smooth vector field as a function of positions (N, 3).

    Each component is one sine wave in a random direction with a random phase, as long as the
    longest side of the box around the positions.

    Args:
        position_m: Positions (N, 3) the field is scaled by, world, metres.
        median: Median length of the vectors at those positions.
        rng: Source of directions and phases.
    """
    low, high = position_m.min(axis=0), position_m.max(axis=0)
    length_m = max(float((high - low).max()), 1e-9)
    wave = 2 * np.pi / length_m * unit_vectors(3, rng)
    phase = rng.uniform(0, 2 * np.pi, 3)

    def shape(at_m: Array) -> Array:
        return np.asarray(np.sin((at_m - low) @ wave.T + phase))

    size = median / np.median(np.linalg.norm(shape(position_m), axis=1))
    return lambda at_m: size * shape(at_m)


def write_erroneous_labels(
    error_kind: str,
    truth: Path,
    train: Path,
    noise_m: float,
    noise_deg: float,
    dose: NoiseDose,
    seed: int,
    out_labels: Path,
) -> None:
    """Write the true poses of a split with an error.

    Args:
        error_kind: Key of ``LABEL_ERRORS``.
        truth: Table of the true poses of the split.
        train: The same of the training split.
        noise_m: Position error that the row of the design names, metres.
        noise_deg: Orientation error, degrees.
        dose: How ``noise_m`` is read; see :func:`moved_m`.
        seed: Seed of directions and shapes.
        out_labels: Table of poses to write.
    """
    erroneous = with_error(
        kind=error_kind,
        table=read_pose_table(truth),
        train=read_pose_table(train),
        noise_m=moved_m(noise_m, dose),
        noise_deg=noise_deg,
        rng=np.random.default_rng(seed),
    )
    write_pose_table(out_labels, erroneous)
