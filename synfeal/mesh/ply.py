"""PLY files as parts: polygons and strips, colours of vertices or faces, or textures."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.errors import InputError
from synfeal.mesh.checks import distinct_rows
from synfeal.mesh.color_values import rgb_of
from synfeal.mesh.materials import TextureReader
from synfeal.mesh.model import Findings, MeshPart
from synfeal.mesh.ply_text import Lists, PlyText, parse_ply
from synfeal.mesh.polygons import triangulated
from synfeal.mesh.references import ReferenceResolver

Pixels = NDArray[np.uint8]
Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

INDEX_NAMES = ("vertex_indices", "vertex_index")
UV_NAMES = (
    ("s", "t"),
    ("u", "v"),
    ("texture_u", "texture_v"),
    ("texture_s", "texture_t"),
    ("texcoord_u", "texcoord_v"),
)
COLOR_NAMES = (
    ("red", "green", "blue"),
    ("r", "g", "b"),
    ("diffuse_red", "diffuse_green", "diffuse_blue"),
    ("diffuse_r", "diffuse_g", "diffuse_b"),
)
SPLAT_NAMES = {"f_dc_0", "scale_0", "rot_0", "opacity"}
TEXTURE_COMMENT = "texturefile"
READ_ELEMENTS = ("vertex", "face", "tristrips")


def read_ply(path: Path, resolver: ReferenceResolver, findings: Findings) -> list[MeshPart]:
    """Read a PLY file as parts in its own frame: one for each texture.

    Raises:
        InputError: It holds no faces.
        ValueError: It is damaged.
    """
    text = parse_ply(path.read_bytes())
    vertices = _positions(text)
    polygons = _polygons(text, len(vertices), findings)
    if not len(polygons.counts):
        raise InputError(path, _what_instead(text, len(vertices)))
    _report(text, findings)
    return _Reader(path, text, vertices, resolver, findings).parts(polygons)


def _positions(text: PlyText) -> Floats:
    columns = [text.numbers("vertex", axis) for axis in "xyz"]
    if any(column is None for column in columns):
        raise ValueError("its vertices have no x, y and z")
    return np.stack(columns, axis=1).astype(np.float64)  # type: ignore[arg-type]


def _what_instead(text: PlyText, n_vertices: int) -> str:
    """Say what a file without faces holds."""
    if set(text.columns.get("vertex", {})) >= SPLAT_NAMES:
        return (
            f"is a Gaussian splat of {n_vertices} Gaussians, which have no surface; export a mesh"
            " from the program that made it, or reconstruct one from its photographs"
        )
    if "range_grid" in text.columns:
        return "holds a range image and no faces; merge the scans into a mesh"
    if n_vertices:
        return (
            f"holds no faces but {n_vertices} points; make a surface of them, as MeshLab's"
            " Screened Poisson reconstruction does, or use synfeal scan on the RGB-D frames"
        )
    return "holds no faces; export the scene as a triangle mesh"


def _report(text: PlyText, findings: Findings) -> None:
    """Name what the file holds and what is not read of it."""
    for element in text.elements:
        if element.name not in READ_ELEMENTS and element.count:
            findings.note(f"{element.count} rows of '{element.name}' are not read")
    if text.n_left_over and text.elements:
        findings.warn(
            f"{text.n_left_over} bytes behind the last row its header declares are not read"
        )
    alpha = text.numbers("vertex", "alpha")
    if alpha is not None and len(alpha) and alpha.min() < alpha.max():
        findings.note("the opacity of vertices ('alpha') is not followed; drawn opaque")


class _Polygons:
    """Polygons of a file, with what its rows of faces hold beside them."""

    def __init__(self, counts: Ints, corners: Ints, row: Ints) -> None:
        """Take corners (C,) of polygons of so many corners (P,), each of a row (P,) or of -1."""
        self.counts, self.corners, self.row = counts, corners, row


def _polygons(text: PlyText, n_vertices: int, findings: Findings) -> _Polygons:
    """Read faces and strips."""
    lists = text.lists("face", *INDEX_NAMES)
    if lists is None:
        if text.numbers("face", "vertex_indices") is not None or _has_rows(text, "face"):
            raise ValueError("its faces have no list 'vertex_indices'")
        lists = Lists(np.zeros(0, np.int64), np.zeros(0, np.int64))
    counts, corners = lists.counts, lists.values.astype(np.int64)
    row = np.arange(len(counts))
    short = counts < 3
    if short.any():
        findings.warn(f"{short.sum()} faces with fewer than 3 corners left out")
        corners = corners[np.repeat(~short, counts)]
        counts, row = counts[~short], row[~short]
    strips = text.lists("tristrips", *INDEX_NAMES)
    if strips is not None:
        triangles = _strip_triangles(strips)
        counts = np.concatenate([counts, np.full(len(triangles), 3)])
        corners = np.concatenate([corners, triangles.reshape(-1)])
        row = np.concatenate([row, np.full(len(triangles), -1)])
    if len(corners) and not (corners.min() >= 0 and corners.max() < n_vertices):
        bad = corners[(corners < 0) | (corners >= n_vertices)][0]
        raise ValueError(f"a face names vertex {bad} of {n_vertices}; export it again")
    return _Polygons(counts, corners, row)


def _has_rows(text: PlyText, name: str) -> bool:
    return any(element.name == name and element.count for element in text.elements)


def _strip_triangles(strips: Lists) -> Ints:
    """Return the triangles (T, 3) of strips, which -1 separates; every other one is turned."""
    found = []
    for strip in np.split(strips.values.astype(np.int64), np.cumsum(strips.counts)[:-1]):
        for run in np.split(strip, np.flatnonzero(strip < 0)):
            run = run[run >= 0]
            if len(run) < 3:
                continue
            triangles = np.stack([run[:-2], run[1:-1], run[2:]], axis=1)
            triangles[1::2] = triangles[1::2, ::-1]
            found.append(triangles)
    triangles = np.concatenate(found) if found else np.zeros((0, 3), np.int64)
    a, b, c = triangles.T
    is_whole = (a != b) & (b != c) & (c != a)  # others only join one run to the next
    return np.asarray(triangles[is_whole])


class _Reader:
    """Puts polygons and their colours together."""

    def __init__(
        self,
        path: Path,
        text: PlyText,
        vertices: Floats,
        resolver: ReferenceResolver,
        findings: Findings,
    ) -> None:
        self._path, self._text, self._vertices = path, text, vertices
        self._findings = findings
        self._textures = TextureReader(path, resolver, findings)
        self._files = [
            comment.partition(" ")[2].strip().strip('"')
            for comment in text.comments
            if comment.lower().startswith(TEXTURE_COMMENT)
        ]

    def parts(self, polygons: _Polygons) -> list[MeshPart]:
        """Return the parts, in the order of their textures."""
        triangles = triangulated(self._vertices, polygons.counts, polygons.corners)
        crossing = int(triangles.crossing.sum())
        if crossing:
            self._findings.warn(f"{crossing} polygons cross themselves")
        vertex = polygons.corners[triangles.corners]
        row = polygons.row[triangles.polygon]
        uv = self._uv(polygons)
        if self._files and uv is None:
            self._findings.warn(
                f"names the texture '{self._files[0]}', but has no texture coordinates; drawn"
                " without"
            )
        if uv is None or not self._files:
            return [self._plain(vertex, row)]
        number = self._text.numbers("face", "texnumber")
        texture_of = np.zeros(len(row), np.int64)
        if number is not None:
            texture_of = np.where(row < 0, 0, number[row].astype(np.int64))
        elif len(self._files) > 1:
            self._findings.warn(
                f"names {len(self._files)} textures, but no 'texnumber' says which face has which;"
                f" '{self._files[0]}' is used"
            )
        found = []
        for index in np.unique(texture_of):
            chosen = texture_of == index
            corners = triangles.corners[chosen]
            found.append(self._textured(int(index), vertex[chosen], row[chosen], uv[corners]))
        return found

    def _textured(self, index: int, vertex: Ints, row: Ints, uv: Floats) -> MeshPart:
        """Return the part of triangles (T, 3) with texture coordinates (T, 3, 2)."""
        if not 0 <= index < len(self._files):
            self._findings.warn(
                f"{len(vertex)} faces name texture {index} of {len(self._files)}; drawn without"
            )
            return self._plain(vertex, row)
        name = self._files[index]
        pixels = self._textures.read(name, f"texture '{name}'")
        if pixels is None:
            return self._plain(vertex, row)
        lacking: NDArray[np.bool_] = np.asarray(np.isnan(uv).any(axis=(1, 2)))
        if lacking.any():
            self._findings.warn(
                f"{lacking.sum()} faces have no texture coordinates; they show a corner of their"
                " texture"
            )
            uv = np.where(lacking[:, None, None], 0.0, uv)
        if _colors(self._text, "vertex") is not None:
            self._findings.note("colours of vertices are not shown where there is a texture")
        flat = np.concatenate([vertex.reshape(-1, 1).astype(np.float64), uv.reshape(-1, 2)], axis=1)
        first, place = distinct_rows(flat)
        return MeshPart(
            self._path.name if len(self._files) == 1 else name,
            self._vertices[vertex.reshape(-1)[first]],
            place.reshape(-1, 3),
            uv=flat[first, 1:],
            texture=np.ascontiguousarray(pixels[..., :3]),
        )

    def _plain(self, vertex: Ints, row: Ints) -> MeshPart:
        """Return the part of triangles (T, 3) with colours of vertices, of faces, or without."""
        name = self._path.name
        vertex_rgb = self._rgb("vertex")
        face_rgb = None if vertex_rgb is not None else self._rgb("face")
        if face_rgb is not None:
            shown = np.where(row[:, None] < 0, np.uint8(255), face_rgb[row])
            soup = np.arange(vertex.size).reshape(-1, 3)
            corners_rgb = np.repeat(shown, 3, axis=0)
            return MeshPart(name, self._vertices[vertex.reshape(-1)], soup, vertex_rgb=corners_rgb)
        return MeshPart(name, self._vertices, vertex, vertex_rgb=vertex_rgb)

    def _rgb(self, element: str) -> Pixels | None:
        """Return colours (N, 3) of an element's rows, None if it has none."""
        stored = _colors(self._text, element)
        if stored is None:
            return None
        rgb, taken = rgb_of(stored)
        if taken:
            self._findings.note(f"colours taken as {taken}")
        return rgb

    def _uv(self, polygons: _Polygons) -> Floats | None:
        """Return texture coordinates (C, 2) of the corners of polygons, None if there are none.

        Those of faces go before those of vertices; NaN where a face has none.
        """
        lists = self._text.lists("face", "texcoord", "texcoords", "texture_coords")
        if lists is not None and lists.counts.any():
            first = np.cumsum(lists.counts) - lists.counts
            uv = np.full((len(polygons.corners), 2), np.nan)
            row = np.maximum(polygons.row, 0)
            fits = (polygons.row >= 0) & (lists.counts[row] == 2 * polygons.counts)
            odd = (polygons.row >= 0) & ~fits & (lists.counts[row] > 0)
            if odd.any():
                raise ValueError(
                    f"{odd.sum()} faces have a list 'texcoord' that is not two numbers for each"
                    " corner; export it again"
                )
            corner = np.arange(len(polygons.corners)) - np.repeat(
                np.cumsum(polygons.counts) - polygons.counts, polygons.counts
            )
            of_corner = np.repeat(first[row], polygons.counts) + 2 * corner
            held = np.repeat(fits, polygons.counts)
            for axis in range(2):
                uv[held, axis] = lists.values[of_corner[held] + axis]
            return uv
        for names in UV_NAMES:
            columns = [self._text.numbers("vertex", name) for name in names]
            if all(column is not None for column in columns):
                stacked: Any = np.stack(columns, axis=1)  # type: ignore[arg-type]
                return np.asarray(stacked[polygons.corners], np.float64)
        return None


def _colors(text: PlyText, element: str) -> NDArray[Any] | None:
    """Return the colours (N, 3) of rows as they are stored."""
    for names in COLOR_NAMES:
        columns = [text.numbers(element, name) for name in names]
        if all(column is not None for column in columns):
            return np.stack(columns, axis=1)  # type: ignore[arg-type]
    return None
