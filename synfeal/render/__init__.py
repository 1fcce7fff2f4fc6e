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
        InputError: this machine offers no way to render off screen.
    """
    from synfeal.render.pyrender_backend import PyrenderRenderer  # takes a second: only when needed

    return PyrenderRenderer(mesh, camera)
