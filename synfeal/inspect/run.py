"""A first look at a mesh: what ``synfeal inspect`` does."""

from __future__ import annotations

from pathlib import Path
from typing import cast

import numpy as np
from numpy.typing import NDArray

from synfeal.config.models import SceneConfig
from synfeal.dataset.directories import refuse_foreign
from synfeal.files import atomic_path, write_json
from synfeal.inspect.facts import facts_of
from synfeal.inspect.freespace import find_free_space, suggest_box, viewpoint
from synfeal.inspect.page import page_html
from synfeal.inspect.picture import picture_png
from synfeal.inspect.surface import SurfacePoints
from synfeal.inspect.text import Facts, plain_text, sections_of, snippet
from synfeal.inspect.viewer_mesh import ACROSS_RAD, viewer_mesh
from synfeal.inspect.views import inside_views, top_view
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.planning.plan import sampling_box_of
from synfeal.seeds import generator_of

Array = NDArray[np.float64]

OUTPUTS = ("inspect.json", "inspect.png", "inspect.html")
N_LEVEL_RAYS = 64
BOX_RGB = (213, 94, 0)


def inspect_mesh(scene: SceneConfig, out: Path) -> str:
    """Write ``inspect.json``, ``inspect.png`` and ``inspect.html`` into ``out``; the text to print.

    Earlier files of these names are replaced.

    Args:
        scene: ``source`` is ``mesh``; a ``sampling_box`` confines the search for free space.
        out: directory, made if need be.

    Raises:
        InputError: the mesh cannot be used, the box misses it, or ``out`` holds other files.
    """
    refuse_foreign(out, OUTPUTS, "an inspection")
    path = cast(Path, scene.path)
    mesh = load_mesh(path, scene.up_axis, scene.unit_m)
    box_m = sampling_box_of(scene, mesh.bounds_m, str(path))
    surface = SurfacePoints.of(mesh, generator_of(0, "inspect"))
    caster = RayCaster(*mesh.merged())
    space = find_free_space(caster, surface.position_m, box_m)
    suggested_m = suggest_box(space)
    found_m = viewpoint(space, suggested_m)
    position_m = mesh.bounds_m.mean(axis=0) if found_m is None else found_m
    facts = facts_of(scene, mesh, surface, space, box_m, suggested_m)
    picture = _picture(path.name, facts, mesh, position_m, suggested_m)
    polylines = (
        [] if suggested_m is None else [(edges, BOX_RGB) for edges in box_lines(suggested_m)]
    )
    heading = heading_from_opening(caster, position_m)
    drawing = viewer_mesh(mesh, surface).scene(polylines, heading)
    page = page_html(
        path.name, facts["doubts"], sections_of(facts), snippet(facts), picture, drawing
    )
    _write(out / OUTPUTS[1], picture)
    _write(out / OUTPUTS[2], page.encode("utf-8"))
    write_json(out / OUTPUTS[0], facts)
    return plain_text(facts)


def box_lines(box_m: Array) -> list[Array]:
    """The edges of a box (2, 3) as polylines (N, 3): bottom, top and four uprights."""
    (x0, y0, z0), (x1, y1, z1) = box_m
    ring = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1], [x0, y0]])
    rings = [np.column_stack([ring, np.full(5, z)]) for z in (z0, z1)]
    return [*rings, *(np.stack([rings[0][i], rings[1][i]]) for i in range(4))]


def heading_from_opening(caster: RayCaster, position_m: Array) -> float:
    """Heading, radians, that looks in through the side level rays from (3,) escape to most.

    Across the corners of a room where none or all escape.
    """
    yaw = np.linspace(0.0, 2.0 * np.pi, N_LEVEL_RAYS, endpoint=False)
    level = np.stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)], axis=1)
    hits_m = caster.first_hit_m(np.broadcast_to(position_m, level.shape), level)
    out = level[np.isinf(hits_m)].sum(axis=0)
    if np.linalg.norm(out) < 1.0:
        return ACROSS_RAD
    return float(np.arctan2(-out[1], -out[0]))


def _picture(
    name: str, facts: Facts, mesh: TexturedMesh, position_m: Array, suggested_m: Array | None
) -> bytes:
    """Title, numbers and views; the mesh is cut at mid-height of the box, if there is one."""
    low, high = mesh.bounds_m
    cut_m = float(low[2] + 0.6 * (high[2] - low[2]))
    if suggested_m is not None:
        cut_m = float(suggested_m[:, 2].mean())
    values = facts["properties"]
    size = " × ".join(f"{extent:.2f}" for extent in values["extents_m"])
    caption = (
        f"{values['vertices']:,} vertices, {values['faces']:,} faces, {size} m,"
        f" {facts['free_space']['share']:.0%} of the box is free space"
    )
    views = inside_views(mesh, position_m)
    return picture_png(name, caption, top_view(mesh, cut_m), cut_m, suggested_m, position_m, views)


def _write(path: Path, content: bytes) -> None:
    with atomic_path(path) as temporary:
        temporary.write_bytes(content)
