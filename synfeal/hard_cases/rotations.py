"""Angles between rotations, and rotations as matrices, quaternions and rotation vectors."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from synfeal.geometry import poses, rotations
from synfeal.hard_cases import exact
from synfeal.hard_cases.case import Case, Trial
from synfeal.hard_cases.exact import MP, MPMATH

Array = NDArray[np.float64]
AXIS = (2.0, -3.0, 6.0)
BASE = (0.7, (1.0, 5.0, -2.0))  # a rotation along no axis: angle, axis
PI = MP.pi
NEARLY_PI = PI - MP.mpf("1e-9")


def angle_of_quats(angle: Any, sign: float = 1.0) -> Trial:
    """Angle between a rotation and the same turned on; one quaternion may have the other sign."""
    base = exact.quat_of(*BASE)
    a = exact.rounded(base)
    b = sign * exact.rounded(exact.quat_product(base, exact.quat_of(angle, AXIS)))
    return Trial(
        naive=lambda: 2.0 * np.arccos(np.dot(a, b)),
        ours=lambda: rotations.rotation_angle_rad(a, b),
        truth=exact.angle_between_quats(exact.exact(a), exact.exact(b)),
    )


def angle_of_poses(angle: Any) -> Trial:
    """Angle between two poses: their matrices are rotations up to rounding."""
    base = exact.matrix_of(exact.quat_of(*BASE))
    turned = exact.matmul(base, exact.matrix_of(exact.quat_of(angle, AXIS)))
    a, b = (poses.pose_matrix(exact.rounded(r), np.zeros(3)) for r in (base, turned))
    near_a, near_b = (exact.nearest_rotation(exact.exact(p[:3, :3])) for p in (a, b))
    return Trial(
        naive=lambda: np.arccos((np.trace(a[:3, :3].T @ b[:3, :3]) - 1.0) / 2.0),
        ours=lambda: poses.pose_error(a, b)[1],
        truth=exact.angle_of_matrix(exact.matmul(exact.transposed(near_a), near_b)),
    )


def log_of(angle: Any) -> Trial:
    """Rotation vector of a matrix; judged as the turn it stands for, as pi has two."""
    matrix = exact.rounded(exact.matrix_of(exact.quat_of(angle, AXIS)))
    truth = exact.nearest_rotation(exact.exact(matrix))
    return Trial(
        naive=lambda: _textbook_log(matrix),
        ours=lambda: Rotation.from_matrix(matrix).as_rotvec(),
        truth=truth,
        error=_turn_of_vector_apart,
    )


def exp_of(angle: Any) -> Trial:
    """Matrix of a rotation vector."""
    vector = exact.rounded([angle * v for v in exact.unit(exact.exact(AXIS))])
    return Trial(
        naive=lambda: _textbook_exp(vector),
        ours=lambda: Rotation.from_rotvec(vector).as_matrix(),
        truth=exact.matrix_of(exact.quat_of_vector(exact.exact(vector))),
    )


def quat_of_matrices(matrices: Array) -> Trial:
    """Quaternions of the rotations nearest to matrices (N, 3, 3)."""
    nearest = [exact.nearest_rotation(exact.exact(matrix)) for matrix in matrices]
    return Trial(
        naive=lambda: np.array([_textbook_quat(matrix) for matrix in matrices]),
        ours=lambda: rotations.quat_wxyz_from_matrix(matrices),
        truth=nearest,
        error=_turn_from_matrix_apart,
    )


def turned_by(angle: Any) -> Array:
    """A matrix (1, 3, 3) of a turn, rounded to doubles."""
    return np.array([exact.rounded(exact.matrix_of(exact.quat_of(angle, AXIS)))])


def read_back() -> Array:
    """Rotations (40, 3, 3) as a text file of five digits gives them back."""
    matrices = Rotation.random(40, rng=np.random.default_rng(0)).as_matrix()
    return np.asarray(np.round(matrices, 5))


def nearly_singular() -> Array:
    """Rotations (1, 3, 3) whose third column has shrunk to a millionth."""
    return np.asarray(turned_by(2) * np.array([1.0, 1.0, 1e-6]))


def _textbook_log(matrix: Array) -> Array:
    angle = np.arccos((np.trace(matrix) - 1.0) / 2.0)
    skew = matrix - matrix.T
    doubled_sine = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    return np.asarray(angle / (2.0 * np.sin(angle)) * doubled_sine)


def _textbook_exp(vector: Array) -> Array:
    """Rodrigues' formula."""
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle
    k = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * k @ k)


