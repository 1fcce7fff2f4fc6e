"""A furnished room of 5 x 4 x 2.6 m with painted walls, for tests that compare renders."""

import functools
import itertools

import numpy as np
import trimesh
from scipy.ndimage import gaussian_filter

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.render import choose

SIZE_M = np.array([5.0, 4.0, 2.6])
TEXELS = 512
# Corners of the six sides of the unit cube, and of the cube's faces seen from outside alike.
SIDES = np.array(
    [
        [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]],
        [[1, 1, 0], [1, 0, 0], [1, 0, 1], [1, 1, 1]],
        [[1, 0, 0], [0, 0, 0], [0, 0, 1], [1, 0, 1]],
        [[0, 1, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1]],
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
        [[0, 1, 1], [1, 1, 1], [1, 0, 1], [0, 0, 1]],
    ],
    dtype=np.float64,
)


def paint(rng, sigmas_texels):
    """A texture (512, 512, 3) of noise at several scales."""
    image = np.zeros((TEXELS, TEXELS, 3))
    for sigma in sigmas_texels:
        noise = gaussian_filter(rng.standard_normal(image.shape), (sigma, sigma, 0), mode="wrap")
        image += 45.0 / np.sqrt(len(sigmas_texels)) * noise / noise.std()
    return np.clip(128.0 + image, 0, 255).astype(np.uint8)


def sides(size_m):
    """Corners (6, 4, 3) of a box that begins at the origin."""
    return SIDES * size_m


@functools.cache
def furnished_room(sigmas_texels, seed=0):
    """Walls and boxes that share four textures, a ball with vertex colours, and a plant.

    Args:
        sigmas_texels: how coarse the paint is, at each of its scales.
        seed: of the paint.
    """
    rng = np.random.default_rng(seed)
    paints = itertools.cycle([paint(rng, sigmas_texels) for _ in range(4)])
    boxes = [sides(SIZE_M)]
    for centre, size, yaw in (
        ((1.0, 0.9, 0.0), (0.9, 0.6, 0.8), 0.4),
        ((3.9, 3.0, 0.0), (0.5, 1.1, 1.7), 0.1),
        ((3.6, 0.8, 0.0), (0.7, 0.7, 0.45), 1.1),
    ):
        turn = rotation_from_rpy([0.0, 0.0, yaw])
        boxes.append(sides(np.array(size)) @ turn.T + centre)
    parts = [
        MeshPart("side", corners, TWO, CORNER_UV, next(paints)) for box in boxes for corners in box
    ]
    return TexturedMesh((*parts, _ball(), _plant()))


def _ball():
    ball = trimesh.creation.icosphere(subdivisions=4, radius=0.4)
    rgb = (128.0 + 100.0 * np.sin(9.0 * ball.vertices)).astype(np.uint8)
    place = ball.vertices + np.array([1.2, 3.0, 1.0])
    return MeshPart("ball", place, np.asarray(ball.faces, np.int64), vertex_rgb=rgb)


def _plant():
    """Round leaves on two crossed sheets."""
    rows, columns = np.indices((128, 128)) / 16.0 % 1.0 - 0.5
    leaf = np.full((128, 128, 4), (40, 160, 60, 255), np.uint8)
    leaf[..., 3] = np.where(rows**2 + columns**2 < 0.16, 255, 0)
    sheet = np.array([[-0.4, 0, 0], [0.4, 0, 0], [0.4, 0, 0.8], [-0.4, 0, 0.8]])
    turned = sheet @ rotation_from_rpy([0.0, 0.0, np.pi / 2.0]).T
    vertices = np.concatenate([sheet, turned]) + np.array([2.4, 2.9, 0.3])
    faces = np.concatenate([TWO, TWO + 4])
    uv = np.concatenate([CORNER_UV, CORNER_UV])
    return MeshPart("plant", vertices, faces, uv, leaf, alpha_cutoff=0.5)


def room_poses(count, seed, roll=0.2):
    """Poses (N, 4, 4) about the middle of the room that look all round; ``roll`` in radians."""
    rng = np.random.default_rng(seed)
    yaw = np.arange(count) * 2.0 * np.pi / count
    poses = []
    for angle in yaw:
        place = SIZE_M * [0.5, 0.45, 0.6] + rng.uniform(-0.3, 0.3, 3)
        turn = rotation_from_rpy([*rng.uniform([-roll, -0.3], [roll, 0.4]), angle])
        poses.append(pose_matrix(turn, place))
    return np.stack(poses)


BACKENDS = [name for name in choose.BACKENDS if choose.why_not(name) is None]
CORNER_UV = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
TWO = np.array([[0, 1, 2], [0, 2, 3]])
LOOK_ALONG_X = pose_matrix(rotation_from_rpy([0.0, 0.0, 0.0]), [0.0, 0.0, 0.0])
PYOPENGL_WARNS = "ignore::DeprecationWarning:OpenGL.*"


def opener_of(name):
    """Return the opener of a backend with the default settings."""
    return lambda mesh, camera: choose.BACKENDS[name](mesh, camera, RenderConfig())


def camera_of(**values):
    return CameraConfig.model_validate({"width": 64, "height": 48, **values})


def facing_quad(x, half, texture=None, **values):
    """A square at distance ``x`` that faces the camera at the origin; texture left to right."""
    corners = np.array([[x, half, -half], [x, -half, -half], [x, -half, half], [x, half, half]])
    uv = CORNER_UV if texture is not None else None
    return MeshPart("quad", corners, TWO, uv, texture, **values)


def colored(rgb):
    return np.array([*rgb, 255], np.uint8)
