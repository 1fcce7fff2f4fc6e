"""Walks of poses, for tests of labels and pose graphs."""

import numpy as np

from tests.property_support import pose_of, turn


def random_poses(seed, count, step_m=0.3, step_rad=0.3):
    """A walk of poses, each a small motion from the one before."""
    rng = np.random.default_rng(seed)
    walk = [pose_of(rng.uniform(-3, 3, 3), turn(direction(rng), 1.0))]
    for _ in range(count - 1):
        angle = rng.uniform(0, step_rad)
        walk.append(walk[-1] @ pose_of(step_m * rng.normal(size=3), turn(direction(rng), angle)))
    return np.array(walk)


def direction(rng):
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


def relative_to_first(part):
    return np.array([np.linalg.inv(part[0]) @ pose for pose in part])
