"""Decoding of compressed and quantised glTF by the library of each kind; strips as triangles.

``pip install synfeal[meshes]`` installs the libraries: meshoptimizer (EXT_meshopt_compression),
DracoPy (KHR_draco_mesh_compression) and opengl_basisu (KHR_texture_basisu: KTX2). Quantised
attributes (KHR_mesh_quantization) need none. What cannot be decoded here stays as it is, and
:mod:`synfeal.mesh.checks` says what to do.
"""

from __future__ import annotations

import base64
import copy
import io
import struct
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from trimesh.visual.color import to_float

from synfeal.mesh.gltf import (
    BASISU,
    DECODED_URI,
    DRACO,
    MESHOPT,
    TRIANGLE_FAN,
    TRIANGLE_STRIP,
    TRIANGLES,
    Gltf,
    Json,
    listed,
    primitives_of,
    stand_alone,
)
from synfeal.mesh.materials import MAX_PIXELS

LIBRARIES = dict.fromkeys(MESHOPT, "meshoptimizer")
LIBRARIES |= {DRACO: "DracoPy", BASISU: "opengl_basisu"}
FLOAT32, UINT32 = 5126, 5125
DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", UINT32: "<u4", FLOAT32: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
INDICES = {"TRIANGLES": "buffer", "INDICES": "sequence"}  # meshoptimizer's names
FILTERS = {"OCTAHEDRAL": "oct", "QUATERNION": "quat", "EXPONENTIAL": "exp"}
# Of a decoded view for each byte of its data: meshoptimizer stores a block of 256 vertices, 4 bytes
# each, in no less than one.
MOST_GAIN = 1024

KTX2_SIDES = 20  # where width and height stand in its header

Values = NDArray[Any]


def decoded(gltf: Gltf, read: Callable[[str], bytes]) -> Gltf:
    """Decode the compressed parts of a glTF; return it as it is if there are none.

    ``read`` gives the content of a file the glTF refers to.

    Raises:
        ValueError: A part is damaged; or another error of ``synfeal.mesh.load.DAMAGE``.
    """
    found = _Decoder(copy.deepcopy(gltf.header), gltf.binary, read)
    found.decode()
    return gltf if not found.store else Gltf(found.header, gltf.binary, bytes(found.store))


