"""Poses between poses: great arcs, roll, pitch and yaw, and the frames of a path."""

from __future__ import annotations

from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.geometry import poses, rotations
from synfeal.hard_cases import exact
from synfeal.hard_cases.case import Case, Trial
from synfeal.hard_cases.exact import MP, MPMATH, RATIONAL
from synfeal.hard_cases.rotations import AXIS, BASE, NEARLY_PI
from synfeal.planning import path

Array = NDArray[np.float64]
FRACTIONS = (0.0, 0.1, 0.5, 1.0)
HALF_TURN = np.array([0.0, 2.0 / 7.0, -3.0 / 7.0, 6.0 / 7.0])  # w is exactly 0


def arc(angle: Any, sign: float = 1.0) -> Trial:
    """Quaternions on the arc between two that are ``angle`` apart."""
    base = exact.quat_of(*BASE)
    a = exact.rounded(base)
    b = sign * exact.rounded(exact.quat_product(exact.quat_of(angle, AXIS), base))
    return Trial(
        naive=lambda: _textbook_slerp(a, b),
        ours=lambda: rotations.slerp_quat_wxyz(a, b, FRACTIONS),
        truth=_arc(a, b),
        error=exact.turn_apart,
    )


def arc_of_half_turn() -> Trial:
    """Between rotations exactly pi apart both arcs are right, so both distances are judged."""
    a = np.array([1.0, 0.0, 0.0, 0.0])
    return Trial(
        naive=lambda: _textbook_slerp(a, -HALF_TURN),
        ours=lambda: rotations.slerp_quat_wxyz(a, -HALF_TURN, FRACTIONS),
        truth=[exact.exact(a), exact.exact(HALF_TURN)],
        error=_off_either_arc,
    )


def pose_arc(angle: Any) -> Trial:
    """The same between two poses, whose rotations are matrices."""
    quats = (
        exact.quat_of(*BASE),
        exact.quat_product(exact.quat_of(angle, AXIS), exact.quat_of(*BASE)),
    )
    ends = [poses.pose_matrix(exact.rounded(exact.matrix_of(q)), np.zeros(3)) for q in quats]
    return Trial(
        naive=lambda: ends[0] + np.array(FRACTIONS)[:, None, None] * (ends[1] - ends[0]),
        ours=lambda: poses.interpolate(ends[0], ends[1], FRACTIONS),
        truth=[
            exact.matrix_of(
                exact.quat_product(
                    exact.quat_to_power(exact.quat_of(angle, AXIS), fraction), quats[0]
                )
            )
            for fraction in FRACTIONS
        ],
        error=lambda answer, truth: exact.max_abs(answer[:, :3, :3], truth),
    )


def across_half_turn(from_deg: float, to_deg: float) -> Trial:
    """Yaw of the frames between two headings on either side of +-180 deg, as a turn in degrees."""
    ends = np.zeros((2, 6))
    ends[:, 5] = np.radians([from_deg, to_deg])
    turn = exact.mpf(ends[1, 5]) - exact.mpf(ends[0, 5])
    shortest = turn - 2 * MP.pi * MP.nint(turn / (2 * MP.pi))
    return Trial(
        naive=lambda: np.degrees((ends[1] - ends[0])[5]),
        ours=lambda: np.degrees(path.step_of(ends[0], ends[1], 1)[5]),
        truth=shortest * 180 / MP.pi,
    )


def straight_down(pitch: Any) -> Trial:
    """The last frame of a path that ends looking straight up or down: its camera's rotation."""
    start = np.array([0.0, 0.0, 0.0, 0.3, 0.1, 1.0])
    target = np.array([1.0, 0.0, 0.0, -0.2, float(pitch), 2.0])
    return Trial(
        naive=lambda: _rotation_by_way_of_quaternion(target[3:]),
        ours=lambda: path.path_poses(start, target, 0.1, "rpy")[-1, :3, :3],
        truth=_rotation_of_rpy(target[3:]),
    )


