"""The text of Wavefront OBJ files: vertices, polygons, and what they are said to belong to.

After "Object Files (.obj)", appendix B1 of the Advanced Visualizer manual (Wavefront, 1995), and
what programs write that differs: colours behind coordinates, tabs, several kinds of line ends. An
index below 0 counts back from the line it stands in. Free-form surfaces, lines and points are
counted, not read.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from synfeal.mesh.text_rows import decoded, lines_by_form, shown, table_of

Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

CHUNK_BYTES = 1 << 25
NO_UV = -1  # index of texture coordinates of a corner without
BLANKS = bytes.maketrans(b"\t\v\f\r", b"   \n")
COMMENT = re.compile(rb"(?m)^( *(?:[vVfFlp]|vt|vn|vp) [^#\n]*)#[^\n]*")
INDENT = re.compile(rb"(?m)^ +")
BLANK_LINE = re.compile(rb"\n\n+")
# Vertices, texture coordinates, normals, faces; and all else.
VERTEX, UV, NORMAL, FACE, OTHER = range(5)
# Statements that say nothing about where a surface is or how it is coloured.
WITHOUT_EFFECT = {"vn", "vp", "s", "mg", "lod", "c_interp", "d_interp", "bevel", "version", "r"}
WITHOUT_EFFECT |= {"shadow_obj", "trace_obj", "fo", "f"}
FREE_FORM = {"cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole"}
FREE_FORM |= {"scrv", "sp", "end", "con", "cdc", "cdp", "res", "ctech", "stech", "bzp", "bsp"}


class Use(NamedTuple):
    """Groups that faces are said to belong to; None where nothing is said."""

    object: str | None = None
    group: str | None = None
    material: str | None = None

    @property
    def owner(self) -> str | None:
        """Name of the group, else of the object."""
        return self.object if self.group is None else self.group


@dataclass
class ObjText:
    """Contents of an OBJ file.

    Attributes:
        vertices: Positions (V, 3).
        colors: Colours (V, 3) as they are written, NaN where there are none; None if nowhere.
        uv: Texture coordinates (T, 2), origin at the bottom left.
        counts: Number of corners (P,) of each polygon, at least three.
        corner_vertex: Vertex of each corner, polygon after polygon.
        corner_uv: Its texture coordinates, or ``NO_UV``.
        use_of: Index (P,) into ``uses`` of each polygon.
        uses: What polygons belong to.
        libraries: What stands behind each ``mtllib``.
        skipped: How often each statement was met that is not read.
        short: Number of faces with fewer than three corners.
        lacks_uv: Whether faces name texture coordinates and the file has none.
    """

    vertices: Floats
    colors: Floats | None
    uv: Floats
    counts: Ints
    corner_vertex: Ints
    corner_uv: Ints
    use_of: Ints
    uses: list[Use]
    libraries: list[str]
    skipped: Counter[str]
    short: int
    lacks_uv: bool = False


def parse_obj(content: bytes) -> ObjText:
    """Read the text of an OBJ file.

    Raises:
        ValueError: It is none, or a line of it cannot be read.
    """
    reader = _Reader()
    for chunk in _chunks(_plain(content)):
        reader.read(chunk)
    return reader.finished()


def _plain(content: bytes) -> bytes:
    """Return text in one byte per letter, with blanks and newlines alone between words."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        content = content.decode("utf-16").encode()
    text = content.removeprefix(b"\xef\xbb\xbf")
    if b"\0" in text:
        raise ValueError("it holds bytes of zero, so it is no text")
    if b"\r" in text:
        text = text.replace(b"\r\n", b"\n")
    text = text.translate(BLANKS).removesuffix(b"\\")
    return joined(text) if b"\\\n" in text else text


def joined(text: bytes) -> bytes:
    """Join lines that a backslash continues; one behind a comment continues nothing."""
    whole: list[bytes] = []
    is_open = False
    for line in text.split(b"\n"):
        if is_open:
            whole[-1] = whole[-1][:-1] + b" " + line
        else:
            whole.append(line)
        is_open = whole[-1].endswith(b"\\") and not whole[-1].lstrip().startswith(b"#")
    return b"\n".join(whole)


def _chunks(text: bytes) -> Iterator[bytes]:
    """Yield runs of whole lines without blanks before them, and without empty ones."""
    start = 0
    while start < len(text):
        end = text.find(b"\n", start + CHUNK_BYTES)
        end = len(text) if end < 0 else end + 1
        chunk = text[start:end]
        start = end
        if chunk.startswith(b" ") or b"\n " in chunk:
            chunk = INDENT.sub(b"", chunk)
        if b"#" in chunk:
            chunk = COMMENT.sub(rb"\1", chunk)
        if b"\n\n" in chunk:
            chunk = BLANK_LINE.sub(b"\n", chunk)
        chunk = chunk.strip(b"\n") + b"\n"
        if chunk != b"\n":
            yield chunk


