"""Model of a scene: triangles with one base colour source per part."""

from __future__ import annotations

import logging
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

WHITE = np.full(4, 255, np.uint8)


@dataclass(frozen=True)
class MeshPart:
    """Triangles that share one material, in the world frame."""

    name: str  # name of the part in its file, for messages
    vertices_m: NDArray[np.float64]  # (V, 3) float64, world, z up, metres
    faces: NDArray[np.int64]  # (F, 3) int64, indices into ``vertices_m``
    # (V, 2) float64 texture coordinates, origin at the BOTTOM left, or None
    uv: NDArray[np.float64] | None = None
    texture: NDArray[np.uint8] | None = None  # (H, W, 3 | 4) uint8, first row at the top, or None
    vertex_rgb: NDArray[np.uint8] | None = None  # (V, 3) uint8, or None
    # (4,) uint8; multiplies the texture or the vertex colours
    base_color: NDArray[np.uint8] = field(default_factory=WHITE.copy)
    # fragments with less alpha than this are not drawn; None draws all of them
    alpha_cutoff: float | None = None
    # along u and v: texture coordinates beyond 0 and 1 show the texture's edge, else it repeats
    clamped_uv: tuple[bool, bool] = (False, False)

    @property
    def is_drawn(self) -> bool:
        """Check whether any fragment can pass the alpha test; those of light shafts never do."""
        if self.alpha_cutoff is None:
            return True
        alpha = self.base_color[3] / 255.0
        if self.texture is not None and self.texture.shape[2] == 4:
            alpha *= self.texture[..., 3].max() / 255.0
        return bool(alpha >= self.alpha_cutoff)

    def over(self, faces: NDArray[np.int64]) -> MeshPart:
        """Return the part with other faces (F, 3), without vertices that none of them uses."""
        used, index = np.unique(faces, return_inverse=True)
        return replace(
            self,
            vertices_m=self.vertices_m[used],
            faces=index.reshape(-1, 3).astype(np.int64),
            uv=None if self.uv is None else self.uv[used],
            vertex_rgb=None if self.vertex_rgb is None else self.vertex_rgb[used],
        )


@dataclass(frozen=True)
class TexturedMesh:
    """A scene: one or more parts in one world frame."""

    parts: tuple[MeshPart, ...]  # what is drawn
    # what was named or repaired when the mesh was read, one sentence each
    findings: tuple[str, ...] = ()

    @property
    def n_vertices(self) -> int:
        """Vertices of all parts; a vertex on a texture seam counts once per copy."""
        return sum(len(part.vertices_m) for part in self.parts)

    @property
    def n_faces(self) -> int:
        """Triangles of all parts."""
        return sum(len(part.faces) for part in self.parts)

    @property
    def bounds_m(self) -> NDArray[np.float64]:
        """Corners (2, 3) of the axis-aligned bounding box, metres."""
        lower = np.min([part.vertices_m.min(axis=0) for part in self.parts], axis=0)
        upper = np.max([part.vertices_m.max(axis=0) for part in self.parts], axis=0)
        return np.stack([lower, upper])

    def merged(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Join all parts to vertices (V, 3) and faces (F, 3) of one geometry, without colours."""
        counts = [len(part.vertices_m) for part in self.parts]
        offsets = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64)
        vertices = np.concatenate([part.vertices_m for part in self.parts])
        shifted = [part.faces + offset for part, offset in zip(self.parts, offsets, strict=True)]
        return vertices, np.concatenate(shifted)


log = logging.getLogger("synfeal")


class Findings:
    """Sentences in the order they were found, each once."""

    def __init__(self, path: Path) -> None:
        """Collect what is found in the file at ``path``."""
        self._path = path
        self._sentences: dict[str, None] = {}

    def note(self, sentence: str) -> None:
        """Keep a sentence: what was done is what its author would expect."""
        self._sentences.setdefault(sentence)

    def warn(self, sentence: str) -> None:
        """Keep a sentence and log it at once: the images differ from what the author sees."""
        if sentence not in self._sentences:
            log.warning("%s: %s", self._path, sentence)
        self.note(sentence)

    @property
    def sentences(self) -> tuple[str, ...]:
        """All findings so far."""
        return tuple(self._sentences)
