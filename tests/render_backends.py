"""The renderers that work here, and the small scenes their tests share."""

import numpy as np

from synfeal.config.models import CameraConfig, RenderConfig
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.model import MeshPart
from synfeal.render import choose

BACKENDS = [name for name in choose.BACKENDS if choose.why_not(name) is None]
CORNER_UV = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
TWO = np.array([[0, 1, 2], [0, 2, 3]])
LOOK_ALONG_X = pose_matrix(rotation_from_rpy([0.0, 0.0, 0.0]), [0.0, 0.0, 0.0])
PYOPENGL_WARNS = "ignore::DeprecationWarning:OpenGL.*"


def opener_of(name):
    """How a backend is opened with the default settings."""
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