def frames(distance_m: float, spacing_m: float) -> Trial:
    """Frames of a path against ``start + j / n (target - start)``: some, and the last."""
    start = np.array([0.1, -2.3, 1.1, 0.0, 0.1, 0.2])
    target = start + np.array([distance_m, 0.0, 0.0, 0.0, 0.0, 0.0])
    count = max(1, round(distance_m / spacing_m))
    some = sorted({1, (count + 1) // 2, count})
    chosen = [frame - 1 for frame in some]
    return Trial(
        naive=lambda: _printed(start, target, spacing_m)[chosen, 0],
        ours=lambda: path.path_vectors(start, target, path.n_frames_of(start, target, spacing_m))[
            chosen, 0
        ],
        truth=[
            Fraction(start[0]) + Fraction(j, count) * (Fraction(target[0]) - Fraction(start[0]))
            for j in some
        ],
    )


def _printed(start: Array, target: Array, spacing_m: float) -> Array:
    """``v_j = v_(j-1) + j * step``, as the paper prints it."""
    count = round(float(np.linalg.norm(target[:3] - start[:3])) / spacing_m)
    step = (target - start) / count if count else np.full(6, np.nan)
    return start + np.cumsum(np.arange(1, max(count, 1) + 1))[:, None] * step


def _textbook_slerp(a: Array, b: Array) -> Array:
    angle = np.arccos(np.dot(a, b))
    weights = [(np.sin((1.0 - t) * angle), np.sin(t * angle)) for t in FRACTIONS]
    return np.array([(u * a + v * b) / np.sin(angle) for u, v in weights])


def _arc(a: Array, b: Array) -> Any:
    first, last = (exact.unit(exact.exact(quat)) for quat in (a, b))
    step = exact.quat_product(last, exact.conjugate(first))
    return [exact.quat_product(exact.quat_to_power(step, t), first) for t in FRACTIONS]


def _off_either_arc(answer: Any, ends: Any) -> float:
    """How far quaternions are from being ``t * pi`` from the start and the rest from the end."""
    off = [
        abs(exact.angle_between_quats(exact.exact(quat), end) - MP.pi * exact.mpf(share))
        for quat, t in zip(answer, FRACTIONS, strict=True)
        for end, share in zip(ends, (t, 1.0 - t), strict=True)
    ]
    return float(max(off))


def _rotation_by_way_of_quaternion(rpy_rad: Array) -> Array:
    """Roll, pitch and yaw read back from the quaternion by the textbook formulas."""
    w, x, y, z = rotations.quat_wxyz_from_matrix(
        rotations.rotation_from_rpy(rpy_rad) @ rotations.BODY_FROM_CAM.T
    )
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(2 * (w * y - z * x))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return rotations.rotation_from_rpy([roll, pitch, yaw])


def _rotation_of_rpy(rpy_rad: Array) -> Any:
    """``Rz(yaw) Ry(pitch) Rx(roll)`` and the camera's axes."""
    axes = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    turns = [
        exact.matrix_of(exact.quat_of(exact.mpf(angle), axis))
        for angle, axis in zip(rpy_rad, axes, strict=True)
    ]
    body = exact.matmul(exact.matmul(turns[2], turns[1]), turns[0])
    return exact.matmul(body, exact.exact(rotations.BODY_FROM_CAM))


_ARC = partial(
    Case,
    "interpolation",
    quantity="turn",
    unit="rad",
    naive="slerp with arccos",
    ours="slerp_quat_wxyz",
    reference=MPMATH,
    bound=2e-15,
)
_POSES = partial(
    Case,
    "interpolation",
    quantity="element of R",
    unit="1",
    naive="matrices, element by element",
    ours="interpolate",
    reference=MPMATH,
)
_YAW = partial(
    Case,
    "roll, pitch, yaw",
    quantity="turn",
    unit="deg",
    naive="difference of the angles",
    ours="step_of",
    bound=1e-12,
    reference=MPMATH,
)
_PITCH = partial(
    Case,
    "roll, pitch, yaw",
    quantity="element of R",
    unit="1",
    naive="angles from the quaternion",
    ours="path_poses",
    reference=MPMATH,
)
_PATH = partial(
    Case,
    "path",
    quantity="position",
    unit="m",
    naive="v_j = v_(j−1) + j · step, as printed",
    ours="path_vectors",
    reference=RATIONAL,
)

CASES = (
    _ARC("quaternions, 0", trial=partial(arc, 0)),
    _ARC("quaternions, 1e-12", trial=partial(arc, 1e-12)),
    _ARC("quaternions, π − 1e-9", trial=partial(arc, NEARLY_PI)),
    _ARC("quaternions, π − 1e-9, other sign", trial=partial(arc, NEARLY_PI, -1.0)),
    _ARC("quaternions, exactly π", trial=arc_of_half_turn),
    _POSES("poses, 0", bound=2e-15, trial=partial(pose_arc, 0)),
    _POSES("poses, π − 1e-3", bound=2e-15, trial=partial(pose_arc, MP.pi - MP.mpf("1e-3"))),
    _YAW("from 179° to −179°", trial=partial(across_half_turn, 179.0, -179.0)),
    _YAW("from −180° to 180°", trial=partial(across_half_turn, -180.0, 180.0)),
    _YAW("from 350° to 10°", trial=partial(across_half_turn, 350.0, 10.0)),
    _PITCH("pitch 90°", bound=1e-15, trial=partial(straight_down, np.pi / 2)),
    _PITCH("pitch −90°", bound=1e-15, trial=partial(straight_down, -np.pi / 2)),
    _PITCH("pitch 90° − 1e-9", bound=1e-15, trial=partial(straight_down, np.pi / 2 - 1e-9)),
    _PATH("n = 0: the target is the start", bound=1e-15, trial=partial(frames, 0.0, 0.25)),
    _PATH("n = 1", bound=1e-15, trial=partial(frames, 0.25, 0.25)),
    _PATH("n = 100", bound=1e-14, trial=partial(frames, 25.0, 0.25)),
    _PATH("n = 1,000,000", bound=1e-12, trial=partial(frames, 1000.0, 0.001)),
)
