"""Compressed glTF is read as its plain form is: the files are made here with the same libraries."""

from __future__ import annotations

import base64
import sys
import zlib

import numpy as np
import pytest
import trimesh

from synfeal.errors import InputError
from synfeal.mesh.load import load_mesh
from tests.mesh_samples import Json, store_glb, store_gltf, textured, triangle_gltf

# 8 x 8 pixels, red on the left, green at the top, encoded by Basis Universal (ktx2-encoder 0.6),
# deflated and in base 64.
KTX2 = {
    "UASTC": (
        "eNpb7R0SoWBksJuXS4qLAQgYgZgDimGAEYpBIAOIdYB4CpRGBwegtAMaDVPLxKDBsIyRiYGZmYFBAK6rHs76DwTy"
        "QBrorPKizJLUIganxOLMYoXQvMyy1KLixBwFIz1TAwYGFpAuoDbxmWGv9y/9BNcv3grkG01nhPNnOr22P5KE4Lc6"
        "vY4XWQhXDwCeLySE"
    ),
    "ETC1S": (
        "eNpb7R0SoWBksJuXS4qLAQgYgZgDimGAEQlnALEOEE8BYhUg3gFVMxlKezNCaCYGVKDDABPXYFjMyMTAzIxshz2c"
        "9R8I5EHmhESUF2WWpBYxOCUWZxYrhOZllqUWFSfmKBjpmRowMLAwMDMYAdXxIpnNwIBpt/iBIw0gWsBNv8esYQfQ"
        "ZoYGhZctBZsYZ0Csd2BxYFgEdopDEsP87coMIaGhoaxA7opVq1YxMRx0gZjzKb6XYQbEbw5OnAKKDiCW0DoOBjWI"
        "vIADgwM3AKmDK+c="
    ),
}
SPHERE = trimesh.creation.icosphere(subdivisions=2, radius=2.0)
VERTICES = np.asarray(SPHERE.vertices, np.float32)
FACES = np.asarray(SPHERE.faces, np.uint32)
UV = np.asarray((VERTICES[:, :2] + 2.0) / 4.0, np.float32)
RGB = np.asarray(255 * np.abs(VERTICES) / 2.0, np.uint8)


class Maker:
    """A glTF put together view by view."""

    def __init__(self):
        self.binary = b""
        self.header: Json = {
            "asset": {"version": "2.0"},
            "scenes": [{"nodes": [0]}],
            "scene": 0,
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {}}]}],
            "buffers": [{"byteLength": 0}],
            "bufferViews": [],
            "accessors": [],
        }

    @property
    def primitive(self):
        return self.header["meshes"][0]["primitives"][0]

    def view(self, content, **more):
        place = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(content)}
        self.header["bufferViews"].append({**place, **more})
        self.binary += content + b"\0" * (-len(content) % 4)
        self.header["buffers"][0]["byteLength"] = len(self.binary)
        return len(self.header["bufferViews"]) - 1

    def accessor(self, kind, count, shape, **more):
        entry = {"componentType": kind, "count": count, "type": shape, **more}
        self.header["accessors"].append(entry)
        return len(self.header["accessors"]) - 1

    def needs(self, *names):
        self.header["extensionsRequired"] = self.header["extensionsUsed"] = [*names]

    def save(self, folder):
        return store_glb(folder, self.header, self.binary)


def quantised(maker):
    """Positions as normalised 16-bit integers in a node that scales, colours as bytes."""
    position = np.round(VERTICES / 2.0 * 32767).astype("<i2")
    padded = np.pad(position, ((0, 0), (0, 1)))
    position_view = maker.view(padded.tobytes(), byteStride=8)
    colour_view = maker.view(np.pad(RGB, ((0, 0), (0, 1)), constant_values=255).tobytes())
    index_view = maker.view(FACES.astype("<u2").tobytes())
    n = len(VERTICES)
    maker.primitive["attributes"] = {
        "POSITION": maker.accessor(5122, n, "VEC3", normalized=True, bufferView=position_view),
        "COLOR_0": maker.accessor(5121, n, "VEC4", normalized=True, bufferView=colour_view),
    }
    maker.primitive["indices"] = maker.accessor(5123, FACES.size, "SCALAR", bufferView=index_view)
    maker.header["nodes"][0]["scale"] = [2.0, 2.0, 2.0]
    maker.needs("KHR_mesh_quantization")


