"""All renderers that work here draw the same images, so that data does not depend on which did."""

import itertools

import pytest

from synfeal.config.models import CameraConfig
from tests.render_agreement import agreement, render_all
from tests.render_backends import BACKENDS, PYOPENGL_WARNS
from tests.small_room import furnished_room, room_poses

pytestmark = pytest.mark.filterwarnings(PYOPENGL_WARNS)

# Fine enough that every pixel has detail, coarse enough that it can be seen.
PAINT_TEXELS = (1.5, 4.0, 16.0)
PAIRS = list(itertools.combinations(BACKENDS, 2))
CAMERA = CameraConfig(width=160, height=120, fx=130.0, fy=138.0, cx=77.0, cy=64.5)


@pytest.fixture(scope="module")
def room_frames():
    """A dozen views of a furnished room by every backend."""
    return render_all(furnished_room(PAINT_TEXELS), CAMERA, room_poses(12, seed=3), BACKENDS)


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_colours_agree(room_frames, first, second):
    found = agreement(room_frames[first], room_frames[second])
    assert found.edge_share < 0.5  # there is something away from edges
    assert found.mean_level <= 0.5
    # Where OpenGL, which measures a texture's footprint on blocks of 2 x 2 samples, takes another
    # mip level than the footprint at the sample asks for: one pixel in ten thousand.
    assert found.top_level <= 48


@pytest.mark.parametrize(("first", "second"), PAIRS)
def test_depths_agree(room_frames, first, second):
    found = agreement(room_frames[first], room_frames[second])
    assert found.close_share >= 0.999
    assert found.one_share <= 0.001
    assert found.top_m <= 1e-4
