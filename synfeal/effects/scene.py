"""Scenes for effects: lamps that can be switched, objects along each path.

The baking of a stand-in knows how much of its light comes from where. Each pixel of an ideal frame
is multiplied, in linear light, by the weighted shares of the groups of sources, so that states add
up as their weights do. Where objects stand is drawn from the path alone, so all shards of it see
the same ones.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.effects.files import LIGHT_GROUPS, carton_files, light_share_files
from synfeal.effects.light import Light
from synfeal.errors import InputError
from synfeal.mesh.instances import number_instances
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.standing import CLUTTER, Standing, refuse_larger, standing
from synfeal.records.files import read_json
from synfeal.render import open_renderer
from synfeal.render.base import Depth, Faces, Renderer, Rgb
from synfeal.render.surface import SurfaceImage, SurfaceTable

Array = NDArray[np.float64]
REACH_M = 3.0  # from a path, sideways
TRIES = 200  # places, before an object is left out


@dataclass(frozen=True)
class Crowd:
    """A scene, and the objects that may stand about in it."""

    mesh: TexturedMesh
    kinds: Sequence[tuple[str, TexturedMesh]]  # the objects by name, in turn
    count: int  # how many stand along a path, if there is place for them
    placed: tuple[str, ...] = ()  # names of the objects that stand in the scene for all paths

    @property
    def first_id(self) -> int:
        """The first number of objects along a path, after those of the scene itself."""
        return len(number_instances(self.mesh, self.placed).listed) + 1

    @cached_property
    def _corners(self) -> Array:
        vertices, faces = self.mesh.merged()
        return np.asarray(vertices[faces])

    def along(self, path_m: Array, rng: np.random.Generator) -> list[Standing]:
        """Place objects along a path of camera centres (P, 3); none touches another."""
        bounds_m = np.array([path_m.min(axis=0), path_m.max(axis=0)])
        bounds_m[:, :2] += np.array([[-REACH_M], [REACH_M]])
        widest_m = max(float(np.ptp(kind.bounds_m, axis=0).max()) for _, kind in self.kinds)
        lower, upper = bounds_m[:, :2] + np.array([[-widest_m], [widest_m]])
        flat = self._corners[:, :, :2]
        near = (flat.min(axis=1) <= upper) & (flat.max(axis=1) >= lower)
        corners = self._corners[near.all(axis=1)]
        found = standing(self.kinds, self.count, corners, bounds_m, rng, TRIES, path_m)
        return [each for each in found if each is not None]


def placed_objects(mesh: Path) -> tuple[str, ...]:
    """Read which objects stand in the scene of a mesh, in the order of their numbers."""
    path = mesh.with_name(CLUTTER)
    return tuple(place["name"] for place in read_json(path)) if path.is_file() else ()


def crowd_of(mesh: Path, render: RenderConfig) -> Crowd | None:
    """Return the objects that may stand about in a scene, if there are any.

    Raises:
        InputError: a file cannot be read, or an object is larger than the scene.
    """
    settings = render.effects and render.effects.clutter
    if not settings:
        return None
    scene = load_mesh(mesh)
    kinds = [(f.stem, load_mesh(f)) for f in settings.files or carton_files(mesh)]
    for name, kind in kinds:
        size_m = np.ptp(kind.bounds_m, axis=0)
        refuse_larger(size_m, scene, f"effects.clutter.files: {name}")
    return Crowd(scene, kinds, settings.count, placed_objects(mesh))


class SceneRenderer(Renderer):
    """A renderer of a scene, of its shares of light, and of the scene with objects in it."""

    def __init__(
        self,
        mesh: TexturedMesh,
        camera: CameraConfig,
        render: RenderConfig,
        shares: Mapping[str, TexturedMesh] | None = None,
        crowd: Crowd | None = None,
        full: Callable[[], TexturedMesh] | None = None,
        placed: Sequence[str] = (),
    ) -> None:
        """Open renderers of the scene and of its shares of light.

        Args:
            mesh: Mesh that colours are drawn of.
            camera: Camera of the frames.
            render: How they are drawn.
            shares: The mesh in the light of each group of sources alone, by the group's name; None
                where light is not switched.
            crowd: Objects that may stand along paths, if any.
            full: Loads the full mesh, which depth is taken of; None where ``mesh`` is that.
            placed: Names of the objects that are in the full mesh, in the order of their numbers.
        """
        self._camera, self._render, self._crowd = camera, render, crowd
        self._mesh, self._full, self._placed = mesh, full, placed
        self._ideal = open_renderer(mesh, camera, render)
        even = render.model_copy(update={"background_rgb": (255 // len(LIGHT_GROUPS),) * 3})
        held = (shares or {}).items()
        self._shares = {group: open_renderer(share, camera, even) for group, share in held}

    def render(self, world_from_cam: Array) -> Rgb:
        """Render the colours (H, W, 3) of the scene alone, in its own light, from a pose (4, 4)."""
        return self._ideal.render(world_from_cam)

    def render_rgbd(self, world_from_cam: Array) -> tuple[Rgb, Depth]:
        """Render colours (H, W, 3) and depth (H, W) of the scene alone, in its own light."""
        if self._full is None:
            return self._ideal.render_rgbd(world_from_cam)
        return self._ideal.render(world_from_cam), self._solid.render_depth(world_from_cam)

    def render_faces(self, world_from_cam: Array) -> Faces:
        """Return the triangle (H, W) of the full mesh that each pixel shows, -1 for nothing."""
        renderer = self._ideal if self._full is None else self._solid
        return renderer.render_faces(world_from_cam)

    def surface(self, world_from_cam: Array) -> SurfaceImage:
        """Render normals and instances of the scene alone."""
        return self._surface_table.look_up(self.render_faces(world_from_cam), world_from_cam)

    @cached_property
    def _surface_table(self) -> SurfaceTable:
        mesh = self._mesh if self._full is None else self._full()
        return SurfaceTable(mesh, self._camera, number_instances(mesh, self._placed))

    @cached_property
    def _solid(self) -> Renderer:
        """Draws the full mesh, whose textures matter only where they cut something out."""
        assert self._full is not None
        mesh = self._full()
        parts = (
            part if part.alpha_cutoff is not None else replace(part, texture=None)
            for part in mesh.parts
        )
        return open_renderer(replace(mesh, parts=tuple(parts)), self._camera, self._render)

    def left(self, world_from_cam: Array, weights: Mapping[str, float]) -> Light:
        """Return the factors (H, W, 3) of light left when groups of lamps have these weights."""
        total = np.zeros((), np.float32)
        for group, renderer in self._shares.items():
            if weights[group]:
                total = total + np.float32(weights[group] / 255) * renderer.render(world_from_cam)
        return np.asarray(total, np.float32)

    def along(self, path_m: Array, rng: np.random.Generator) -> SceneRenderer:
        """Return a renderer of the scene with objects placed along a path (P, 3), world, metres."""
        assert self._crowd is not None, "opened without `clutter`"
        n_placed, objects, names = len(self._crowd.placed), [], list(self._crowd.placed)
        for number, (parts, place) in enumerate(self._crowd.along(path_m, rng), n_placed):
            objects += [replace(part, name=f"object-{number}") for part in parts]
            names.append(place["name"])
        both = TexturedMesh((*self._mesh.parts, *objects))
        solid = TexturedMesh((*self._crowd.mesh.parts, *objects))
        full = None if self._full is None else lambda: solid
        return SceneRenderer(both, self._camera, self._render, full=full, placed=names)

    def close(self) -> None:
        """Give the memory of all meshes back."""
        for renderer in (self._ideal, *self._shares.values()):
            renderer.close()
        if "_solid" in self.__dict__:
            self._solid.close()


def open_scene(
    mesh: Path, camera: CameraConfig, render: RenderConfig | None, detail: Path | None = None
) -> SceneRenderer:
    """Open a renderer of a mesh that also knows what effects need: shares of light, objects.

    Args:
        mesh: The full mesh, which depth is taken of and objects stand in.
        camera: The camera of the frames.
        render: How they are drawn.
        detail: The mesh that colours are drawn of, as :mod:`synfeal.collection.detail` writes it;
            None draws the full one, as does :attr:`RenderConfig.draws_full_mesh`.

    Raises:
        InputError: a mesh cannot be read, its shares are not there, or objects cannot be used.
    """
    render = render or RenderConfig()
    light = render.effects and render.effects.light
    files = light_share_files(mesh) if light and light.states else {}
    missing = [file for file in files.values() if not file.is_file()]
    if missing:
        raise InputError(
            missing[0],
            "missing, and light.states needs it; of a mesh of your own use ev, temperature_k and"
            " field_ev",
        )
    crowd = crowd_of(mesh, render)
    shares = {group: load_mesh(file) for group, file in files.items()}

    def full() -> TexturedMesh:
        return crowd.mesh if crowd else load_mesh(mesh)

    if detail is None or render.draws_full_mesh:
        return SceneRenderer(full(), camera, render, shares, crowd, placed=placed_objects(mesh))
    return SceneRenderer(
        load_mesh(detail), camera, render, crowd=crowd, full=full, placed=placed_objects(mesh)
    )