class _Decoder:
    """A header that is changed in place, and the buffer of what was decoded."""

    def __init__(self, header: Json, binary: bytes, read: Callable[[str], bytes]) -> None:
        self.header = header
        self.store = bytearray()
        self._views: list[Json] = header.setdefault("bufferViews", [])
        self._binary, self._read = binary, read
        self._buffers: dict[int, bytes] = {}

    def decode(self) -> None:
        """Decode what is there, in the order in which one form lies in another."""
        header = self.header
        needed = {*stand_alone(header), *header.get("extensionsRequired", [])}
        decoders: dict[str, Callable[[], None]] = {
            **{name: partial(self._decode_meshopt, name) for name in MESHOPT},
            DRACO: self._decode_draco,
            BASISU: self._decode_basisu,
        }
        for name, decode in decoders.items():
            if name in needed and find_spec(LIBRARIES[name]) is not None:
                decode()
                for key in ("extensionsRequired", "extensionsUsed"):  # it is no longer needed
                    header[key] = [other for other in header.get(key, []) if other != name]
        self._dequantise()
        self._list_triangles()
        if self.store:
            buffer = {"uri": DECODED_URI, "byteLength": len(self.store)}
            header.setdefault("buffers", []).append(buffer)

    def _decode_meshopt(self, name: str) -> None:
        for view in self._views:
            if name in view.get("extensions", {}):
                stored = view["extensions"][name]
                start = stored.get("byteOffset", 0)
                data = self._buffer(stored["buffer"])[start : start + stored["byteLength"]]
                kept = {key: view[key] for key in ("byteStride", "target") if key in view}
                view.clear()
                view.update(self._stored(decode_meshopt(data, stored)) | kept)
        for buffer in listed(self.header, "buffers"):
            if name in buffer.get("extensions", {}) and "uri" not in buffer:
                buffer["uri"] = DECODED_URI  # a placeholder, to which no view points any more

    def _decode_draco(self) -> None:
        primitives = primitives_of(self.header)
        from DracoPy import FileTypeException, decode

        for primitive in (p for p in primitives if DRACO in p.get("extensions", {})):
            stored = primitive["extensions"].pop(DRACO)
            try:
                mesh = decode(self._view_bytes(stored["bufferView"]))
            except FileTypeException as error:
                raise ValueError(str(error)) from error
            values = {entry["unique_id"]: np.asarray(entry["data"]) for entry in mesh.attributes}
            for name, identity in stored["attributes"].items():
                self._fill(primitive["attributes"][name], values[identity])
            if "indices" in primitive:
                self._fill(primitive["indices"], np.asarray(mesh.faces, "<u4").reshape(-1, 1))

    def _dequantise(self) -> None:
        """Convert positions and texture coordinates to floats, which is how they are read."""
        for primitive in primitives_of(self.header):
            for name, index in primitive["attributes"].items():
                accessor = self.header["accessors"][index]
                is_scaled = name == "POSITION" and accessor.get("normalized", False)
                is_read = is_scaled or name.startswith("TEXCOORD")
                is_held = "bufferView" in accessor and "sparse" not in accessor  # else refused
                if is_read and is_held and accessor["componentType"] != FLOAT32:
                    self._fill(index, fractions(self._values(accessor), accessor))

    def _list_triangles(self) -> None:
        """Convert strips and fans to lists of triangles, which is how they are read."""
        for primitive in primitives_of(self.header):
            mode = primitive.get("mode", TRIANGLES)
            if mode not in (TRIANGLE_STRIP, TRIANGLE_FAN):
                continue
            if "indices" in primitive:
                accessor = self.header["accessors"][primitive["indices"]]
                if "bufferView" not in accessor or "sparse" in accessor:
                    continue  # refused
                corners = self._values(accessor)[:, 0].astype("<u4")
            else:
                positions = self.header["accessors"][primitive["attributes"]["POSITION"]]
                check_stored(positions)
                corners = np.arange(positions["count"], dtype="<u4")
            index = triangles_of(corners, mode).reshape(-1, 1)
            self.header["accessors"].append({"type": "SCALAR"})
            self._fill(len(self.header["accessors"]) - 1, index)
            primitive.update(indices=len(self.header["accessors"]) - 1, mode=TRIANGLES)

    def _decode_basisu(self) -> None:
        textures = [t for t in listed(self.header, "textures") if BASISU in t.get("extensions", {})]
        for texture in (t for t in textures if "source" not in t):
            texture["source"] = texture["extensions"].pop(BASISU)["source"]
            image = self.header["images"][texture["source"]]
            is_inside = "bufferView" in image
            if not (is_inside and image.get("mimeType") == "image/png"):  # decoded for another
                read = self._view_bytes if is_inside else self._uri_bytes
                content = png_of_ktx2(read(image["bufferView" if is_inside else "uri"]))
                image.pop("uri", None)
                image.update(bufferView=self._view_of(content), mimeType="image/png")

    def _fill(self, accessor_index: int, values: Values) -> None:
        """Make an accessor that of ``values`` (N, C), with a view of its own."""
        kind = next(code for code, name in DTYPES.items() if np.dtype(name) == values.dtype)
        accessor = self.header["accessors"][accessor_index]
        for key in ("byteOffset", "normalized", "sparse", "min", "max"):
            accessor.pop(key, None)
        view = self._view_of(np.ascontiguousarray(values).tobytes())
        accessor.update(bufferView=view, componentType=kind, count=len(values))

    def _view_of(self, content: bytes) -> int:
        """Add a view of ``content`` and return its index."""
        self._views.append(self._stored(content))
        return len(self._views) - 1

    def _stored(self, content: bytes) -> Json:
        """Add ``content`` to the decoded buffer and return a view of it."""
        self.store += b"\0" * (-len(self.store) % 8)
        start = len(self.store)
        self.store += content
        buffer = len(self.header.get("buffers", []))  # where it will stand
        return {"buffer": buffer, "byteOffset": start, "byteLength": len(content)}

    def _values(self, accessor: Json) -> Values:
        """Return the values (N, C) of an accessor as they are stored."""
        view = self._views[accessor["bufferView"]]
        dtype, width = np.dtype(DTYPES[accessor["componentType"]]), WIDTHS[accessor["type"]]
        row = width * dtype.itemsize
        stride, count = view.get("byteStride", row), accessor["count"]
        data = self._view_bytes(accessor["bufferView"])[accessor.get("byteOffset", 0) :]
        if not 0 < (count - 1) * stride + row <= len(data):
            raise ValueError("an accessor reaches beyond its view")
        layout: Values = np.ndarray((count, width), dtype, data, 0, (stride, dtype.itemsize))
        return layout

    def _view_bytes(self, index: int) -> bytes:
        view = self._views[index]
        start = view.get("byteOffset", 0)
        return self._buffer(view["buffer"])[start : start + view["byteLength"]]

    def _buffer(self, index: int) -> bytes:
        if index == len(self.header.get("buffers", [])):
            return bytes(self.store)
        if index not in self._buffers:
            uri = self.header["buffers"][index].get("uri")
            self._buffers[index] = self._binary if uri is None else self._uri_bytes(uri)
        return self._buffers[index]

    def _uri_bytes(self, uri: str) -> bytes:
        if uri.startswith("data:"):
            return base64.b64decode(uri.partition(",")[2])
        return self._read(uri)


