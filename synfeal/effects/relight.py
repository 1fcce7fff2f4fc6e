"""Scenes whose lamps and daylight are switched: frames times the light that a state leaves.

The baking of a stand-in knows how much of its light comes from where. Each pixel of an ideal frame
is multiplied, in linear light, by the weighted shares of the groups of sources, so that states add
up as their weights do.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.config.models import CameraConfig, RenderConfig
from synfeal.effects.crowd import CrowdedRenderer, crowd_of
from synfeal.effects.light import GROUPS
from synfeal.effects.transfer import Light
from synfeal.errors import InputError
from synfeal.mesh.load import load_mesh
from synfeal.render import open_renderer
from synfeal.render.base import Depth, Renderer, Rgb


class LitRenderer(Renderer):
    """A renderer that knows the share of every group of sources too."""

    def __init__(self, ideal: Renderer, shares: Mapping[str, Renderer]) -> None:
        self._ideal, self._shares = ideal, shares

    def render(self, world_from_cam: NDArray[np.float64]) -> Rgb:
        """Colours (H, W, 3) in the scene's own light."""
        return self._ideal.render(world_from_cam)

    def render_rgbd(self, world_from_cam: NDArray[np.float64]) -> tuple[Rgb, Depth]:
        """Colours (H, W, 3) in the scene's own light, and depth (H, W)."""
        return self._ideal.render_rgbd(world_from_cam)

    def left(self, world_from_cam: NDArray[np.float64], weights: Mapping[str, float]) -> Light:
        """Factors (H, W, 3) of the light that is left with these weights of the groups."""
        total = np.zeros((), np.float32)
        for group, renderer in self._shares.items():
            if weights[group]:
                total = total + np.float32(weights[group] / 255) * renderer.render(world_from_cam)
        return np.asarray(total, np.float32)

    def close(self) -> None:
        """Give the memory of all meshes back."""
        for renderer in (self._ideal, *self._shares.values()):
            renderer.close()


def open_scene(mesh: Path, camera: CameraConfig, render: RenderConfig | None) -> Renderer:
    """A renderer of a mesh, which knows what else effects ask for: shares of light, objects.

    Raises:
        InputError: a mesh cannot be read, its shares are not there, or objects cannot be used.
    """
    if render and (crowd := crowd_of(mesh, render)):
        return CrowdedRenderer(crowd, camera, render)
    light = render and render.effects and render.effects.light
    if not (render and light and light.states):
        return open_renderer(load_mesh(mesh), camera, render)
    files = {group: mesh.with_name(f"light_{group}.glb") for group in GROUPS}
    missing = [file for file in files.values() if not file.is_file()]
    if missing:
        raise InputError(
            f"{missing[0]}: missing, and light.states needs it; of a mesh of your own use ev,"
            " temperature_k and field_ev"
        )
    even = render.model_copy(update={"background_rgb": (255 // len(GROUPS),) * 3})
    shares = {group: open_renderer(load_mesh(file), camera, even) for group, file in files.items()}
    return LitRenderer(open_renderer(load_mesh(mesh), camera, render), shares)
