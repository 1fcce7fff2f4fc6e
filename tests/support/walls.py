"""Walls whose colours and areas are known, written as OBJ and PLY by hand, and looks at them."""

import numpy as np

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.render.raycast_backend import RaycastRenderer

RED, BLUE, GREEN, YELLOW = (200, 40, 40), (40, 60, 200), (40, 180, 40), (220, 190, 30)
# World from a camera that looks along +y, with z up.
LOOKING_ALONG_Y = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
CAMERA = CameraConfig(width=17, height=17, horizontal_fov_deg=4.0)
EXACT = RenderConfig(backend="raycast", supersampling=1, detail="full")


def seen_from(mesh, camera_m, opened=RaycastRenderer, turn=LOOKING_ALONG_Y):
    """Colour (3,) and depth of what a camera sees in the middle of its image."""
    world_from_cam = np.eye(4)
    world_from_cam[:3, :3], world_from_cam[:3, 3] = turn, camera_m
    with opened(mesh, CAMERA, EXACT) as renderer:
        rgb, depth_m = renderer.render_rgbd(world_from_cam)
    return rgb[8, 8].tolist(), float(depth_m[8, 8])


def colors_along(mesh, places, opened=RaycastRenderer, distance_m=3.0):
    """Colours (N, 3) at points of a wall in the plane y = 0, seen from y < 0 straight ahead."""
    return [seen_from(mesh, (x, -distance_m, z), opened)[0] for x, z in places]


def area_m2(mesh):
    """Area of all triangles."""
    total = 0.0
    for part in mesh.parts:
        a, b, c = (part.vertices_m[part.faces[:, k]] for k in range(3))
        total += float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)
    return total


def square(left, z=0.0, side=1.0):
    """Corners of a square in the plane y = 0, whose lower left one is at (left, 0, z)."""
    return [(left, 0, z), (left + side, 0, z), (left + side, 0, z + side), (left, 0, z + side)]


UV_OF_SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
