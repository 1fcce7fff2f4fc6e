"""Depth of a plane close to the clip planes, where depth buffers round the most."""

from __future__ import annotations

from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.intrinsics import intrinsics_of
from synfeal.config.models import CameraConfig
from synfeal.hard_cases.case import Case, Trial
from synfeal.hard_cases.exact import RATIONAL
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.render import raycast_backend

Array = NDArray[np.float64]
CAMERA = CameraConfig(width=16, height=16, near_m=0.05, far_m=100.0)
BUFFER_STEPS = np.float32(2**24 - 1)
RED = np.full((1, 1, 3), (255, 0, 0), np.uint8)


def plane_at(depth_m: float, slope: float) -> Trial:
    """A plane that the optical axis meets at ``depth_m``; it recedes by ``slope`` to the right."""
    x, y = (2.0 * depth_m * np.array(signs) for signs in ((-1, 1, 1, -1), (-1, -1, 1, 1)))
    corners = np.column_stack([x, y, depth_m + slope * x])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    mesh = TexturedMesh(
        (MeshPart("plane", corners, faces, vertex_rgb=np.full((4, 3), 255, np.uint8)),)
    )
    renderer = raycast_backend.RaycastRenderer(mesh, CAMERA, 1)
    truth = _depths_m(corners)
    drawn_m = np.array([float(depth) for depth in truth]).reshape(CAMERA.height, CAMERA.width)
    return Trial(
        naive=lambda: buffered(drawn_m).ravel(),
        ours=lambda: renderer.render_rgbd(np.eye(4))[1].ravel(),
        truth=truth,
    )


def buffered(depth_m: Array) -> Array:
    """Depths that went through a buffer of 24 bits, made metres again in float32."""
    near, far = np.float32(CAMERA.near_m), np.float32(CAMERA.far_m)
    device = (far + near) / (far - near) - 2 * far * near / (far - near) / np.float32(depth_m)
    kept = np.round((device + 1) / 2 * BUFFER_STEPS) / BUFFER_STEPS
    return np.asarray(2 * far * near / (far + near - (2 * kept - 1) * (far - near)))


def _depths_m(corners: Array) -> list[Any]:
    """Where the rays of all pixels meet the plane ``z = a + b x`` of the corners."""
    fx, _, cx, _ = map(Fraction, intrinsics_of(CAMERA))
    (x0, _, z0), (x1, _, z1) = ([Fraction(float(v)) for v in corner] for corner in corners[:2])
    b = (z1 - z0) / (x1 - x0)
    a = z0 - b * x0
    columns = [a / (1 - b * (u + Fraction(1, 2) - cx) / fx) for u in range(CAMERA.width)]
    return columns * CAMERA.height


_DEPTH = partial(
    Case,
    "depth",
    quantity="depth",
    unit="m",
    naive="24-bit depth buffer, float32",
    ours="RaycastRenderer.render_rgbd",
    reference=RATIONAL,
)

CASES = (
    _DEPTH("just behind near_m (0.05 m)", bound=2e-9, trial=partial(plane_at, 0.0500005, 0.0)),
    _DEPTH("slanted, 0.07 m", bound=8e-9, trial=partial(plane_at, 0.07, 0.4)),
    _DEPTH("slanted, 60 m", bound=4e-6, trial=partial(plane_at, 60.0, 0.4)),
    _DEPTH("just before far_m (100 m)", bound=4e-6, trial=partial(plane_at, 99.999, 0.0)),
)