def check_stored(accessor: Json) -> None:
    """Check that the values of an accessor are stored: their number is taken at its word.

    Raises:
        ValueError: They are not.
    """
    if "bufferView" not in accessor:
        raise ValueError("a strip of triangles has no positions")


def triangles_of(corners: NDArray[np.uint32], mode: int) -> NDArray[np.uint32]:
    """Return the triangles (T, 3) of a strip or a fan, all turned the same way round."""
    count = max(len(corners) - 2, 0)
    first = np.arange(count)
    if mode == TRIANGLE_FAN:
        found = np.stack([first + 1, first + 2, np.zeros_like(first)], axis=1)
    else:
        odd = first % 2
        found = np.stack([first, first + 1 + odd, first + 2 - odd], axis=1)
    return np.asarray(corners[found], "<u4").reshape(-1, 3)


def decode_meshopt(data: bytes, stored: Json) -> bytes:
    """Decompress a view that meshoptimizer compressed.

    ``stored`` is its extension: ``count``, ``byteStride``, ``mode`` and ``filter``.

    Raises:
        ValueError: It claims to hold more than these bytes can.
    """
    import meshoptimizer as meshopt

    count, stride, mode = stored["count"], stored["byteStride"], stored["mode"]
    if not 0 <= count * stride <= MOST_GAIN * (len(data) + 1):
        raise ValueError(f"{len(data)} bytes claim to hold {count} x {stride}")
    if mode != "ATTRIBUTES":
        decode = getattr(meshopt, f"decode_index_{INDICES[mode]}")
        # Asked for two bytes, it would put two indices into one number.
        index = np.asarray(decode(count, 4, data))
        return index.astype(f"<u{stride}").tobytes()
    content = meshopt.decode_vertex_buffer(count, stride, data, dtype=np.dtype((np.void, stride)))
    name = stored.get("filter", "NONE")
    if name != "NONE":
        content = getattr(meshopt, f"decode_filter_{FILTERS[name]}")(content, count, stride)
    return bytes(content.tobytes())


def fractions(values: Values, accessor: Json) -> NDArray[np.float32]:
    """Convert integers (N, C) to fractions of their range where the accessor is normalised."""
    if not accessor.get("normalized", False):
        return values.astype("<f4")
    return np.asarray(np.maximum(to_float(values), -1.0), "<f4")


def png_of_ktx2(content: bytes) -> bytes:
    """Transcode the largest level of a KTX2 texture (Basis Universal, ETC1S or UASTC) to PNG.

    Raises:
        ValueError: It is too large to be read.
    """
    import opengl_basisu

    width, height = struct.unpack_from("<II", content, KTX2_SIDES)
    if width * height > MAX_PIXELS:
        raise ValueError(f"a texture of {width} x {height} pixels is too large to be read")
    texture = opengl_basisu.open(content)
    rgba = np.asarray(texture.transcode(opengl_basisu.Target.RGBA8).data)
    pixels = rgba if texture.has_alpha else np.ascontiguousarray(rgba[..., :3])
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, format="PNG", compress_level=1)
    return file.getvalue()
