"""Labels of real photographs from two sources, in one world and of one camera.

7-Scenes' own labels are those of KinectFusion: poses of the *depth* camera. Brachmann et al. ("On
the Limits of Pseudo Ground Truth in Visual Camera Re-Localization", ICCV 2021) estimated the same
photographs by structure from motion: poses of the *colour* camera, in a world of their own. Before
the two are compared, the constant motion between the cameras is taken off and the worlds are laid
over one another by a rigid motion, found on the photographs of the scan alone.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from synfeal.dataset.posed_sequence import PosedFrames
from synfeal.errors import InputError, read_as
from synfeal.geometry.poses import inverse, pose_error, pose_from_quat, pose_matrix

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Gauge:
    """Motion and scale from one world to another.

    Attributes:
        to_from_other: Rigid motion (4, 4).
        scale: By which the other world would have to grow to fit best; not applied, since depth is
            in metres.
    """

    to_from_other: Array
    scale: float


def read_sfm_labels(files: Iterable[Path]) -> dict[str, Array]:
    """Read ``world_from_color`` (4, 4) by the name of the frame (``seq-01/frame-000000``).

    Lines are ``seq-01/frame-000000.color.png qw qx qy qz tx ty tz f``, with ``cam_from_world``.

    Raises:
        InputError: A file is missing or holds something else.
    """
    found: dict[str, Array] = {}
    for file in files:
        with read_as(file, "poses by structure from motion"):
            lines = file.read_text(encoding="utf-8").splitlines()
        for number, line in enumerate(lines, start=1):
            cells = line.split()
            with read_as(f"{file}: line {number}", "a file name and eight numbers"):
                qw, qx, qy, qz, tx, ty, tz, _ = (float(cell) for cell in cells[1:])
            unit = np.array([qw, qx, qy, qz]) / np.linalg.norm([qw, qx, qy, qz])  # six digits
            cam_from_world = pose_from_quat([tx, ty, tz], unit)
            found[cells[0].removesuffix(".color.png")] = inverse(cam_from_world)
    return found


def motion_of(rotvec_deg_and_m: Sequence[float]) -> Array:
    """Build a rigid motion (4, 4) from a rotation vector in degrees and a translation in metres."""
    turn = Rotation.from_rotvec(np.asarray(rotvec_deg_and_m[:3]), degrees=True)
    return np.asarray(pose_matrix(turn.as_matrix(), np.asarray(rotvec_deg_and_m[3:])))


def gauge_between(other: Array, to: Array) -> Gauge:
    """Find the rigid motion that lays poses (N, 4, 4) of cameras over others of the same cameras.

    The rotation is the mean over all cameras (chordal), not that which the camera centres alone
    give: where a trajectory is nearly flat these say little about the rotation.
    """
    sum_of = np.einsum("nij,nkj->ik", to[:, :3, :3], other[:, :3, :3])
    left, _, right = np.linalg.svd(sum_of)
    rotation = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    turned, target = other[:, :3, 3] @ rotation.T, to[:, :3, 3]
    centred, aim = turned - turned.mean(axis=0), target - target.mean(axis=0)
    scale = float((centred * aim).sum() / np.square(centred).sum())
    motion = pose_matrix(rotation, target.mean(axis=0) - turned.mean(axis=0))
    return Gauge(np.asarray(motion), scale)


def relabelled(frames: PosedFrames, names: Sequence[str], labels: dict[str, Array]) -> PosedFrames:
    """Give photographs other poses.

    Args:
        frames: Photographs.
        names: Name of each photograph, as the labels call it.
        labels: Poses (4, 4) by name.

    Raises:
        InputError: A photograph has no label.
    """
    lost = [name for name in names if name not in labels]
    if lost:
        raise InputError(
            "sfm_labels",
            f"have no pose of {lost[0]} ({len(lost)} of {len(names)} photographs)",
            "give the files of this scene, training and test",
        )
    return replace(frames, world_from_cam=np.array([labels[name] for name in names]))


def of_depth_camera(world_from_color: Array, depth_from_color: Array) -> Array:
    """Compute poses (N, 4, 4) of the depth camera from those of the colour camera beside it."""
    return np.asarray(world_from_color @ inverse(depth_from_color))


def label_difference(given: Array, other: Array, gauge: Gauge) -> dict[str, Any]:
    """Measure how far the labels of the same photographs from two sources are apart.

    Args:
        given: Poses ``world_from_cam`` (N, 4, 4) of one source.
        other: Poses (N, 4, 4) of the other, in its own world.
        gauge: Motion from the other world to that of ``given``.

    Returns:
        Median and largest difference of position in metres and of orientation in degrees, and the
        gauge's scale, by name.
    """
    position_m, angle_rad = pose_error(gauge.to_from_other @ other, given)
    angle_deg = np.degrees(angle_rad)
    return {
        "position_m_median": float(np.median(position_m)),
        "position_m_max": float(position_m.max()),
        "orientation_deg_median": float(np.median(angle_deg)),
        "orientation_deg_max": float(angle_deg.max()),
        "scale": gauge.scale,
    }
