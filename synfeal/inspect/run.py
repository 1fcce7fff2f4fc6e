"""A first look at a mesh: what ``synfeal inspect`` finds out once, draws and writes."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader
from numpy.typing import NDArray

from synfeal.config.models import SceneConfig
from synfeal.files import atomic_path, refuse_foreign, write_json
from synfeal.inspect.facts import Inspection, facts_of
from synfeal.inspect.picture import inside_views, picture_png, top_view
from synfeal.inspect.text import Facts, Section, how_to_go_on, plain_text, sections_of
from synfeal.inspect.viewer_mesh import ACROSS_RAD, viewer_js, viewer_mesh
from synfeal.mesh.rays import RayCaster

Array = NDArray[np.float64]


OUTPUTS = ("inspect.json", "inspect.png", "inspect.html")
N_LEVEL_RAYS = 64
BOX_RGB = (213, 94, 0)


def inspect_mesh(scene: SceneConfig, out: Path, unit_is_given: bool = True) -> str:
    """Write ``inspect.json``, ``inspect.png`` and ``inspect.html`` into ``out``; the text to print.

    Earlier files of these names are replaced. A ``sampling_box`` of the scene confines the search
    for free space; its unit may be doubted unless it is given.

    Raises:
        InputError: the mesh cannot be used, the box misses it, or ``out`` holds other files.
    """
    refuse_foreign(out, OUTPUTS, "an inspection")
    found = Inspection.of(scene, unit_is_given or scene.sampling_box is not None)
    facts = facts_of(found)
    picture = _picture(facts, found)
    edges = [] if found.suggested_m is None else box_lines(found.suggested_m)
    heading = heading_from_opening(found.caster, found.viewpoint_m)
    drawing = viewer_mesh(found.mesh, found.surface).scene(
        [(edge, BOX_RGB) for edge in edges], heading
    )
    page = page_html(
        facts["title"], facts["doubts"], sections_of(facts), how_to_go_on(facts), picture, drawing
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


def _picture(facts: Facts, found: Inspection) -> bytes:
    """Title, numbers and views; the mesh is cut at mid-height of the box, if there is one."""
    mesh, suggested_m, position_m = found.mesh, found.suggested_m, found.viewpoint_m
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
    views, top = inside_views(mesh, position_m), top_view(mesh, cut_m)
    return picture_png(facts["title"], caption, top, cut_m, suggested_m, position_m, views)


def _write(path: Path, content: bytes) -> None:
    with atomic_path(path) as temporary:
        temporary.write_bytes(content)


def page_html(
    title: str,  # heading
    doubts: Sequence[str],  # sentences to stand out at the top
    sections: Sequence[Section],  # tables of numbers
    snippet: str,  # lines for a configuration file and for a shell
    picture_png: bytes,  # the picture
    scene: dict[str, Any],  # what :meth:`synfeal.inspect.viewer_mesh.ViewerMesh.scene` returns
) -> str:
    """The page as HTML, with nothing to load from elsewhere."""
    loader = PackageLoader("synfeal.inspect", ".")
    pages = Environment(loader=loader, autoescape=True, keep_trailing_newline=True)
    return pages.get_template("page.html").render(
        title=title,
        doubts=doubts,
        sections=sections,
        snippet=snippet,
        picture=base64.b64encode(picture_png).decode("ascii"),
        scene=json.dumps(scene, allow_nan=False).replace("<", "\\u003c"),
        viewer=viewer_js(),
    )
