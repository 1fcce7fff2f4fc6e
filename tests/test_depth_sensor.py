"""The depth sensor against the closed form of its noise."""

from pathlib import Path

import numpy as np
import pytest

from baselines.groundtruth.rgbd.frames import NOISE_STEPS, STEP_PER_M, frame_generator, kinect_depth


def measured(depth_m):
    depth = np.full((400, 500), depth_m, dtype=np.float32)
    return kinect_depth(depth, np.random.default_rng(0))


@pytest.mark.parametrize("depth_m", [0.6, 1.0, 2.0, 3.3, 4.4])
def test_deviation_grows_with_the_square_of_the_depth(depth_m):
    """Noise of half a step and rounding, of variance 1/12 step, over the slope of 1/z."""
    expected_m = depth_m**2 * STEP_PER_M * np.sqrt(NOISE_STEPS**2 + 1 / 12)
    z = measured(depth_m)
    assert z.std() == pytest.approx(expected_m, rel=0.05)
    assert z.mean() == pytest.approx(depth_m, abs=0.02 * expected_m + expected_m**2 / depth_m * 2)


def test_disparity_is_whole_steps():
    steps = 1 / (measured(2.0).astype(np.float64) * STEP_PER_M)
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-4)
    assert len(np.unique(np.round(steps))) > 1


@pytest.mark.parametrize("depth_m", [0.4, 0.49, 4.6, 20.0, np.inf])
def test_nothing_is_seen_out_of_range(depth_m):
    assert np.isinf(measured(depth_m)).all()


def test_noise_belongs_to_the_frame_and_the_seed():
    depth = np.full((8, 9), 3.0, dtype=np.float32)

    def noise(seed, path):
        return kinect_depth(depth, frame_generator(seed, Path(path)))

    first = noise(1, "a/seq-01/frame-000000.depth.png")
    np.testing.assert_array_equal(first, noise(1, "b/seq-01/frame-000000.depth.png"))
    assert (first != noise(1, "a/seq-01/frame-000001.depth.png")).any()
    assert (first != noise(2, "a/seq-01/frame-000000.depth.png")).any()
