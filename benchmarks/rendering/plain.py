"""What one would write without this project: a loop around pyrender and Pillow."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.camera.intrinsics import intrinsics_of
from synfeal.config.models import CameraConfig
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.render.pyrender_backend import CAM_FROM_GL, PyrenderRenderer

# Deleting an off-screen renderer ends EGL for all others of the process.
KEPT: list[Any] = []


class PlainPyrender:
    """pyrender's own off-screen renderer, unlit."""

    def __init__(self, mesh: TexturedMesh, camera: CameraConfig) -> None:
        with PyrenderRenderer(mesh, camera):  # sets pyrender up for EGL and today's NumPy
            import pyrender

        self._flat = pyrender.RenderFlags.FLAT | pyrender.RenderFlags.SKIP_CULL_FACES
        self._scene = pyrender.Scene(bg_color=np.zeros(4))
        self._scene.add(pyrender.Mesh([_primitive(pyrender, part) for part in mesh.parts]))
        self._camera = self._scene.add(
            pyrender.IntrinsicsCamera(
                *intrinsics_of(camera), znear=camera.near_m, zfar=camera.far_m
            )
        )
        self._offscreen = pyrender.OffscreenRenderer(camera.width, camera.height)
        KEPT.append(self._offscreen)

    def render(self, world_from_cam: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Colours (H, W, 3)."""
        self._scene.set_pose(self._camera, world_from_cam @ CAM_FROM_GL)
        return np.asarray(self._offscreen.render(self._scene, flags=self._flat)[0])

    def write(self, poses: NDArray[np.float64], out: Path) -> None:
        """Render the poses (N, 4, 4) into a new directory of 7-Scenes files."""
        out.mkdir()
        for index, pose in enumerate(poses):
            Image.fromarray(self.render(pose)).save(out / f"frame-{index:06d}.color.png")
            np.savetxt(out / f"frame-{index:06d}.pose.txt", pose)


def _primitive(pyrender: Any, part: MeshPart) -> Any:
    texture = None
    if part.texture is not None:
        texture = pyrender.Texture(
            source=np.ascontiguousarray(part.texture[..., :3]), source_channels="RGB"
        )
    return pyrender.Primitive(
        positions=part.vertices_m.astype(np.float32),
        indices=part.faces.astype(np.uint32),
        texcoord_0=None if part.uv is None else part.uv.astype(np.float32),
        color_0=None if part.vertex_rgb is None else part.vertex_rgb / np.float32(255.0),
        material=pyrender.MetallicRoughnessMaterial(
            baseColorTexture=texture, baseColorFactor=part.base_color / 255.0, doubleSided=True
        ),
    )
