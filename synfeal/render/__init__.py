"""Rendering: one small interface, one module per backend."""

from __future__ import annotations

from synfeal.config.models import CameraConfig, RenderConfig
from synfeal.mesh.model import TexturedMesh
from synfeal.render.base import Renderer


def open_renderer(
    mesh: TexturedMesh, camera: CameraConfig, render: RenderConfig | None = None
) -> Renderer:
    """A renderer of ``mesh`` through ``camera``; a context manager.

    Raises:
        InputError: the backend named in ``render`` does not work on this machine, or none does.
    """
    if any(camera.distortion):
        from synfeal.render.distorted import DistortedRenderer  # loads SciPy: only when needed

        return DistortedRenderer(lambda pinhole: open_renderer(mesh, pinhole, render), camera)
    from synfeal.render.choose import open_chosen

    return open_chosen(mesh, camera, render or RenderConfig())
