"""Label errors of one size and different kinds, to see which of them hurt a localizer.

`noise` is the paper's (section 4.2).

=========  =========================================  ==============================================
kind       what is wrong                              as it is left by
=========  =========================================  ==============================================
`noise`    each frame by itself                       independent errors of single frames
`offset`   each path, all its frames alike            maps registered piece by piece
`bend`     space, smoothly; nearby frames alike       drift that loop closures spread over a map
`scale`    all distances by one factor                a monocular map of the wrong scale
=========  =========================================  ==============================================

All have the same median error, ``noise_m`` and ``noise_deg``: exactly so for `noise` and `offset`;
`bend` and `scale` are errors of space, one and the same in both splits, and their sizes are set on
the training poses. A scale turns nothing, so it has no orientation error.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.geometry.rotations import canonical_quat_wxyz

Array = NDArray[np.float64]


def add_noise(
    table: PoseTable, noise_m: float, noise_deg: float, rng: np.random.Generator
) -> PoseTable:
    """The same frames with noisy poses; a noise of 0 leaves its part bit-identical.

    Every position is displaced by ``noise_m``, every orientation turned by ``noise_deg``. Both sets
    of directions are drawn whatever the sizes, so with the same seed a variant with position noise
    alone has the same displacements as the one with both.

    Directions and axes are uniform on the sphere, so the median injected Euclidean and geodesic
    errors, the measures the paper reports, are the nominal values. The published code differs. It
    moves positions by ``noise_m * sqrt(3)``, because its error is the RMS over the three axes, and
    adds ``noise_deg / sqrt(3)`` with a random sign to each of three Euler angles, so that the
    geodesic angle varies around the nominal value.

    Raises:
        ValueError: a size is negative.
    """
    if noise_m < 0 or noise_deg < 0:
        raise ValueError(f"noise must not be negative: {noise_m} m, {noise_deg} deg")
    shift, axis = unit_vectors(len(table), rng), unit_vectors(len(table), rng)
    return displaced(table, noise_m * shift, np.radians(noise_deg) * axis)


def displaced(table: PoseTable, shift_m: Array, rotvec_rad: Array) -> PoseTable:
    """Poses moved and then turned in the world; where all of a part is zero it stays as it is.

    By displacements (N, 3) and rotation vectors (N, 3), both in the world.
    """
    position_m, quat_wxyz = table.position_m.copy(), table.quat_wxyz.copy()
    if shift_m.any():
        position_m += shift_m
    if rotvec_rad.any():
        turned = Rotation.from_rotvec(rotvec_rad) * Rotation.from_quat(quat_wxyz, scalar_first=True)
        quat_wxyz = canonical_quat_wxyz(turned.as_quat(scalar_first=True))
    return PoseTable(table.frame, table.path, position_m, quat_wxyz)


def unit_vectors(count: int, rng: np.random.Generator) -> Array:
    """Vectors (count, 3) uniform on the sphere: normal variates have no preferred direction."""
    vectors = rng.standard_normal((count, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True), dtype=np.float64)


# Kinds whose errors belong to space: both splits have the same.
OF_SPACE = ("bend", "scale")


def with_error(
    kind: str,  # one of :data:`reproduction.design.experiments.INJECTED`
    table: PoseTable,  # true poses of a split
    train: PoseTable,  # true poses of the training split
    noise_m: float,  # median position error, metres
    noise_deg: float,  # median orientation error, degrees; 0 with `scale`
    # source of directions and shapes. In the same state for both splits where the error is one of
    # space, in another for each split elsewhere.
    rng: np.random.Generator,
) -> PoseTable:
    """The same frames with erroneous poses."""
    angle_rad = np.radians(noise_deg)
    if kind == "noise":
        return add_noise(table, noise_m, noise_deg, rng)
    if kind == "offset":  # one displacement and one rotation per path
        paths, place = np.unique(table.path, return_inverse=True)
        shift, axis = unit_vectors(len(paths), rng), unit_vectors(len(paths), rng)
        return displaced(table, noise_m * shift[place], angle_rad * axis[place])
    if kind == "bend":  # two fields in space, of displacements and of rotation vectors
        # Both sizes are given, so the rotations are not those that the displacements would imply.
        fields = [_smooth_field(train.position_m, size, rng) for size in (noise_m, angle_rad)]
        return displaced(table, *(field(table.position_m) for field in fields))
    if kind == "scale":  # by one factor about the first training camera, where a map would begin
        origin_m = train.position_m[0]
        distance_m = np.median(np.linalg.norm(train.position_m - origin_m, axis=1))
        share = noise_m / distance_m if distance_m > 0 else 0.0
        shift_m = share * (table.position_m - origin_m)
        return displaced(table, shift_m, np.zeros_like(shift_m))
    raise ValueError(f"labels have no error of the kind '{kind}'")


def seed_names(kind: str, split: str) -> tuple[str, ...]:
    """What the seed of a label set depends on beside the scene and the size; never on a level."""
    return (kind,) if kind in OF_SPACE else (kind, split)


def _smooth_field(
    position_m: Array, median: float, rng: np.random.Generator
) -> Callable[[Array], Array]:
    """Vectors as a function of positions (N, 3); their median length at ``position_m`` is given.

    Each component is one sine wave in a random direction with a random phase, as long as the
    longest side of the box around the positions.
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
    seed: int,
    out_labels: Path,
) -> None:
    """Write the true poses of a split with an error (:func:`with_error`)."""
    tables, rng = (read_pose_table(truth), read_pose_table(train)), np.random.default_rng(seed)
    write_pose_table(out_labels, with_error(error_kind, *tables, noise_m, noise_deg, rng))


def constant_pose(train: PoseTable, frames: PoseTable) -> PoseTable:
    """The same pose for all of some frames: mean position and mean rotation of a label set.

    The mean rotation is the one with the least sum of squared chords (Markley et al., "Averaging
    Quaternions", JGCD 2007). Cameras that look all round have hardly a mean; then any rotation does
    about as well. The poses of the frames are not looked at.
    """
    mean = Rotation.from_quat(train.quat_wxyz, scalar_first=True).mean()
    quat_wxyz = canonical_quat_wxyz(mean.as_quat(scalar_first=True))
    position_m = np.tile(train.position_m.mean(axis=0), (len(frames), 1))
    return PoseTable(frames.frame, frames.path, position_m, np.tile(quat_wxyz, (len(frames), 1)))
