"""Compressed and quantised glTF put into the plain form that is read, by each kind's own library.

``pip install synfeal[meshes]`` installs the libraries: meshoptimizer (EXT_meshopt_compression),
DracoPy (KHR_draco_mesh_compression) and opengl_basisu (KHR_texture_basisu: KTX2). Quantised
attributes (KHR_mesh_quantization) need none. What cannot be decoded here stays as it is, and
:mod:`synfeal.mesh.checks` says what to do.
"""

from __future__ import annotations

import base64
import copy
import importlib
import io
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from synfeal.mesh.gltf import BASISU, DECODED_URI, DRACO, MESHOPT, Gltf, Json, stand_alone

LIBRARIES = dict.fromkeys(MESHOPT, "meshoptimizer")
LIBRARIES |= {DRACO: "DracoPy", BASISU: "opengl_basisu"}
FLOAT32, UINT32 = 5126, 5125
DTYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", UINT32: "<u4", FLOAT32: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
MOST_BYTES = 2**33  # of one decoded view: what says it holds more is damaged

Values = NDArray[Any]


def can_decode(extension: str) -> bool:
    """Whether the library for an extension is installed."""
    try:
        importlib.import_module(LIBRARIES[extension])
    except ImportError:
        return False
    return True


def decoded(gltf: Gltf, read: Callable[[str], bytes]) -> Gltf:
    """The glTF with everything plain that can be decoded here; itself if nothing needs it.

    ``read`` gives the content of a file the glTF refers to.

    Raises:
        Exception: of any kind, as decoders of foreign files do on damaged ones.
    """
    found = _Decoder(copy.deepcopy(gltf.header), gltf.binary, read)
    found.decode()
    return gltf if not found.store else Gltf(found.header, gltf.binary, bytes(found.store))


class _Decoder:
    """A header that is changed in place, and the buffer of what was decoded."""

    def __init__(self, header: Json, binary: bytes, read: Callable[[str], bytes]) -> None:
        self.header = header
        self.store = bytearray()
        self._binary, self._read = binary, read
        self._buffers: dict[int, bytes] = {}

    def decode(self) -> None:
        """Decode what is there, in the order in which one form lies in another."""
        needed = {*stand_alone(self.header), *self.header.get("extensionsRequired", [])}
        for name in needed & {name for name in LIBRARIES if can_decode(name)}:
            if name in MESHOPT:
                self._decode_meshopt(name)
            elif name == DRACO:
                self._decode_draco()
            else:
                self._decode_basisu()
            self._is_read(name)
        self._dequantise()
        if self.store:
            buffer = {"uri": DECODED_URI, "byteLength": len(self.store)}
            self.header.setdefault("buffers", []).append(buffer)

    def _decode_meshopt(self, name: str) -> None:
        for view in self._list("bufferViews"):
            if name in view.get("extensions", {}):
                self._decode_view(view, view.pop("extensions")[name])
        for buffer in self._list("buffers"):
            if name in buffer.get("extensions", {}) and "uri" not in buffer:
                buffer["uri"] = DECODED_URI  # a placeholder, to which no view points any more

    def _decode_view(self, view: Json, stored: Json) -> None:
        start = stored.get("byteOffset", 0)
        data = self._buffer(stored["buffer"])[start : start + stored["byteLength"]]
        content = decode_meshopt(data, stored)
        target = {"target": view["target"]} if "target" in view else {}
        stride = {"byteStride": view["byteStride"]} if "byteStride" in view else {}
        view.clear()
        view.update({**self._stored(content), **stride, **target})

    def _decode_draco(self) -> None:
        primitives = [p for mesh in self._list("meshes") for p in mesh["primitives"]]
        from DracoPy import decode

        for primitive in (p for p in primitives if DRACO in p.get("extensions", {})):
            stored = primitive["extensions"].pop(DRACO)
            mesh = decode(self._view_bytes(stored["bufferView"]))
            values = {entry["unique_id"]: np.asarray(entry["data"]) for entry in mesh.attributes}
            for name, identity in stored["attributes"].items():
                self._fill(primitive["attributes"][name], values[identity])
            faces = np.asarray(mesh.faces, "<u4").reshape(-1, 1)
            if "indices" in primitive:
                self._fill(primitive["indices"], faces)

    def _dequantise(self) -> None:
        """Positions and texture coordinates as floats, which is how they are read."""
        for mesh in self._list("meshes"):
            for primitive in mesh["primitives"]:
                for name, index in primitive["attributes"].items():
                    accessor = self.header["accessors"][index]
                    is_scaled = name == "POSITION" and accessor.get("normalized", False)
                    is_uv = name.startswith("TEXCOORD")
                    if (is_scaled or is_uv) and accessor["componentType"] != FLOAT32:
                        if "bufferView" not in accessor or "sparse" in accessor:
                            continue  # refused for what it is
                        self._fill(index, fractions(self._values(accessor), accessor))

    def _decode_basisu(self) -> None:
        textures = [t for t in self._list("textures") if BASISU in t.get("extensions", {})]
        for texture in (t for t in textures if "source" not in t):
            image = self.header["images"][texture["extensions"].pop(BASISU)["source"]]
            if image.get("mimeType") == "image/png" and "bufferView" in image:
                texture["source"] = self.header["images"].index(image)
                continue  # decoded for another texture
            content = png_of_ktx2(self._image_bytes(image))
            self._list("bufferViews").append(self._stored(content))
            image.pop("uri", None)
            image.update(bufferView=len(self.header["bufferViews"]) - 1, mimeType="image/png")
            texture["source"] = self.header["images"].index(image)

    def _image_bytes(self, image: Json) -> bytes:
        if "bufferView" in image:
            return self._view_bytes(image["bufferView"])
        return self._uri_bytes(image["uri"])

    def _list(self, key: str) -> list[Json]:
        found: list[Json] = (
            self.header.setdefault(key, []) if key == "bufferViews" else (self.header.get(key, []))
        )
        return found

    def _is_read(self, name: str) -> None:
        """The extension is no longer needed."""
        for key in ("extensionsRequired", "extensionsUsed"):
            if name in self.header.get(key, []):
                self.header[key].remove(name)

    def _fill(self, accessor_index: int, values: Values) -> None:
        """Make an accessor that of ``values`` (N, C), with a view of its own."""
        values = np.ascontiguousarray(values)
        kind = next(code for code, name in DTYPES.items() if np.dtype(name) == values.dtype)
        self._list("bufferViews").append(self._stored(values.tobytes()))
        accessor = self.header["accessors"][accessor_index]
        for key in ("byteOffset", "normalized", "sparse", "min", "max"):
            accessor.pop(key, None)
        accessor.update(
            bufferView=len(self.header["bufferViews"]) - 1, componentType=kind, count=len(values)
        )

    def _stored(self, content: bytes) -> Json:
        """A view of ``content``, kept in the buffer of what was decoded."""
        self.store += b"\0" * (-len(self.store) % 8)
        start = len(self.store)
        self.store += content
        buffer = len(self.header.get("buffers", []))  # where it will stand
        return {"buffer": buffer, "byteOffset": start, "byteLength": len(content)}

    def _values(self, accessor: Json) -> Values:
        """Values (N, C) of an accessor as they are stored."""
        view = self.header["bufferViews"][accessor["bufferView"]]
        dtype, width = np.dtype(DTYPES[accessor["componentType"]]), WIDTHS[accessor["type"]]
        row = width * dtype.itemsize
        stride, count = view.get("byteStride", row), accessor["count"]
        data = self._view_bytes(accessor["bufferView"])[accessor.get("byteOffset", 0) :]
        if not 0 < (count - 1) * stride + row <= len(data):
            raise ValueError("an accessor reaches beyond its view")
        layout: Values = np.ndarray((count, width), dtype, data, 0, (stride, dtype.itemsize))
        return layout

    def _view_bytes(self, index: int) -> bytes:
        view = self.header["bufferViews"][index]
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


