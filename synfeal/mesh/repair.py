"""What is taken out of a mesh because it can neither be seen nor hit: each removal is a finding.

Open edges, non-manifold edges, slivers and faces that overlap are kept: a renderer and a ray caster
need none of them repaired, and a scan without them is the exception.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from synfeal.mesh.model import Findings, MeshPart

# A face is without area if its height is rounding: of its longest edge, or of its coordinates.
RELATIVE_HEIGHT = 1e-12
ROUNDING = 4 * np.finfo(np.float64).eps


def repaired(part: MeshPart, findings: Findings) -> MeshPart:
    """The part without faces that have no area or occur twice, and without unused vertices.

    Texture coordinates that are NaN or infinite become 0. Vertices keep their order.
    """
    keep = ~_without_area(part.vertices_m, part.faces)
    _count(findings, part, int((~keep).sum()), "zero-area", "removed")
    faces = part.faces[keep]
    first = _first_of_each(faces)
    _count(findings, part, len(faces) - len(first), "duplicate", "removed")
    faces = faces[first]
    doubled = _on_another(part.vertices_m, faces)
    _count(findings, part, doubled, "coincident", "kept: their vertices or texture differ")
    return _compact(_finite_uv(replace(part, faces=faces), findings), findings)


def _count(findings: Findings, part: MeshPart, count: int, kind: str, what: str) -> None:
    if count:
        noun = "face" if count == 1 else "faces"
        findings.note(f"part '{part.name}': {count} {kind} {noun} {what}")


def _without_area(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which faces (F,) are a point or a line; a thin sliver is neither, however small."""
    corners = vertices[faces]
    edges = np.roll(corners, -1, axis=1) - corners
    lengths = np.linalg.norm(edges, axis=2)
    longest = lengths.max(axis=1)
    twice_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    rounding = ROUNDING * np.abs(corners).max(axis=(1, 2))
    without: NDArray[np.bool_] = twice_area <= longest * (RELATIVE_HEIGHT * longest + rounding)
    return without


def _first_of_each(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Indices of the faces, in order, whose three vertices no earlier face has."""
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return np.sort(first)


def _on_another(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> int:
    """How many faces have their corners exactly where those of another face are."""
    _, place = np.unique(vertices, axis=0, return_inverse=True)
    return len(faces) - len(_first_of_each(place.reshape(-1)[faces]))


def _finite_uv(part: MeshPart, findings: Findings) -> MeshPart:
    if part.uv is None:
        return part
    bad = np.logical_not(np.all(np.isfinite(part.uv), axis=1, keepdims=True))
    if not bad.any():
        return part
    findings.warn(
        f"part '{part.name}': {bad.sum()} texture coordinates that are NaN or infinite set to 0"
    )
    return replace(part, uv=np.where(bad, 0.0, part.uv))


def _compact(part: MeshPart, findings: Findings) -> MeshPart:
    """The part without the vertices that no face names; they would stretch its bounds."""
    unused = len(part.vertices_m) - len(np.unique(part.faces))
    if not unused:
        return part
    noun = "vertex" if unused == 1 else "vertices"
    findings.note(f"part '{part.name}': {unused} unused {noun} removed")
    return part.over(part.faces)
