"""Public test models read by Synfeal and by assimp: area, bounds, materials and textures.

    pip install assimp-py==1.1.0
    python benchmarks/public_meshes.py FOLDER results/benchmarks/public_meshes.csv

FOLDER holds check-outs of repositories with test models, such as ``models`` of trimesh and
tinyobjloader and ``test`` of assimp. Each file is read in a process of its own, since damaged ones
are among them.
"""

from __future__ import annotations

import json
import multiprocessing as mp
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from synfeal.errors import InputError
from synfeal.mesh.load import load_mesh

SUFFIXES = (".obj", ".ply", ".glb", ".gltf")
SECONDS = 120
CLOSE = 1e-3  # relative
TEXTURE_KINDS = (1, 12)  # assimp's numbers: diffuse, base colour

Row = dict[str, Any]


def measured(vertices: list[np.ndarray], faces: list[np.ndarray]) -> Row:
    """Measure triangles by parts: positions (V, 3) and corners (F, 3) of each."""
    area, corners = 0.0, []
    for points, index in zip(vertices, faces, strict=True):
        triangles = points[index]
        a, b, c = (triangles[:, k] for k in range(3))
        area += float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)
        corners.append(triangles.reshape(-1, 3))
    if not corners:
        return {"faces": 0, "area": 0.0}
    whole = np.concatenate(corners)
    low, high = whole.min(axis=0), whole.max(axis=0)
    return {"faces": len(whole) // 3, "area": area, "low": low.tolist(), "high": high.tolist()}


def by_synfeal(path: Path) -> Row:
    """Read a mesh in its own axes and measure it."""
    mesh = load_mesh(path, "z")
    looks = {
        (id(part.texture), part.base_color.tobytes(), part.alpha_cutoff) for part in mesh.parts
    }
    textures = {id(part.texture) for part in mesh.parts if part.texture is not None}
    found = measured([p.vertices_m for p in mesh.parts], [p.faces for p in mesh.parts])
    found |= {"materials": len(looks), "textures": len(textures)}
    return found | {"findings": "; ".join(mesh.findings)}


def by_assimp(path: Path) -> Row:
    """Read a mesh with assimp, its nodes applied, and measure it."""
    import assimp_py

    flags = assimp_py.Process_Triangulate | assimp_py.Process_PreTransformVertices
    scene = assimp_py.import_file(str(path), flags | assimp_py.Process_SortByPType)
    vertices, faces, used = [], [], set()
    for mesh in scene.meshes:
        index = np.asarray(mesh.indices).reshape(-1)
        if len(index) != 3 * mesh.num_faces:
            continue  # points and lines
        vertices.append(np.asarray(mesh.vertices, np.float64).reshape(-1, 3))
        faces.append(index.reshape(-1, 3).astype(np.int64))
        used.add(mesh.material_index)
    textures = set()
    for number in used:
        held = scene.materials[number].get("TEXTURES", {})
        textures |= {name for kind in TEXTURE_KINDS for name in held.get(kind, [])[:1]}
    return measured(vertices, faces) | {"materials": len(used), "textures": len(textures)}


def _into(queue: Any, read: Callable[[Path], Row], path: Path) -> None:
    try:
        queue.put(json.dumps(read(path)))
    except InputError as error:
        queue.put(json.dumps({"refused": str(error).removeprefix(f"{path}: ")}))
    except Exception as error:  # noqa: BLE001 - of assimp, whose errors have no type of their own
        said = f"{type(error).__name__}: {error}".replace(f"{path.parent}/", "")
        queue.put(json.dumps({"failed": said[:200]}))


def apart(read: Callable[[Path], Row], path: Path) -> Row:
    """Read a mesh in another process; it may crash or hang."""
    queue: Any = mp.Queue()
    process = mp.Process(target=_into, args=(queue, read, path))
    process.start()
    try:
        found: Row = json.loads(queue.get(timeout=SECONDS))
    except Exception:  # noqa: BLE001 - of the queue
        found = {"failed": "no answer"}
    process.kill()
    process.join()
    return found


# What explains a difference, by words of our findings, in the order in which they are asked for.
EXPLAINED = {
    "repeat others": "duplicate faces, which are removed",
    "duplicate face": "duplicate faces, which are removed",
    "zero-area": "faces without an area, which are removed",
    "nowhere opaque": "parts that are transparent, which are left out",
    "less opaque than": "vertices that are transparent, whose surface is cut away",
    "have a skin": "a skin, whose pose assimp does not apply either",
    "not drawn": "points or lines",
    "cross themselves": "polygons that cross themselves, which both cut as they can",
}


def kind_of(ours: Row, theirs: Row) -> str:
    """Say how two readings of a file differ."""
    if "failed" in ours:
        return "Synfeal fails"
    if "refused" in ours:
        if "failed" in theirs or not theirs.get("area"):
            return "refused by both, or without faces to assimp"
        return "refused by Synfeal alone"
    if "failed" in theirs:
        return "read by Synfeal alone"
    corners = np.array([ours["low"], ours["high"]])
    size = float(np.ptp(corners, axis=0).max())
    is_close = abs(ours["area"] - theirs["area"]) <= CLOSE * max(ours["area"], 1e-12)
    if theirs.get("low") is not None:
        other = np.array([theirs["low"], theirs["high"]])
        is_close &= bool(np.abs(corners - other).max() <= CLOSE * size)
    if not is_close:
        for words, kind in EXPLAINED.items():
            if words in ours["findings"]:
                return f"area or bounds: {kind}"
        return "area or bounds: see the notes"
    if ours["textures"] != theirs["textures"]:
        is_told = "missing" in ours["findings"] or "cannot be" in ours["findings"]
        return f"textures: {'missing or unreadable files, named' if is_told else 'see the notes'}"
    return "alike"


def main(folder: Path, out: Path) -> None:
    """Compare all meshes below a folder, and write a table."""
    rows = []
    files = sorted(path for path in folder.rglob("*") if path.suffix.lower() in SUFFIXES)
    for path in files:
        ours, theirs = apart(by_synfeal, path), apart(by_assimp, path)
        row: Row = {"file": path.relative_to(folder).as_posix(), "kind": kind_of(ours, theirs)}
        for name, found in (("synfeal", ours), ("assimp", theirs)):
            for key in ("faces", "area", "materials", "textures"):
                row[f"{key}_{name}"] = found.get(key)
        row["said"] = ours.get("refused") or ours.get("failed") or ours.get("findings")
        row["said_assimp"] = theirs.get("failed")
        rows.append(row)
        print(f"{len(rows)}/{len(files)} {row['file']}: {row['kind']}", flush=True)
    table = pd.DataFrame(rows)
    table.to_csv(out, index=False, float_format="%.6g", lineterminator="\n")
    print(table["kind"].value_counts().to_string())


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
