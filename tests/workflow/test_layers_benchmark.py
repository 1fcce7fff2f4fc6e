"""`python -m benchmarks.layers` compares frames with rays of the same camera."""

import numpy as np
import pytest

from benchmarks.layers import Open3dRays
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.render import open_renderer
from tests.support.small_room import BACKENDS, PYOPENGL_WARNS

pytestmark = pytest.mark.filterwarnings(PYOPENGL_WARNS)
CAMERA = CameraConfig(width=32, height=24, fx=20, fy=20, cx=16, cy=12)
# Looks along world x, upright.
POSE = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
BEFORE, AFTER = 0.8, 1.2


def screens(*depths_m):
    """A mesh of one triangle each, across the whole view, at these depths."""
    corners = [[[d, 9.0 * d, -9 * d], [d, -9 * d, -9 * d], [d, 0, 9 * d]] for d in depths_m]
    parts = [
        MeshPart(f"{depth_m} m", np.array(corner), np.array([[0, 1, 2]]))
        for depth_m, corner in zip(depths_m, corners, strict=True)
    ]
    return TexturedMesh(tuple(parts))


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_is_before_the_near_plane_is_seen_by_neither(backend):
    """The cause of the Large Room's 2 %: one of six cameras was 4 cm from a surface."""
    for share, expected in ((BEFORE, 1), (AFTER, 0)):
        mesh = screens(share * CAMERA.near_m, 1.0)
        with open_renderer(mesh, CAMERA, RenderConfig(backend=backend)) as renderer:
            np.testing.assert_array_equal(renderer.render_faces(POSE), expected)
            np.testing.assert_allclose(
                renderer.render_depth(POSE), 1.0 if expected else share * CAMERA.near_m, rtol=1e-5
            )
        np.testing.assert_array_equal(Open3dRays(mesh).faces(CAMERA, POSE, (0.0, 0.0)), expected)


@pytest.mark.parametrize(("apart_m", "alone"), [(2e-5, False), (5e-3, True)])
def test_a_pixel_is_in_doubt_where_two_surfaces_lie_on_each_other(apart_m, alone):
    rays = Open3dRays(screens(1.0, 1.0 + apart_m))
    np.testing.assert_array_equal(rays.stand_alone(CAMERA, POSE), alone)


def test_a_way_is_free_up_to_the_first_surface_behind_the_near_plane():
    rays = Open3dRays(screens(BEFORE * CAMERA.near_m, 1.0))
    points_m = np.array([[0.5, 0.1, 0.1], [2.0, 0.1, 0.1]])
    np.testing.assert_allclose(rays.reached(CAMERA, POSE, points_m), [2.0, 0.5], rtol=1e-5)
