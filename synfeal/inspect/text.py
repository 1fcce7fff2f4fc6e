"""The facts about a mesh as lines for a terminal and rows for a page; plain ASCII of our own."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from itertools import zip_longest
from textwrap import wrap
from typing import Any, NamedTuple

from jinja2 import Environment, PackageLoader

from synfeal.inspect.surface import viewer_js
from synfeal.mesh.gltf import slug_of

Facts = Mapping[str, Any]

MAX_PARTS = 20
VALUE_WIDTH = 72


class Section(NamedTuple):
    """Labelled values under a title."""

    title: str
    rows: tuple[tuple[str, str], ...]


def sections_of(facts: Facts) -> list[Section]:
    """All sections, in the order they are read."""
    found = [
        Section("Mesh", _mesh_rows(facts)),
        Section("Surface", _surface_rows(facts)),
        Section("Topology, seam copies merged", _topology_rows(facts["topology"])),
        Section("Free space", _space_rows(facts)),
        Section("Parts", _part_rows(facts["parts"])),
    ]
    if facts["findings"]:
        rows = tuple((str(i), text) for i, text in enumerate(facts["findings"], start=1))
        found.append(Section("Found or repaired on reading", rows))
    return found


def plain_text(facts: Facts) -> str:
    """The sections, the doubts and the snippet as aligned text."""
    sections = sections_of(facts)
    width = max(len(label) for section in sections for label, _ in section.rows)
    lines: list[str] = []
    for title, rows in sections:
        lines += [title, *(line for row in rows for line in _aligned(*row, width)), ""]
    if facts["doubts"]:
        bullets = [line for text in facts["doubts"] for line in _aligned("-", text, 1)]
        lines += ["Look at this first", *bullets, ""]
    return "\n".join([*lines, how_to_go_on(facts)])


def how_to_go_on(facts: Facts) -> str:
    """A scene for a configuration file and, last, the command that collects a first data set."""
    lines = ["For a configuration file, under scenes:", snippet(facts), ""]
    collect = facts["collect"]
    if collect is None:
        return "\n".join([*lines, "No command is suggested: no box was found to plan paths in."])
    empty = collect["empty_pixels"]["share"]
    said = f"A first data set, planned once: {collect['frames']} frames, {empty:.1%} empty pixels"
    return "\n".join([*lines, f"{said}:", "", collect["command"]])


def _aligned(label: str, value: str, width: int) -> list[str]:
    """A row as lines, what is too long for one going on below its beginning."""
    wrapped = wrap(value, VALUE_WIDTH, break_long_words=False, break_on_hyphens=False)
    return [
        f"  {text:<{width}}  {line}" for text, line in zip_longest([label], wrapped, fillvalue="")
    ]


def snippet(facts: Facts) -> str:
    """A scene in YAML, ready to paste under ``scenes:``."""
    mesh = facts["mesh"]
    lines = [
        f"  {slug_of(facts['title'])}:",
        "    source: mesh",
        f"    path: {json.dumps(mesh['path'], ensure_ascii=False)}",
        f"    sha256: {mesh['sha256']}",
        f"    up_axis: {mesh['up_axis']}",
        f"    unit_m: {mesh['unit_m']:g}",
    ]
    box = facts["suggested_sampling_box"]
    if box is None:
        lines.append("    # sampling_box: no suggestion; see the free space")
    else:
        inner = ", ".join(f"{axis}: [{low:z.2f}, {high:z.2f}]" for axis, (low, high) in box.items())
        lines.append(f"    sampling_box: {{{inner}}}")
    return "\n".join(lines)


def _mesh_rows(facts: Facts) -> tuple[tuple[str, str], ...]:
    values, volume = facts["properties"], facts["topology"]["enclosed_volume_m3"]
    low, high = values["bounds_m"]
    bounds = ", ".join(
        f"{axis} {a:z.2f} to {b:z.2f}" for axis, a, b in zip("xyz", low, high, strict=True)
    )
    facing = "" if volume is None else ", faces look inwards" if volume < 0 else ""
    return (
        ("vertices", f"{values['vertices']:,}"),
        ("  with texture-seam copies", f"{values['vertices_with_seams']:,}"),
        ("faces", f"{values['faces']:,}"),
        ("volume of the bounding box", f"{values['volume_m3']:.2f} m^3 (as in Table 1)"),
        (
            "enclosed volume",
            "none: not watertight" if volume is None else f"{abs(volume):.2f} m^3{facing}",
        ),
        ("extents", " x ".join(f"{extent:.2f}" for extent in values["extents_m"]) + " m"),
        ("bounds", f"{bounds} m"),
        ("parts, materials", f"{values['parts']}, {facts['materials']}"),
    )


def _surface_rows(facts: Facts) -> tuple[tuple[str, str], ...]:
    detail = facts["detail"]
    area = sum(detail["area_m2"].values())
    shares = ", ".join(
        f"{value / max(area, 1e-12):.0%} {name.replace('_', ' ')}"
        for name, value in detail["area_m2"].items()
    )
    rows = [("area", f"{area:.1f} m^2: {shares}")]
    texels, vertices = detail["texels_per_m"], detail["coloured_vertices_per_m"]
    if texels is not None:
        low, middle, high = texels
        text = f"{middle:.0f} (5 % of the textured area below {low:.0f}, 5 % above {high:.0f})"
        rows.append(("texels per metre, median", text))
    if vertices is not None:
        rows.append(("coloured vertices per metre", f"{vertices:.0f}"))
    backs = facts["back_faces_share"]
    if backs is not None:
        text = f"{backs:.0%} of what cameras see; drawn like front faces"
        rows.append(("back sides of faces", text))
    return tuple(rows)


def _topology_rows(topology: Facts) -> tuple[tuple[str, str], ...]:
    holes = f"{topology['holes']}"
    if topology["longest_holes_m"]:
        lengths = ", ".join(f"{length:.2f}" for length in topology["longest_holes_m"][:5])
        holes += f", the longest with rims of {lengths} m"
    return (
        ("watertight", "yes" if topology["watertight"] else "no"),
        ("connected pieces", f"{topology['components']:,}"),
        ("holes", holes),
        ("boundary edges", f"{topology['boundary_edges']:,}"),
        ("non-manifold edges", f"{topology['non_manifold_edges']:,}"),
    )


def _space_rows(facts: Facts) -> tuple[tuple[str, str], ...]:
    space, suggested = facts["free_space"], facts["suggested_sampling_box"]
    box = "none"
    if suggested is not None:
        box = ", ".join(f"{axis} {a:z.2f} to {b:z.2f}" for axis, (a, b) in suggested.items()) + " m"
    floor = "not found" if space["floor_m"] is None else f"z = {space['floor_m']:z.2f} m"
    return (
        ("share of the box", f"{space['share']:.1%} ({space['volume_m3']:.1f} m^3)"),
        ("enclosed, median", f"{space['enclosure']:.0%} over free points"),
        ("floor", floor),
        ("suggested sampling box", box),
        ("definition", space["definition"]),
    )


def _part_rows(parts: Sequence[Facts]) -> tuple[tuple[str, str], ...]:
    by_area = sorted(parts, key=lambda part: -part["area_m2"])
    rows = [(part["name"], _part_text(part)) for part in by_area[:MAX_PARTS]]
    if len(by_area) > MAX_PARTS:
        rows.append(("...", f"and {len(by_area) - MAX_PARTS} more, see inspect.json"))
    return tuple(rows)


def _part_text(part: Facts) -> str:
    colour = {"vertices": "vertex colours", "plain": "one plain colour"}.get(part["colour"], "")
    if part["texture_px"] is not None:
        colour = "texture {} x {}".format(*part["texture_px"])
    cut = "" if part["alpha_cutoff"] is None else f", alpha cut at {part['alpha_cutoff']:.2f}"
    return f"{part['faces']:>9,} faces  {part['area_m2']:>8.1f} m^2  {colour}{cut}"


def page_html(
    title: str,  # heading
    doubts: Sequence[str],  # sentences to stand out at the top
    sections: Sequence[Section],  # tables of numbers
    snippet: str,  # lines for a configuration file and for a shell
    picture_png: bytes,  # the picture
    scene: dict[str, Any],  # what :meth:`synfeal.inspect.surface.ViewerMesh.scene` returns
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
