"""Facts about a mesh as lines for a terminal and as an HTML page."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Mapping, Sequence
from itertools import zip_longest
from textwrap import wrap
from typing import Any

from jinja2 import Environment, PackageLoader

from synfeal.config.collection import CollectionConfig, SceneConfig
from synfeal.inspection.surface import viewer_js
from synfeal.mesh.gltf import slug_of

Facts = Mapping[str, Any]
Rows = list[tuple[str, str]]  # labels and values
Sections = list[tuple[str, Rows]]  # under titles

MAX_PARTS = 20
VALUE_WIDTH = 72


def sections_of(facts: Facts) -> Sections:
    """Return all sections, in the order in which they are read."""
    found = [
        ("Mesh", _mesh_rows(facts)),
        ("Surface", _surface_rows(facts)),
        ("Topology, seam copies merged", _topology_rows(facts["topology"])),
        ("Free space", _space_rows(facts)),
        ("Parts", _part_rows(facts["parts"])),
    ]
    if facts["findings"]:
        rows = [(str(i), text) for i, text in enumerate(facts["findings"], start=1)]
        found.append(("Found or repaired on reading", rows))
    return found


def plain_text(facts: Facts) -> str:
    """Format the sections, the doubts and the snippet as aligned text."""
    sections = sections_of(facts)
    width = max(len(label) for _, rows in sections for label, _ in rows)
    lines: list[str] = []
    for title, rows in sections:
        lines += [title, *(line for row in rows for line in _aligned(*row, width)), ""]
    if facts["doubts"]:
        bullets = [line for text in facts["doubts"] for line in _aligned("-", text, 1)]
        lines += ["Look at this first", *bullets, ""]
    return "\n".join([*lines, how_to_go_on(facts)])


def how_to_go_on(facts: Facts) -> str:
    """Write a scene for a configuration file and, last, the command that collects a data set."""
    lines = ["For a configuration file, under scenes:", snippet(facts), ""]
    collect = facts["collect"]
    if collect is None:
        return "\n".join([*lines, "No command is suggested: no box was found to plan paths in."])
    frames, empty = collect["frames"], collect["empty_pixels"]["share"]
    said = (
        f"A first data set, planned once: {frames['train']} training and {frames['test']} test"
        f" frames, {empty:.1%} empty pixels, {collect['of_one_color']:.0%} of the frames of one"
        " colour:"
    )
    return "\n".join([*lines, said, "", collect["command"]])


def _aligned(label: str, value: str, width: int) -> list[str]:
    """Format a row as lines, continuing what is too long below its beginning."""
    wrapped = wrap(value, VALUE_WIDTH, break_long_words=False, break_on_hyphens=False)
    return [
        f"  {text:<{width}}  {line}" for text, line in zip_longest([label], wrapped, fillvalue="")
    ]


def snippet(facts: Facts) -> str:
    """Write a scene in YAML, ready to paste under ``scenes:``."""
    mesh = facts["mesh"]
    suggested = "\n".join(f"    {line}" for line in _suggested_lines(facts))
    return f"""\
  {slug_of(facts["title"])}:
    source: mesh
    path: {json.dumps(mesh["path"], ensure_ascii=False)}
    sha256: {mesh["sha256"]}
    up_axis: {mesh["up_axis"]}
    unit_m: {mesh["unit_m"]:g}
{suggested}"""


def _suggested_lines(facts: Facts) -> list[str]:
    """Write the lines of a scene in YAML that say where cameras go."""
    collect, boxes = facts["collect"], facts["suggested_sampling_boxes"]
    if collect is None:
        return ["# sampling_box: no suggestion; see the free space"]
    first, *others = (
        "{"
        + ", ".join(f"{axis}: [{low:z.2f}, {high:z.2f}]" for axis, (low, high) in box.items())
        + "}"
        for box in boxes
    )
    lines = [f"sampling_box: {first}"]
    if others:
        lines += ["further_boxes:", *(f"  - {box}" for box in others)]
    for key in ("min_view_distance_m", "min_clearance_m", "min_seen"):
        if collect[key] not in (None, SceneConfig.model_fields[key].default):
            lines.append(f"{key}: {collect[key]:g}")
    if collect["min_path_m"] != CollectionConfig.model_fields["min_path_m"].default:
        lines.append(f"# and, beside scenes: collection: {{min_path_m: {collect['min_path_m']:g}}}")
    if collect["shade"]:
        lines.append(f"# and, beside scenes: render: {{shade: {collect['shade']}}}")
    return lines


def _mesh_rows(facts: Facts) -> Rows:
    values, volume = facts["properties"], facts["topology"]["enclosed_volume_m3"]
    enclosed = "none: not watertight"
    if volume is not None:
        enclosed = f"{abs(volume):.2f} m^3" + ", faces look inwards" * (volume < 0)
    return [
        ("vertices", f"{values['vertices']:,}"),
        ("  with texture-seam copies", f"{values['vertices_with_seams']:,}"),
        ("faces", f"{values['faces']:,}"),
        ("volume of the bounding box", f"{values['volume_m3']:.2f} m^3 (as in Table 1)"),
        ("enclosed volume", enclosed),
        ("extents", " x ".join(f"{extent:.2f}" for extent in values["extents_m"]) + " m"),
        ("bounds", _limits(zip("xyz", zip(*values["bounds_m"], strict=True), strict=True))),
        ("parts, materials", f"{values['parts']}, {facts['materials']}"),
    ]


def _limits(axes: Iterable[tuple[str, tuple[float, float]]]) -> str:
    return ", ".join(f"{axis} {low:z.2f} to {high:z.2f}" for axis, (low, high) in axes) + " m"


def _surface_rows(facts: Facts) -> Rows:
    detail, backs = facts["detail"], facts["back_faces_share"]
    area = sum(detail["area_m2"].values())
    shares = ", ".join(
        f"{value / max(area, 1e-12):.0%} {name.replace('_', ' ')}"
        for name, value in detail["area_m2"].items()
    )
    rows = [("area", f"{area:.1f} m^2: {shares}")]
    if detail["texels_per_m"] is not None:
        low, middle, high = detail["texels_per_m"]
        text = f"{middle:.0f} (5 % of the textured area below {low:.0f}, 5 % above {high:.0f})"
        rows.append(("texels per metre, median", text))
    if detail["colored_vertices_per_m"] is not None:
        rows.append(("coloured vertices per metre", f"{detail['colored_vertices_per_m']:.0f}"))
    if backs is not None:
        text = f"{backs:.0%} of what cameras see; drawn like front faces"
        rows.append(("back sides of faces", text))
    return rows


def _topology_rows(topology: Facts) -> Rows:
    holes = f"{topology['holes']}"
    if topology["longest_holes_m"]:
        lengths = ", ".join(f"{length:.2f}" for length in topology["longest_holes_m"][:5])
        holes += f", the longest with rims of {lengths} m"
    return [
        ("watertight", "yes" if topology["watertight"] else "no"),
        ("connected pieces", f"{topology['components']:,}"),
        ("holes", holes),
        ("boundary edges", f"{topology['boundary_edges']:,}"),
        ("non-manifold edges", f"{topology['non_manifold_edges']:,}"),
    ]


def _space_rows(facts: Facts) -> Rows:
    space, boxes = facts["free_space"], facts["suggested_sampling_boxes"]
    floor = "not found" if space["floor_m"] is None else f"z = {space['floor_m']:z.2f} m"
    return [
        ("share of the box", f"{space['share']:.1%} ({space['volume_m3']:.1f} m^3)"),
        ("enclosed, median", f"{space['enclosure']:.0%} over free points"),
        ("floor", floor),
        *(
            (f"suggested box {number}", _limits(box.items()))
            for number, box in enumerate(boxes, start=1)
        ),
        ("in suggested boxes", _covered_text(facts["collect"])),
        ("definition", space["definition"]),
    ]


def _covered_text(collect: Facts | None) -> str:
    if collect is None:
        return "none: no box was found to plan paths in"
    return f"{collect['covered']:.0%} of the places for cameras"


def _part_rows(parts: Sequence[Facts]) -> Rows:
    by_area, rows = sorted(parts, key=lambda part: -part["area_m2"]), []
    for part in by_area[:MAX_PARTS]:
        color = {"vertices": "vertex colours", "plain": "one plain colour"}.get(part["color"], "")
        if part["texture_px"] is not None:
            color = "texture {} x {}".format(*part["texture_px"])
        cut = "" if part["alpha_cutoff"] is None else f", alpha cut at {part['alpha_cutoff']:.2f}"
        size = f"{part['faces']:>9,} faces  {part['area_m2']:>8.1f} m^2"
        rows.append((part["name"], f"{size}  {color}{cut}"))
    if len(by_area) > MAX_PARTS:
        rows.append(("...", f"and {len(by_area) - MAX_PARTS} more, see inspect.json"))
    return rows


def page_html(
    title: str,
    doubts: Sequence[str],
    sections: Sections,
    snippet: str,
    picture_png: bytes,
    scene: dict[str, Any],
) -> str:
    """Build the page as HTML that loads nothing from elsewhere.

    Args:
        title: Heading of the page.
        doubts: Sentences to highlight at the top.
        sections: Titles and rows of the tables, from :func:`sections_of`.
        snippet: Lines for a configuration file and for a shell.
        picture_png: Content of the picture, from :func:`synfeal.inspection.run.picture_png`.
        scene: Argument of the viewer, from :meth:`synfeal.inspection.surface.ViewerMesh.scene`.
    """
    loader = PackageLoader("synfeal.inspection", ".")
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
