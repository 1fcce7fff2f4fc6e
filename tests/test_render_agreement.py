"""All renderers that work here draw the same images, so that data does not depend on which did."""

import itertools

import numpy as np
import pytest

from synfeal.config.models import CameraConfig, RenderConfig
from synfeal.render import choose
from tests.render_backends import BACKENDS, PYOPENGL_WARNS
from tests.small_room import furnished_room, room_poses

pytestmark = pytest.mark.filterwarnings(PYOPENGL_WARNS)

# Fine enough that every pixel has detail, coarse enough that it can be seen.
PAINT_TEXELS = (1.5, 4.0, 16.0)
CAMERA = CameraConfig(width=160, height=120, fx=130.0, fy=138.0, cx=77.0, cy=64.5)
JUMP = 0.02  # neighbours whose depths differ by more than this share lie on either side of an edge


@pytest.fixture(scope="module")
def room_frames():
    """A dozen views of a furnished room by every backend, in turns: colours and depths."""
    mesh, views = furnished_room(PAINT_TEXELS), room_poses(12, seed=3)
    opened = {name: choose.BACKENDS[name](mesh, CAMERA, RenderConfig()) for name in BACKENDS}
    seen = [{name: opened[name].render_rgbd(pose) for name in opened} for pose in views]
    for renderer in opened.values():
        renderer.close()
    return {
        name: [np.stack(k) for k in zip(*(s[name] for s in seen), strict=True)] for name in opened
    }


def away_from_edges(depth_m):
    """Pixels (N, H, W) among whose 3 x 3 neighbours depth does not jump; the border is out."""
    least, most = depth_m.copy(), depth_m.copy()
    for axis in (1, 2):
        for shift in (-1, 1):
            least = np.minimum(least, np.roll(least, shift, axis))
            most = np.maximum(most, np.roll(most, shift, axis))
    smooth = np.isfinite(most) & (most <= (1.0 + JUMP) * least)
    smooth[:, [0, -1]] = smooth[:, :, [0, -1]] = False
    return np.asarray(smooth, np.bool_)


@pytest.mark.parametrize(("first", "second"), list(itertools.combinations(BACKENDS, 2)))
def test_colours_and_depths_agree(room_frames, first, second):
    (rgb, depth_m), (other_rgb, other_depth_m) = room_frames[first], room_frames[second]
    smooth = away_from_edges(depth_m) & away_from_edges(other_depth_m)
    assert smooth.mean() > 0.5  # there is something away from edges
    level = np.abs(rgb.astype(np.int16) - other_rgb)
    assert level.mean() <= 0.5
    # Where OpenGL, which measures a texture's footprint on blocks of 2 x 2 samples, takes another
    # mip level than the footprint at the sample asks for: one pixel in ten thousand.
    assert level[smooth].max() <= 48
    sees = np.isfinite(depth_m), np.isfinite(other_depth_m)
    assert np.mean(sees[0] != sees[1]) <= 0.001
    both = sees[0] & sees[1]
    assert np.mean(np.abs(depth_m[both] - other_depth_m[both]) <= 1e-3) >= 0.999
    assert np.abs(depth_m[smooth] - other_depth_m[smooth]).max() <= 1e-4
