"""Settings of property tests, and the values they draw."""

import os

import numpy as np
from hypothesis import Phase, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from synfeal.dataset.pose_table import PoseTable

# Of a mutant (docs/testing.md) any failing example will do: it need not be the simplest.
SIMPLEST = () if "MUTANT_UNDER_TEST" in os.environ else (Phase.shrink, Phase.explain)
PHASES = (Phase.explicit, Phase.generate, *SIMPLEST)
# The same examples in every run: a test that fails once fails until it is fixed.
few = settings(derandomize=True, deadline=None, max_examples=25, database=None, phases=PHASES)
fewer = settings(few, max_examples=6)


def unit(vector):
    return np.asarray(vector, dtype=np.float64) / np.linalg.norm(vector)


def turn(axis, angle_rad):
    """Quaternion (wxyz) of a turn by its definition."""
    return np.array([np.cos(angle_rad / 2), *(np.sin(angle_rad / 2) * np.asarray(axis))])


def rotation_of(quat_wxyz):
    """Rotation matrix (3, 3) of a quaternion, by SciPy."""
    return Rotation.from_quat(quat_wxyz, scalar_first=True).as_matrix()


def pose_of(position_m, quat_wxyz):
    """Pose (4, 4) put together by hand."""
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation_of(quat_wxyz), position_m
    return pose


def table_of(poses, path=None):
    """A table of poses (N, 4, 4), quaternions by SciPy; one path unless told."""
    poses = np.asarray(poses)
    quat = Rotation.from_matrix(poses[:, :3, :3]).as_quat(scalar_first=True)
    quat *= np.where(quat[:, :1] < 0, -1.0, 1.0)
    frame = np.arange(len(poses))
    return PoseTable(frame, 0 * frame if path is None else path, poses[:, :3, 3].copy(), quat)


def vectors(bound, size=3):
    return st.tuples(*[st.floats(-bound, bound)] * size).map(np.array)


directions = vectors(1.0).filter(lambda v: np.linalg.norm(v) > 0.1).map(unit)
angles_rad = st.floats(-np.pi, np.pi)
quats = st.builds(turn, directions, angles_rad)
positions = vectors(100.0)
poses = st.builds(pose_of, positions, quats)
poses_near = st.builds(pose_of, vectors(3.0), quats)
fractions = st.floats(0.0, 1.0)
seeds = st.integers(0, 2**32 - 1)


def random_table(count, seed, per_path=10):
    """Poses turned anyhow within some metres."""
    rng = np.random.default_rng(seed)
    quat = Rotation.random(count, rng=rng).as_quat(canonical=True, scalar_first=True)
    return PoseTable(
        np.arange(count), np.arange(count) // per_path, rng.normal(size=(count, 3)), quat
    )


def random_poses(seed, count, step_m=0.3, step_rad=0.3):
    """A walk of poses, each a small motion from the one before."""
    rng = np.random.default_rng(seed)
    walk = [pose_of(rng.uniform(-3, 3, 3), turn(direction(rng), 1.0))]
    for _ in range(count - 1):
        angle = rng.uniform(0, step_rad)
        walk.append(walk[-1] @ pose_of(step_m * rng.normal(size=3), turn(direction(rng), angle)))
    return np.array(walk)


def direction(rng):
    return unit(rng.normal(size=3))


def relative_to_first(part):
    return np.array([np.linalg.inv(part[0]) @ pose for pose in part])