def decode_meshopt(data: bytes, stored: Json) -> bytes:
    """The plain content of a view compressed by meshoptimizer.

    ``stored`` is its extension: ``count``, ``byteStride``, ``mode`` and ``filter``.
    """
    import meshoptimizer as meshopt

    count, stride, mode = stored["count"], stored["byteStride"], stored["mode"]
    if not 0 <= count * stride <= MOST_BYTES:
        raise ValueError(f"a view of {count} x {stride} bytes")
    if mode != "ATTRIBUTES":
        decode = {
            "TRIANGLES": meshopt.decode_index_buffer,
            "INDICES": meshopt.decode_index_sequence,
        }[mode]
        index = np.asarray(decode(count, 4, data))  # of two bytes it would put two into one number
        return index.astype(f"<u{stride}").tobytes()
    content = meshopt.decode_vertex_buffer(count, stride, data, dtype=np.dtype((np.void, stride)))
    filters = {
        "OCTAHEDRAL": meshopt.decode_filter_oct,
        "QUATERNION": meshopt.decode_filter_quat,
        "EXPONENTIAL": meshopt.decode_filter_exp,
    }
    name = stored.get("filter", "NONE")
    if name != "NONE":
        content = filters[name](content, count, stride)
    return bytes(content.tobytes())


def fractions(values: Values, accessor: Json) -> NDArray[np.float32]:
    """Integers (N, C) as the numbers they stand for: fractions of their range where normalised."""
    if not accessor.get("normalized", False):
        return values.astype("<f4")
    largest = np.iinfo(values.dtype).max
    return np.maximum(values.astype(np.float64) / largest, -1.0).astype("<f4")


def png_of_ktx2(content: bytes) -> bytes:
    """A KTX2 texture of Basis Universal (ETC1S or UASTC) as PNG, its largest level."""
    import opengl_basisu

    texture = opengl_basisu.open(content)
    rgba = np.asarray(texture.transcode(opengl_basisu.Target.RGBA8).data)
    pixels = rgba if texture.has_alpha else np.ascontiguousarray(rgba[..., :3])
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, format="PNG", compress_level=1)
    return file.getvalue()