@dataclass
class _Reader:
    """State of reading, after the lines so far."""

    vertices: list[Floats] = field(default_factory=list)
    colors: list[Floats] = field(default_factory=list)
    uv: list[Floats] = field(default_factory=list)
    counts: list[Ints] = field(default_factory=list)
    corner_vertex: list[Ints] = field(default_factory=list)
    corner_uv: list[Ints] = field(default_factory=list)
    use_of: list[Ints] = field(default_factory=list)
    uses: dict[Use, int] = field(default_factory=dict)
    libraries: list[str] = field(default_factory=list)
    skipped: Counter[str] = field(default_factory=Counter)
    n_vertices: int = 0
    n_uv: int = 0
    n_short: int = 0
    use: Use = field(default_factory=Use)

    def read(self, chunk: bytes) -> None:
        """Read a run of whole lines, none of them empty."""
        letters = np.frombuffer(chunk, np.uint8)
        ends = np.flatnonzero(letters == ord("\n")) + 1
        starts = np.concatenate([[0], ends[:-1]])
        kind = _kinds(letters, starts)
        blocks = {which: _block(chunk, starts, ends, kind == which) for which in (VERTEX, UV, FACE)}
        before = {
            which: count + np.cumsum(kind == which)
            for which, count in ((VERTEX, self.n_vertices), (UV, self.n_uv))
        }
        others = np.flatnonzero(kind == OTHER)
        changes = self._statements(others, [chunk[starts[i] : ends[i]] for i in others])
        self._read_vertices(blocks[VERTEX], int((kind == VERTEX).sum()))
        self._read_uv(blocks[UV], int((kind == UV).sum()))
        faces = np.flatnonzero(kind == FACE)
        at = np.searchsorted(changes[0], faces, side="right") - 1
        self._read_faces(blocks[FACE], changes[1][at], before[VERTEX][faces], before[UV][faces])

    def _statements(self, lines: Ints, texts: list[bytes]) -> tuple[Ints, Ints]:
        """Follow the statements that are no numbers.

        Args:
            lines: Positions (N,) of the lines in the chunk.
            texts: The lines.

        Returns:
            Positions from which something else is used, and its index in ``uses``.
        """
        at, index = [-1], [self._index()]
        for line, text in zip(lines, texts, strict=True):
            keyword, _, rest = decoded(text).strip().partition(" ")
            rest = rest.strip()
            lowered = keyword.lower()
            if lowered == "usemtl":
                self.use = self.use._replace(material=rest or None)
            elif lowered == "o":
                self.use = self.use._replace(object=rest or None, group=None)
            elif lowered == "g":
                self.use = self.use._replace(group=rest or None)
            elif lowered == "mtllib":
                self.libraries.append(rest)
                continue
            else:
                if not keyword.startswith("#") and lowered not in WITHOUT_EFFECT:
                    self.skipped["free form" if lowered in FREE_FORM else lowered] += 1
                self.n_short += lowered in ("f", "fo")
                continue
            at.append(int(line))
            index.append(self._index())
        return np.array(at), np.array(index)

    def _index(self) -> int:
        return self.uses.setdefault(self.use, len(self.uses))

    def _read_vertices(self, block: bytes, count: int) -> None:
        vertices, colors = np.empty((count, 3)), np.full((count, 3), np.nan)
        for lines, part in lines_by_form(block):
            first = part[: part.find(b"\n")]
            words = len(first.split()) - 1
            if words < 3:
                raise ValueError(f"'{shown(first)}' has fewer than 3 numbers")
            values = table_of(part.translate(None, b"vV"), words, np.float64)
            vertices[lines] = values[:, :3]
            if words in (6, 7):
                colors[lines] = values[:, 3:6]
            elif words != 3 and (words != 4 or (values[:, 3] != 1.0).any()):
                self.skipped[f"v with {words} numbers"] += len(lines)
        self.vertices.append(vertices)
        self.colors.append(colors)
        self.n_vertices += count

    def _read_uv(self, block: bytes, count: int) -> None:
        uv = np.zeros((count, 2))
        for lines, part in lines_by_form(block):
            words = len(part[: part.find(b"\n")].split()) - 1
            if words < 1:
                raise ValueError("a 'vt' has no numbers")
            values = table_of(part.translate(None, b"vtVT"), words, np.float64)
            uv[lines, : min(words, 2)] = values[:, :2]
        self.uv.append(uv)
        self.n_uv += count

    def _read_faces(self, block: bytes, use_of: Ints, n_vertices: Ints, n_uv: Ints) -> None:
        """Read faces.

        Args:
            block: Their lines.
            use_of: Index (F,) in ``uses`` of what each belongs to.
            n_vertices: How many vertices (F,) were read before each.
            n_uv: The same of texture coordinates.
        """
        for ending in (b" ", b"\n"):  # "1/" is "1"
            while b"/" + ending in block:
                block = block.replace(b"/" + ending, ending)
        lines, counts, vertex, uv = [], [], [], []
        for group, part in lines_by_form(block.replace(b"//", b"|")):
            words = part[: part.find(b"\n")].split()[1:]
            if len(words) < 3:
                self.n_short += len(group)
                continue
            columns = [0]  # column of each corner's vertex, and of what would follow
            for word in words:
                separators = word.count(b"/") + word.count(b"|")
                columns.append(columns[-1] + 1 + separators)
            numbers = part.translate(bytes.maketrans(b"/|", b"  "), b"fF")
            values = table_of(numbers, columns[-1], np.int64)
            indices = values[:, columns[:-1]]
            indices_uv = np.zeros_like(indices)
            for corner, word in enumerate(words):
                if b"/" in word and b"|" not in word:
                    indices_uv[:, corner] = values[:, columns[corner] + 1]
            if (indices == 0).any():
                bad = int(np.flatnonzero((indices == 0).any(axis=1))[0])
                line = part.split(b"\n")[bad].replace(b"|", b"//")
                raise ValueError(f"'{shown(line)}' names vertex 0; they are counted from 1")
            lines.append(group)
            counts.append(np.full(len(group), len(words)))
            vertex.append(_from_first(indices, n_vertices[group]).reshape(-1))
            uv.append(_from_first(indices_uv, n_uv[group]).reshape(-1))
        if not lines:
            return
        line_of, count_of = np.concatenate(lines), np.concatenate(counts)
        corner_vertex, corner_uv = np.concatenate(vertex), np.concatenate(uv)
        if len(lines) > 1:  # forms, each of which is in order
            corners = _in_order(line_of, count_of)
            corner_vertex, corner_uv = corner_vertex[corners], corner_uv[corners]
            order = np.argsort(line_of, kind="stable")
            line_of, count_of = line_of[order], count_of[order]
        self.counts.append(count_of)
        self.use_of.append(use_of[line_of])
        self.corner_vertex.append(corner_vertex)
        self.corner_uv.append(corner_uv)

    def finished(self) -> ObjText:
        """Join what was read, and check what faces name.

        Raises:
            ValueError: A face names something that the file does not have.
        """
        whole = ObjText(
            vertices=_joined(self.vertices, np.zeros((0, 3))),
            colors=_joined(self.colors, np.zeros((0, 3))),
            uv=_joined(self.uv, np.zeros((0, 2))),
            counts=_joined(self.counts, np.zeros(0, np.int64)),
            corner_vertex=_joined(self.corner_vertex, np.zeros(0, np.int64)),
            corner_uv=_joined(self.corner_uv, np.zeros(0, np.int64)),
            use_of=_joined(self.use_of, np.zeros(0, np.int64)),
            uses=list(self.uses),
            libraries=self.libraries,
            skipped=self.skipped,
            short=self.n_short,
        )
        if whole.colors is not None and np.isnan(whole.colors).all():
            whole.colors = None
        if not len(whole.uv):
            whole.lacks_uv = bool((whole.corner_uv != NO_UV).any())
            whole.corner_uv[:] = NO_UV
        _check_range(whole.corner_vertex, self.n_vertices, "vertex", least=0)
        _check_range(whole.corner_uv, self.n_uv, "texture coordinate", least=NO_UV)
        return whole