def meshopt(maker):
    """As gltfpack writes: compressed views that stand for those of a buffer that is not there."""
    from meshoptimizer import encode_index_buffer, encode_vertex_buffer

    quantised(maker)
    name, plain, count = "EXT_meshopt_compression", maker.binary, len(VERTICES)
    views, maker.binary = maker.header["bufferViews"], b""
    contents = [plain[v["byteOffset"] : v["byteOffset"] + v["byteLength"]] for v in views]
    position = np.frombuffer(contents[0], np.uint8).reshape(count, 8)
    colour = np.frombuffer(contents[1], np.uint8).reshape(count, 4)
    encoded = [
        (encode_vertex_buffer(position), count, 8, "ATTRIBUTES"),
        (encode_vertex_buffer(colour), count, 4, "ATTRIBUTES"),
        (encode_index_buffer(FACES.ravel()), FACES.size, 2, "TRIANGLES"),
    ]
    maker.header["bufferViews"] = []
    for view, (data, n, stride, mode) in zip(views, encoded, strict=True):
        start = len(maker.binary)
        maker.view(data)
        stored = {"buffer": 0, "byteOffset": start, "byteLength": len(data)}
        stored |= {"count": n, "byteStride": stride, "mode": mode}
        maker.header["bufferViews"][-1] = {**view, "buffer": 1, "extensions": {name: stored}}
    fallback = {"byteLength": len(plain), "extensions": {name: {"fallback": True}}}
    maker.header["buffers"].append(fallback)
    maker.needs("KHR_mesh_quantization", name)


def draco(maker):
    import DracoPy

    data = DracoPy.encode(VERTICES, FACES, quantization_bits=20, colors=RGB, preserve_order=True)
    kinds = DracoPy.AttributeType
    identity = {e["attribute_type"]: e["unique_id"] for e in DracoPy.decode(data).attributes}
    position, colour = identity[kinds.POSITION], identity[kinds.COLOR]
    view, n = maker.view(data), len(VERTICES)
    maker.primitive["attributes"] = {
        "POSITION": maker.accessor(5126, n, "VEC3"),
        "COLOR_0": maker.accessor(5121, n, "VEC3", normalized=True),
    }
    maker.primitive["indices"] = maker.accessor(5125, FACES.size, "SCALAR")
    attributes = {"POSITION": position, "COLOR_0": colour}
    maker.primitive["extensions"] = {
        "KHR_draco_mesh_compression": {"bufferView": view, "attributes": attributes}
    }
    maker.needs("KHR_draco_mesh_compression")


@pytest.mark.parametrize(
    ("make", "library"), [(quantised, None), (meshopt, "meshoptimizer"), (draco, "DracoPy")]
)
def test_a_compressed_file_is_read_as_the_plain_one(make, library, tmp_path):
    if library is not None:
        pytest.importorskip(library)
    maker = Maker()
    make(maker)
    (part,) = load_mesh(maker.save(tmp_path), "z").parts
    assert len(part.faces) == len(FACES)
    assert np.abs(np.linalg.norm(part.vertices_m, axis=1) - 2.0).max() < 2e-4
    volume = trimesh.Trimesh(part.vertices_m, part.faces, process=False).volume
    assert volume == pytest.approx(SPHERE.volume, rel=1e-3)  # and all faces look outwards
    assert part.vertex_rgb is not None
    order = np.lexsort(np.round(part.vertices_m, 2).T)
    expected = np.lexsort(np.round(VERTICES, 2).T)
    np.testing.assert_allclose(part.vertices_m[order], VERTICES[expected], atol=2e-4)


@pytest.mark.parametrize(("make", "library"), [(meshopt, "meshoptimizer"), (draco, "DracoPy")])
def test_without_its_library_a_file_is_refused_with_advice(make, library, tmp_path, monkeypatch):
    pytest.importorskip(library)
    maker = Maker()
    make(maker)
    path = maker.save(tmp_path)
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(InputError, match=r"synfeal\[meshes\].*gltf-transform") as caught:
        load_mesh(path)
    assert "\n" not in str(caught.value)


def test_what_is_damaged_is_named(tmp_path):
    pytest.importorskip("meshoptimizer")
    maker = Maker()
    meshopt(maker)
    maker.binary = maker.binary[:40] + b"\xff" * (len(maker.binary) - 40)
    path = maker.save(tmp_path)
    with pytest.raises(InputError, match=r"scene\.glb: cannot be read as a mesh"):
        load_mesh(path)


@pytest.mark.parametrize(("codec", "levels"), [("UASTC", 1), ("ETC1S", 8)])
def test_ktx2_textures_are_read(codec, levels, tmp_path):
    pytest.importorskip("opengl_basisu")
    content = zlib.decompress(base64.b64decode(KTX2[codec]))
    (tmp_path / "paint.ktx2").write_bytes(content)
    header, binary = triangle_gltf(textured(), ["paint.ktx2"])
    header["textures"] = [{"extensions": {"KHR_texture_basisu": {"source": 0}}}]
    header["extensionsRequired"] = ["KHR_texture_basisu"]
    (part,) = load_mesh(store_gltf(tmp_path, header, binary)).parts
    assert part.texture is not None
    assert part.texture.shape == (8, 8, 3)
    corners = part.texture[[0, 0, 7, 7], [0, 7, 0, 7]].astype(int)
    expected = [[200, 180, 90], [40, 180, 90], [200, 20, 90], [40, 20, 90]]
    np.testing.assert_allclose(corners, expected, atol=levels)
