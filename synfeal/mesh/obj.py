"""OBJ files with their materials as parts: one for each object or group and material."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.errors import InputError
from synfeal.mesh.color_values import rgb_of
from synfeal.mesh.materials import BLEND_CUTOFF, TextureReader, is_opaque
from synfeal.mesh.model import WHITE, Findings, MeshPart
from synfeal.mesh.mtl import MtlMaterial, TextureMap, opaque_by_tr, parse_mtl
from synfeal.mesh.obj_text import NO_UV, ObjText, Use, parse_obj
from synfeal.mesh.polygons import Triangulation, triangulated
from synfeal.mesh.references import ReferenceResolver

Pixels = NDArray[np.uint8]
Ints = NDArray[np.int64]

GREY = 102  # level of what has no colour, as other programs show it
MOST_NAMED = 5  # names in one finding


class ObjMaterial(NamedTuple):
    """Properties of a material that an unlit image shows.

    Attributes:
        base_color: Colour (4,) with alpha.
        texture: Pixels (H, W, 3 | 4), or None.
        map: How texture coordinates meet the texture.
        alpha_cutoff: See :class:`synfeal.mesh.model.MeshPart`.
    """

    base_color: Pixels
    texture: Pixels | None = None
    map: TextureMap | None = None
    alpha_cutoff: float | None = None


def read_obj(path: Path, resolver: ReferenceResolver, findings: Findings) -> list[MeshPart]:
    """Read an OBJ file as parts in its own frame.

    Raises:
        InputError: It holds no faces.
        ValueError: It is damaged.
    """
    text = parse_obj(path.read_bytes())
    if not len(text.counts):
        raise InputError(path, _what_instead(text))
    _report(text, findings)
    library = _Library(path, resolver, findings)
    library.read(text)
    triangles = triangulated(text.vertices, text.counts, text.corner_vertex)
    crossing = int(triangles.crossing.sum())
    if crossing:
        findings.warn(
            f"{crossing} polygons cross themselves; they cover {_excess(triangles):.2g} times their"
            " area"
        )
    return list(_Parts(path.name, text, triangles, library, findings).all())


def _excess(triangles: Triangulation) -> float:
    crossing = triangles.crossing
    area = float(triangles.area[crossing].sum())
    return float(triangles.covered[crossing].sum()) / area if area else np.inf


def _what_instead(text: ObjText) -> str:
    """Say what a file without faces holds."""
    remedy = "export the scene as a triangle mesh"
    if text.skipped["free form"]:
        return f"holds no faces but free-form surfaces, which are not read; {remedy}"
    if text.skipped["l"]:
        return f"holds no faces but {text.skipped['l']} lines; {remedy}"
    if text.short:
        return f"no face has 3 corners; {remedy}"
    if len(text.vertices):
        return (
            f"holds no faces but {len(text.vertices)} points; make a surface of them, as MeshLab's"
            " Screened Poisson reconstruction does"
        )
    return f"holds no faces; {remedy}"


def _report(text: ObjText, findings: Findings) -> None:
    """Name what the text holds and what is not read of it."""
    skipped = dict(text.skipped)
    nouns = {"l": "lines", "p": "points"}
    unseen = [f"{skipped.pop(key)} {noun}" for key, noun in nouns.items() if key in skipped]
    if unseen:
        findings.note(f"{' and '.join(unseen)} are not drawn")
    if text.short:
        findings.warn(f"{text.short} faces with fewer than 3 corners left out")
    if text.lacks_uv:
        findings.warn("faces name texture coordinates, of which the file has none")
    count = skipped.pop("free form", 0)
    if count:
        findings.warn(f"{count} statements of free-form surfaces are not read; export polygons")
    for keyword, times in skipped.items():
        findings.warn(f"'{keyword[:40]}' is not read ({_times(times)})")


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


class _Library:
    """Materials of an OBJ file by name, each reduced once."""

    def __init__(self, path: Path, resolver: ReferenceResolver, findings: Findings) -> None:
        self._path, self._resolver, self._findings = path, resolver, findings
        self._textures = TextureReader(path, resolver, findings)
        self._defined: dict[str, MtlMaterial] = {}
        self._opaque: set[str] = set()
        self._reduced: dict[str, ObjMaterial] = {}
        self._only: str | None = None
        self._folders: dict[str, PurePosixPath] = {}  # folder of its library, by material

    def read(self, text: ObjText) -> None:
        """Read all libraries, and name what faces use that none of them defines."""
        for name, content in self._contents(text):
            for material in parse_mtl(content):
                known = self._defined.setdefault(material.name, material)
                folder = PurePosixPath(name.strip('"').replace("\\", "/")).parent
                self._folders.setdefault(material.name, folder)
                if known != material:
                    self._findings.warn(
                        f"material '{material.name}' is defined twice; the first counts"
                    )
        faces = np.bincount(text.use_of, minlength=len(text.uses))
        used: dict[str | None, int] = {}
        for use, count in zip(text.uses, faces.tolist(), strict=True):
            if count:
                used[use.material] = used.get(use.material, 0) + count
        if set(used) == {None} and len(self._defined) == 1:
            (self._only,) = self._defined
            self._findings.note(f"no usemtl: all faces take the one material, '{self._only}'")
        elif None in used and self._defined:
            self._findings.warn(
                f"{used[None]} faces name no material (no usemtl before them); drawn grey"
            )
        unknown = {
            name: count for name, count in used.items() if name and name not in self._defined
        }
        if unknown and text.libraries + list(self._defined):
            self._findings.warn(
                f"{sum(unknown.values())} of {len(text.counts)} faces use materials that no MTL"
                f" defines, and are drawn grey: {_named(unknown)}"
            )
        kept = [m for m in self._defined.values() if m.name in used or m.name == self._only]
        self._opaque = opaque_by_tr(kept)
        if self._opaque:
            self._findings.note(
                f"'Tr 1' taken as opaque, as MeshLab and OpenMVS mean it: {_named(self._opaque)}"
            )

    def _contents(self, text: ObjText) -> Iterator[tuple[str, bytes]]:
        """Yield name and content of the libraries, or of one that lies beside the file instead."""
        missing, found = [], set()
        for line in dict.fromkeys(text.libraries):
            for name, content in self._named_files(line):
                if content is None:
                    missing.append(name)
                elif name not in found:
                    found.add(name)
                    yield name, content
        uses_some = any(use.material for use in text.uses)
        if not missing and (found or not uses_some):
            return
        for name in (f"{self._path.stem}.mtl", f"{self._path.name}.mtl"):
            content = None if name in found else self._resolver.find(name)
            if content is not None:
                told = ", ".join(f"'{name}'" for name in missing) or "no mtllib"
                what = f"{told} is missing" if missing else "no mtllib names a library"
                self._findings.warn(f"{what}; '{name}' beside the file is read instead")
                yield name, content
                return
        self._resolver.missing += missing
        if not missing:
            self._findings.warn("materials are used, but no mtllib says where they are; drawn grey")

    def _named_files(self, line: str) -> Iterator[tuple[str, bytes | None]]:
        """Yield each file that one ``mtllib`` names, and its content; names may have blanks."""
        words = line.split()
        while words:
            for count in range(len(words), 0, -1):
                name = " ".join(words[:count])
                content = self._resolver.find(name)
                if content is not None or count == 1:
                    break
            if content is None:  # up to the next one that ends like a library
                ends = [k for k, word in enumerate(words, 1) if word.lower().endswith(".mtl")]
                count = ends[0] if ends else len(words)
                name = " ".join(words[:count])
            yield name, content
            words = words[count:]

    def material(self, use: Use, is_colored: bool) -> ObjMaterial:
        """Return what faces of a use show where they have texture coordinates."""
        name = use.material if self._only is None else self._only
        if name is None or name not in self._defined:
            is_plain = name is None and not self._defined
            level = 255 if is_plain or is_colored else GREY
            return ObjMaterial(np.array([level, level, level, 255], np.uint8))
        if name not in self._reduced:
            self._reduced[name] = self._reduce(self._defined[name])
        return self._reduced[name]

    def _reduce(self, material: MtlMaterial) -> ObjMaterial:
        owner = f"material '{material.name or 'unnamed'}'"
        for what in material.unread:
            self._findings.warn(f"{owner}: '{what}' is not followed")
        texture_map = material.texture
        if texture_map is None and material.other_texture is not None:
            keyword, texture_map = material.other_texture
            self._findings.note(f"{owner}: has no map_Kd; its {keyword} is shown")
        texture = None if texture_map is None else self._pixels(texture_map, material, owner)
        base = self._plain_color(material, owner) if texture is None else WHITE.copy()
        opacity = self._opacity(material)
        base[3] = round(255 * opacity)
        if material.opacity is not None:
            texture = self._with_alpha(texture, base, material, owner)
            texture_map = texture_map or material.opacity
        elif texture is not None and opacity == 1.0 and not is_opaque(texture, base):
            self._findings.note(
                f"{owner}: its texture has transparency that no map_d asks for; drawn opaque"
            )
        has_alpha = base[3] < 255 or material.opacity is not None
        if not has_alpha or is_opaque(texture, base):
            texture = None if texture is None else np.ascontiguousarray(texture[..., :3])
            return ObjMaterial(base, texture, texture_map)
        self._findings.note(
            f"{owner}: blended transparency becomes an alpha test at {BLEND_CUTOFF:.2g}"
        )
        return ObjMaterial(base, texture, texture_map, BLEND_CUTOFF)

    def _plain_color(self, material: MtlMaterial, owner: str) -> Pixels:
        """Return the colour (4,) of a material without a texture."""
        if material.diffuse is None:
            return np.array([GREY, GREY, GREY, 255], np.uint8)
        color = np.nan_to_num(np.array(material.diffuse))
        if color.max() > 2.0:
            self._findings.warn(f"{owner}: its Kd is taken as levels from 0 to 255")
            color = color / 255.0
        elif color.max() > 1.0 or color.min() < 0.0:
            self._findings.warn(f"{owner}: its Kd is cut off at 0 and 1")
        return np.append(np.round(255 * np.clip(color, 0.0, 1.0)), 255).astype(np.uint8)

    def _opacity(self, material: MtlMaterial) -> float:
        if material.dissolve is not None:
            return float(np.clip(np.nan_to_num(material.dissolve, nan=1.0), 0.0, 1.0))
        if material.transparency is None or material.name in self._opaque:
            return 1.0
        return 1.0 - float(np.clip(np.nan_to_num(material.transparency), 0.0, 1.0))

    def _place(self, name: str, material: MtlMaterial) -> str:
        """Return the name of a texture as seen from the mesh: it may lie beside its library."""
        beside = (self._folders[material.name] / name).as_posix()
        if self._resolver.find(name) is None and self._resolver.find(beside) is not None:
            return beside
        return name

    def _pixels(self, texture: TextureMap, material: MtlMaterial, owner: str) -> Pixels | None:
        """Read a texture (H, W, 3 | 4), with its colours as ``-mm`` changes them."""
        for option in texture.unread:
            self._findings.warn(f"{owner}: option {option} of its texture is not followed")
        pixels = self._textures.read(self._place(texture.name, material), owner)
        if pixels is None or (texture.base, texture.gain) == (0.0, 1.0):
            return pixels
        changed = np.round(255 * texture.base + texture.gain * pixels[..., :3])
        return np.dstack([np.clip(changed, 0, 255).astype(np.uint8), pixels[..., 3:]])

    def _with_alpha(
        self, texture: Pixels | None, base: Pixels, material: MtlMaterial, owner: str
    ) -> Pixels | None:
        """Give the texture the alpha that ``map_d`` holds."""
        opacity_map = material.opacity
        assert opacity_map is not None
        color_map = material.texture
        if texture is not None and color_map is not None and color_map.name == opacity_map.name:
            return texture
        opacity = self._textures.read(self._place(opacity_map.name, material), owner)
        if opacity is None:
            return texture
        options = (opacity_map.offset, opacity_map.scale, opacity_map.is_clamped)
        if color_map is not None:
            wanted = (color_map.offset, color_map.scale, color_map.is_clamped)
            if options != wanted:
                self._findings.warn(f"{owner}: options of its map_d are not followed")
        alpha = opacity[..., 3] if opacity.shape[2] == 4 else opacity.mean(axis=2).astype(np.uint8)
        if texture is None:
            texture = np.broadcast_to(base[:3], (*alpha.shape, 3))
        elif alpha.shape != texture.shape[:2]:
            size = texture.shape[1::-1]
            resized = Image.fromarray(alpha).resize(size, Image.Resampling.BILINEAR)
            alpha = np.asarray(resized)
        return np.dstack([texture[..., :3], alpha])


def _named(names: Iterable[str]) -> str:
    listed = sorted(f"'{name}'" for name in names)
    more = len(listed) - MOST_NAMED
    return ", ".join(listed[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


@dataclass
class _Parts:
    """Puts the triangles of a file together as parts."""

    file: str
    text: ObjText
    triangles: Triangulation
    library: _Library
    findings: Findings

    def __post_init__(self) -> None:
        self._rgb: Pixels | None = None
        if self.text.colors is not None:
            self._rgb, taken = rgb_of(self.text.colors)
            without = int(np.isnan(self.text.colors).any(axis=1).sum())
            if taken:
                self.findings.note(f"colours of vertices taken as {taken}")
            if without:
                self.findings.warn(f"{without} vertices have no colour; drawn white")

    def all(self) -> Iterator[MeshPart]:
        """Yield the parts in the order in which the file first uses them."""
        use_of = self.text.use_of[self.triangles.polygon]
        lacks_uv = (self.text.corner_uv[self.triangles.corners] == NO_UV).any(axis=1)
        kind = 2 * use_of + lacks_uv
        order = np.argsort(kind, kind="stable")
        kinds, starts = np.unique(kind[order], return_index=True)
        ends = np.append(starts[1:], len(order))
        for number, start, end in zip(kinds.tolist(), starts, ends, strict=True):
            use = self.text.uses[number // 2]
            material = self.library.material(use, self._rgb is not None)
            corners = self.triangles.corners[order[start:end]]
            yield self._part(use, material, corners, has_uv=number % 2 == 0)

    def _part(self, use: Use, material: ObjMaterial, corners: Ints, has_uv: bool) -> MeshPart:
        name = use.owner or use.material or self.file
        if material.texture is not None and not has_uv:
            self.findings.warn(
                f"part '{name}': {len(corners)} faces have a texture but no texture coordinates;"
                " their base colour is used"
            )
        vertex = self.text.corner_vertex[corners]
        if material.texture is None or not has_uv:
            used, index = np.unique(vertex, return_inverse=True)
            rgb = None if self._rgb is None else self._rgb[used]
            base = material.base_color
            if rgb is not None:  # Kd beside colours of vertices is a default, not a factor
                base = np.append(WHITE[:3], base[3])
            return MeshPart(
                name,
                self.text.vertices[used],
                index.reshape(-1, 3).astype(np.int64),
                vertex_rgb=rgb,
                base_color=base,
                alpha_cutoff=material.alpha_cutoff,
            )
        if self._rgb is not None:
            self.findings.note("colours of vertices are not shown where there is a texture")
        n_uv = len(self.text.uv)
        pairs, index = np.unique(vertex * n_uv + self.text.corner_uv[corners], return_inverse=True)
        of_vertex, of_uv = np.divmod(pairs, n_uv)
        shown = material.map
        assert shown is not None
        return MeshPart(
            name,
            self.text.vertices[of_vertex],
            index.reshape(-1, 3).astype(np.int64),
            uv=self.text.uv[of_uv] * shown.scale + shown.offset,
            texture=material.texture,
            base_color=material.base_color,
            alpha_cutoff=material.alpha_cutoff,
            clamped_uv=(shown.is_clamped, shown.is_clamped),
        )
