"""Checks of a file and its mesh before hours are spent on them, and repairs.

Files that would load into something wrong are refused by name, with what to do instead. What can
neither be seen nor hit is removed; each removal is a finding. Open edges, non-manifold edges,
slivers and faces that overlap are kept: a renderer and a ray caster need none of them repaired, and
a scan without them is the exception.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.errors import InputError
from synfeal.mesh.compressed import LIBRARIES
from synfeal.mesh.gltf import Json, listed, primitives_of, stand_alone
from synfeal.mesh.model import Findings, MeshPart, TexturedMesh

LEVELS = 1.0  # grey levels that rounding may make
# A face is without area if its height is rounding: of its longest edge, or of its coordinates.
RELATIVE_HEIGHT = 1e-12
MOST_REPEATED, FEW_REPEATED = 0.03, 10  # share and number of a part's faces that repeat others
ROUNDING = 4 * np.finfo(np.float64).eps


def check_mesh(mesh: TexturedMesh, path: Path) -> None:
    """Check for faces and finite coordinates."""
    if not mesh.parts:
        raise InputError(path, "holds no faces", "export the scene as a triangle mesh")
    for part in mesh.parts:
        bad = ~np.isfinite(part.vertices_m).all(axis=1)
        if bad.any():
            raise InputError(
                path,
                f"part '{part.name}' has {bad.sum()} vertices that are NaN or infinite; repair the"
                " mesh",
            )


def refuse_colorless(mesh: TexturedMesh, name: str) -> None:
    """Refuse a mesh without texture and vertex colours whose materials all have one colour."""
    painted = any(p.texture is not None or p.vertex_rgb is not None for p in mesh.parts)
    if not painted and len({part.base_color.tobytes() for part in mesh.parts}) == 1:
        raise InputError(
            name,
            "has neither a texture nor vertex colours; images would be of one colour. Export it"
            " with its texture (an OBJ with its .mtl), or show its shape by the light of a lamp at"
            ' the camera: `shade="headlight"`',
        )


def check_indices(part: MeshPart, path: Path) -> None:
    """Refuse faces that name vertices that do not exist."""
    if part.faces.min() < 0 or part.faces.max() >= len(part.vertices_m):
        raise InputError(
            path, f"part '{part.name}' has faces that name vertices it lacks", "export it again"
        )


def shows_one_color(mesh: TexturedMesh) -> bool:
    """Check whether every image of the mesh would be of one colour, whatever textures it has."""
    return bool(np.ptp(color_range(mesh), axis=0).max() <= LEVELS)


def color_range(mesh: TexturedMesh) -> NDArray[np.float64]:
    """Return the least and the greatest value (2, 3) of each channel that a mesh shows."""
    colors = np.concatenate([_extreme_colors(part) for part in mesh.parts])
    return np.stack([colors.min(axis=0), colors.max(axis=0)])


def _extreme_colors(part: MeshPart) -> NDArray[np.float64]:
    """Return the least and the greatest value (2, 3) of each channel that a part shows."""
    shown = np.full((1, 3), 255, np.uint8)
    if part.texture is not None:
        shown = part.texture[..., :3].reshape(-1, 3)
    elif part.vertex_rgb is not None:
        shown = part.vertex_rgb
    extremes = np.stack([shown.min(axis=0), shown.max(axis=0)])
    return np.asarray(extremes * (part.base_color[:3] / 255.0))


def check_sampling_box(box: NDArray[np.float64], bounds_m: NDArray[np.float64], name: str) -> None:
    """Refuse a box that misses the mesh or is of another scale.

    A box that misses the mesh, or a mesh more than a hundred times as large as the box, is almost
    always a file in millimetres or centimetres read as metres, or another up axis.

    Args:
        box: Lower and upper corner (2, 3) of the box, world, metres.
        bounds_m: Lower and upper corner (2, 3) of the mesh, world, metres.
        name: What messages call the mesh.
    """
    overlap = np.minimum(box[1], bounds_m[1]) - np.maximum(box[0], bounds_m[0])
    ratio = float(np.max(bounds_m[1] - bounds_m[0]) / np.max(box[1] - box[0]))
    if (overlap > 0).all() and ratio <= 100:
        return
    problem = "lies outside" if (overlap <= 0).any() else f"is {ratio:.0f} times smaller than"
    raise InputError(
        name,
        f"the sampling box {_show(box)} m {problem} the mesh, which spans {_show(bounds_m)} m;"
        " `unit_m` or `up_axis` is probably wrong",
    )


def _show(box: NDArray[np.float64]) -> str:
    return " ".join(
        f"{axis} {low:.3g}..{high:.3g}" for axis, low, high in zip("xyz", *box, strict=True)
    )


EXTRA = "synfeal[meshes]"
SUFFIXES = (".glb", ".gltf", ".obj", ".ply")
NAMES = ", ".join(SUFFIXES)
BY_BLENDER = "open it in Blender and export glTF 2.0 (.glb)"
BY_SURFACE = (
    "make a surface of it, as MeshLab's Screened Poisson reconstruction does, and save that as PLY"
)
BY_SPLATTING = (
    "export a mesh from the program that made it, or reconstruct one from its photographs"
)
SPLAT = "is a Gaussian splat, which has no surface"
CLOUD = "is a point cloud, which has no surface"
# What else people have, by suffix: what it is, and what to do.
OTHER_KINDS = {
    ".fbx": ("is an FBX scene, which is not read", BY_BLENDER),
    ".blend": ("is a Blender file, which is not read", BY_BLENDER),
    ".dae": ("is a COLLADA scene, which is not read", BY_BLENDER),
    ".3ds": ("is a 3D Studio scene, which is not read", BY_BLENDER),
    ".x3d": ("is an X3D scene, which is not read", BY_BLENDER),
    ".wrl": ("is a VRML scene, which is not read", BY_BLENDER),
    ".abc": ("is an Alembic scene, which is not read", BY_BLENDER),
    ".ifc": ("is a building model (IFC), which is not read", BY_BLENDER),
    ".skp": ("is a SketchUp model, which is not read", "export it from SketchUp as glTF or OBJ"),
    ".max": ("is a 3ds Max scene, which is not read", "export it from 3ds Max as glTF or OBJ"),
    ".off": ("is an OFF mesh, which is not read", "save it with MeshLab as PLY"),
    ".usdz": (
        "is a USDZ scene, as Object Capture, Polycam and RoomPlan write it, which is not read",
        "export glTF or OBJ from the app, or " + BY_BLENDER,
    ),
    **dict.fromkeys((".usd", ".usda", ".usdc"), ("is a USD scene, which is not read", BY_BLENDER)),
    **dict.fromkeys((".splat", ".spz", ".ksplat", ".sog", ".rad"), (SPLAT, BY_SPLATTING)),
    **dict.fromkeys((".las", ".laz", ".e57", ".pcd", ".pts", ".ptx", ".xyz"), (CLOUD, BY_SURFACE)),
    **dict.fromkeys(
        (".zip", ".7z", ".rar", ".gz", ".tar"),
        ("is an archive", "unpack it, and give the mesh inside"),
    ),
    **dict.fromkeys(
        (".mtl", ".bin"),
        ("is a companion of a mesh, not the mesh", "give the .obj or .gltf beside it"),
    ),
}

# Required extensions that change nothing here, or that are read.
READ = {
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
}
TRANSFORM = "with glTF-Transform (npm install --global @gltf-transform/cli):"
REMEDIES = {
    "KHR_draco_mesh_compression": f"decode it {TRANSFORM} gltf-transform copy IN OUT.glb",
    "EXT_meshopt_compression": f"decode it {TRANSFORM} gltf-transform dequantize IN OUT.glb",
    "KHR_meshopt_compression": f"decode it {TRANSFORM} gltf-transform dequantize IN OUT.glb,"
    " or export it without compression",
    "KHR_texture_basisu": f"turn its KTX2 textures into PNG {TRANSFORM}"
    " gltf-transform ktxdecompress IN OUT.glb (which needs the ktx command of KTX-Software)",
    "EXT_mesh_gpu_instancing": "export it with one node per instance",
}


def refuse_file(path: Path) -> None:
    """Check that there is a file, by its name of a kind that can hold a scene with colours."""
    if not path.is_file():
        raise InputError(
            path,
            "no such mesh file",
            "check the path (config/scenes/README.md says where the paper's meshes are)",
        )
    if path.stat().st_size == 0:
        raise InputError(path, "the mesh file is empty", "download or export it again")
    suffix = path.suffix.lower()
    if suffix == ".stl":
        raise InputError(
            path,
            "an STL file holds shape without colour, so every image would be blank",
            "export the scene as GLB, as OBJ with MTL and textures, or as PLY with vertex colours",
        )
    if suffix not in SUFFIXES:
        kind, remedy = OTHER_KINDS.get(
            suffix, (f"unknown kind of mesh '{path.suffix}'", f"convert it to one of {NAMES}")
        )
        raise InputError(path, kind, remedy)


def refuse_extensions(path: Path, header: Json) -> None:
    """Check that nothing in a glTF is stored in a form that is not read.

    Compressed forms pass where the file holds the plain form too.
    """
    required = header.get("extensionsRequired", [])
    unread = [n for n in required if n not in READ and not n.startswith("KHR_materials_")]
    for node in listed(header, "nodes"):
        unread += {"EXT_mesh_gpu_instancing"} & {*node.get("extensions", {})}
    for name in unread or stand_alone(header):
        remedy = REMEDIES.get(name, "export it without this extension")
        if name in LIBRARIES:
            remedy = f"pip install '{EXTRA}', or {remedy}"
        raise InputError(path, f"needs the glTF extension {name}, which is not read", remedy)
    for primitive in primitives_of(header):  # positions, triangles, colours, texture coordinates
        attributes = primitive["attributes"]
        read = [attributes[key] for key in attributes if key.startswith(("POS", "TEX", "COL"))]
        read += [primitive["indices"]] if "indices" in primitive else []
        if any("sparse" in header["accessors"][index] for index in read):
            raise InputError(
                path,
                "stores vertices in sparse accessors, which are not read",
                "export it again without morph targets or as OBJ",
            )


def repaired(part: MeshPart, findings: Findings) -> MeshPart:
    """Remove faces without area, repeated faces and unused vertices.

    Texture coordinates that are NaN or infinite become 0. Vertices keep their order.
    """
    keep = ~_without_area(part.vertices_m, part.faces)
    _count(findings, part, int((~keep).sum()), "zero-area", "removed")
    faces = part.faces[keep]
    first = _first_of_each(faces)
    n_repeated = len(faces) - len(first)
    if n_repeated > max(FEW_REPEATED, MOST_REPEATED * len(faces)):
        findings.warn(
            f"part '{part.name}': {n_repeated} of {len(faces)} faces repeat others and are removed;"
            " if that leaves holes, export it again from the program that shows it whole"
        )
    else:
        _count(findings, part, n_repeated, "duplicate", "removed")
    faces = faces[first]
    distinct, place = distinct_rows(part.vertices_m)
    doubled = 0
    if len(distinct) < len(place):
        doubled = len(faces) - len(_first_of_each(place[faces]))
    _count(findings, part, doubled, "coincident", "kept: their vertices or texture differ")
    part = replace(part, faces=faces)
    if part.uv is not None and not np.isfinite(part.uv).all():
        bad = np.logical_not(np.all(np.isfinite(part.uv), axis=1, keepdims=True))
        findings.warn(
            f"part '{part.name}': {bad.sum()} texture coordinates that are NaN or infinite set to 0"
        )
        part = replace(part, uv=np.where(bad, 0.0, part.uv))
    is_unused = np.ones(len(part.vertices_m), np.bool_)  # they would stretch its bounds
    is_unused[faces] = False
    unused = int(is_unused.sum())
    if not unused:
        return part
    noun = "vertex" if unused == 1 else "vertices"
    findings.note(f"part '{part.name}': {unused} unused {noun} removed")
    return part.over(faces)


def _count(findings: Findings, part: MeshPart, count: int, kind: str, what: str) -> None:
    if count:
        noun = "face" if count == 1 else "faces"
        findings.note(f"part '{part.name}': {count} {kind} {noun} {what}")


def _without_area(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Mark faces (F,) that are a point or a line; a thin sliver is neither, however small."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    edges = (b - a, c - b, a - c)
    longest = np.sqrt(np.max([np.einsum("fi,fi->f", edge, edge) for edge in edges], axis=0))
    twice_area = np.linalg.norm(np.cross(edges[0], edges[1]), axis=1)
    rounding = ROUNDING * np.abs(vertices).max(axis=1)[faces].max(axis=1)
    without: NDArray[np.bool_] = twice_area <= longest * (RELATIVE_HEIGHT * longest + rounding)
    return without


def _first_of_each(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the indices, in order, of faces whose three vertices no earlier face has."""
    first, _ = distinct_rows(np.sort(faces, axis=1))
    return np.sort(first)


def distinct_rows(rows: NDArray[Any]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Find equal rows, ten times as fast as ``np.unique`` along an axis.

    Returns:
        The first index (D,) of each distinct row (N, C), those in ascending order, and which of
        them (N,) each row is.
    """
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    is_new = np.ones(len(rows), np.bool_)
    is_new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    place = np.empty(len(rows), np.int64)
    place[order] = np.cumsum(is_new) - 1
    return order[is_new], place