def _kinds(letters: Bytes, starts: Ints) -> NDArray[np.int8]:
    """Tell by its first letters which kind (N,) each line is of."""
    padded = np.append(letters, np.array([10, 10], np.uint8))
    first, second, third = (padded[starts + k] for k in range(3))
    lowered = first | 0x20
    kind = np.full(len(starts), OTHER, np.int8)
    is_v = lowered == ord("v")
    kind[is_v & (second == ord(" "))] = VERTEX
    kind[is_v & (second == ord("t")) & (third == ord(" "))] = UV
    kind[is_v & (second == ord("n")) & (third == ord(" "))] = NORMAL
    kind[(lowered == ord("f")) & (second == ord(" "))] = FACE
    return kind


def _block(chunk: bytes, starts: Ints, ends: Ints, chosen: NDArray[np.bool_]) -> bytes:
    """Join the chosen lines."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).view(np.int8)))
    runs = zip(starts[edges[::2]].tolist(), ends[edges[1::2] - 1].tolist(), strict=True)
    return b"".join(chunk[start:end] for start, end in runs)


def _from_first(indices: Ints, so_far: Ints) -> Ints:
    """Turn indices (F, n), from 1 or back from what was there, into ones from 0; 0 into -1."""
    back = indices < 0
    found = np.where(back, indices + so_far[:, None], indices - 1)
    found[back & (found < 0)] = np.iinfo(np.int64).min  # before the first: refused
    return found


def _in_order(line: Ints, count: Ints) -> Ints:
    """Return the positions of all corners, for faces in the order of their lines."""
    order = np.argsort(line, kind="stable")
    first = (np.cumsum(count) - count)[order]
    sorted_count = count[order]
    offset = np.cumsum(sorted_count) - sorted_count
    return np.asarray(np.arange(sorted_count.sum()) + np.repeat(first - offset, sorted_count))


def _joined(parts: Sequence[NDArray[Any]], empty: NDArray[Any]) -> NDArray[Any]:
    return np.concatenate(parts) if parts else empty


def _check_range(index: Ints, count: int, what: str, least: int) -> None:
    if not len(index):
        return
    if index.max() >= count:
        raise ValueError(f"a face names {what} {index.max() + 1} of {count}; export it again")
    if index.min() < least:
        raise ValueError(f"a face counts back to a {what} before the first; export it again")