def _textbook_quat(matrix: Array) -> Array:
    w = np.sqrt(1.0 + np.trace(matrix)) / 2.0
    skew = matrix - matrix.T
    quat = np.array([w, *(np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / (4.0 * w))])
    return np.asarray(quat / np.linalg.norm(quat))


def _turn_of_vector_apart(vector: Any, truth: Any) -> float:
    found = exact.matrix_of(exact.quat_of_vector(exact.exact(vector)))
    return float(exact.angle_of_matrix(exact.matmul(exact.transposed(truth), found)))


def _turn_from_matrix_apart(quats: Any, truth: Any) -> float:
    found = [exact.matrix_of(exact.unit(exact.exact(quat))) for quat in quats]
    pairs = zip(found, truth, strict=True)
    return max(float(exact.angle_of_matrix(exact.matmul(exact.transposed(t), f))) for f, t in pairs)


_ANGLE = partial(Case, "orientation error", quantity="angle", unit="rad", reference=MPMATH)
_QUATS = partial(
    _ANGLE, naive="2 arccos of the dot product", ours="rotation_angle_rad", bound=1e-15
)
_POSES = partial(_ANGLE, naive="arccos of the trace", ours="pose_error", bound=2e-15)
_VECTOR = partial(Case, "rotation vectors", quantity="turn", unit="rad", reference=MPMATH)
_LOG = partial(
    _VECTOR, naive="θ / (2 sin θ) (R − Rᵀ)", ours="Rotation.as_rotvec (SciPy)", bound=2e-15
)
_EXP = partial(
    _VECTOR, naive="Rodrigues, axis v / |v|", ours="Rotation.from_rotvec (SciPy)", bound=1e-15
)
_MATRIX = partial(
    Case,
    "quaternion of a matrix",
    quantity="turn",
    unit="rad",
    naive="w = √(1 + trace) / 2",
    ours="quat_wxyz_from_matrix",
    reference=MPMATH,
    bound=1e-14,
)

CASES = (
    _QUATS("quaternions, 0", trial=partial(angle_of_quats, 0)),
    _QUATS("quaternions, 1e-9", trial=partial(angle_of_quats, 1e-9)),
    _QUATS("quaternions, π − 1e-9", trial=partial(angle_of_quats, NEARLY_PI)),
    _QUATS("quaternions, π", trial=partial(angle_of_quats, PI)),
    _QUATS("q and −q", trial=partial(angle_of_quats, 0, -1.0)),
    _POSES("poses, 0", trial=partial(angle_of_poses, 0)),
    _POSES("poses, 1e-9", trial=partial(angle_of_poses, 1e-9)),
    _POSES("poses, π − 1e-9", trial=partial(angle_of_poses, NEARLY_PI)),
    _POSES("poses, π", trial=partial(angle_of_poses, PI)),
    _LOG("logarithm at 0", trial=partial(log_of, 0)),
    _LOG("logarithm at π − 1e-9", trial=partial(log_of, NEARLY_PI)),
    _LOG("logarithm at π", trial=partial(log_of, PI)),
    _EXP("exponential at 0", trial=partial(exp_of, 0)),
    _EXP("exponential at π", trial=partial(exp_of, PI)),
    _MATRIX("five digits of text", trial=lambda: quat_of_matrices(read_back())),
    _MATRIX("trace −1 (π)", trial=lambda: quat_of_matrices(turned_by(PI))),
    _MATRIX("trace near −1 (π − 1e-9)", trial=lambda: quat_of_matrices(turned_by(NEARLY_PI))),
    _MATRIX("nearly singular", trial=lambda: quat_of_matrices(nearly_singular())),
)
