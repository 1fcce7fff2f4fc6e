"""When features overrule a motion that depth has found: views and estimators are stand-ins."""

from types import SimpleNamespace

import numpy as np
import pytest

from baselines.groundtruth.rgbd.dense import FIRM_CONSTRAINT, MIN_CONSTRAINT, Motion
from baselines.groundtruth.rgbd.tracks import View, neighbour
from synfeal.config.models import RgbdConfig
from synfeal.geometry.poses import pose_matrix

TRUE = pose_matrix(np.eye(3), [0.03, 0.0, 0.0])


def along(x_m):
    """A motion along x."""
    return pose_matrix(np.eye(3), [x_m, 0.0, 0.0])


def views(depth_says, features_say, inliers, constraint, agreement=0.9):
    """Two views; depth finds one motion (None: none), features another one."""
    dense = SimpleNamespace(
        cfg=RgbdConfig(),
        constraint=lambda _: constraint,
        refine=lambda *_: None if depth_says is None else Motion(depth_says, agreement),
        overlap=lambda *_: 0.9,
    )
    matcher = SimpleNamespace(
        features=lambda *_: None, motion=lambda *_: (features_say, inliers) if inliers else None
    )
    frame = SimpleNamespace(color=np.zeros((2, 2, 3), np.uint8), depth_m=None)
    return [View(frame, dense, matcher) for _ in range(2)]


WEAK, FIRM = (MIN_CONSTRAINT + FIRM_CONSTRAINT) / 2, 2 * FIRM_CONSTRAINT


@pytest.mark.parametrize(
    ("depth_m", "features_m", "inliers", "constraint", "taken_m"),
    [
        (0.001, 0.03, 200, WEAK, 0.03),  # depth was held back: features overrule it
        (0.001, 0.03, 200, FIRM, 0.001),  # nobody asks them where surfaces tell the motion
        (0.028, 0.03, 200, WEAK, 0.028),  # they agree: depth is the more exact
        (0.001, 0.03, 10, WEAK, 0.001),  # too few to contradict
        (0.001, 0.03, 0, WEAK, 0.001),  # none
        (0.25, 0.264, 200, WEAK, 0.25),  # of a long way features are off by more
        (0.001, 0.03, 200, 0.0, 0.03),  # before one plane depth is not asked
    ],
)
def test_features_overrule_depth_that_slid(depth_m, features_m, inliers, constraint, taken_m):
    i, j = views(along(depth_m), along(features_m), inliers, constraint)
    motion, accepted = neighbour(i, j, TRUE)
    np.testing.assert_array_equal(motion, along(taken_m))
    assert accepted


def test_depth_that_hardly_agrees_is_checked_in_firm_views_too():
    i, j = views(along(0.001), along(0.03), 200, FIRM, agreement=0.5)
    np.testing.assert_array_equal(neighbour(i, j, TRUE)[0], along(0.03))


@pytest.mark.parametrize(("inliers", "guess"), [(200, along(0.05)), (0, TRUE)])
def test_without_a_motion_by_depth_the_best_guess_stays_a_guess(inliers, guess):
    """Features', or else the motion of the pair before."""
    motion, accepted = neighbour(*views(None, along(0.05), inliers, FIRM), TRUE)
    np.testing.assert_array_equal(motion, guess)
    assert not accepted
