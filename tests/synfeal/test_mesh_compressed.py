"""Compressed glTF is read as its plain form is, and what is not read is refused by name.

The files are made here, with the libraries that read them.
"""

import base64
import sys
import zlib

import numpy as np
import pytest
import trimesh
from PIL import Image

from synfeal.errors import InputError
from synfeal.mesh.load import load_mesh
from tests.support.mesh_samples import Gltf, textured, triangle_gltf

# 8 x 8 pixels, red on the left, green at the top, encoded by Basis Universal (ktx2-encoder 0.6),
# deflated and in base 64.
KTX2 = (
    "eNpb7R0SoWBksJuXS4qLAQgYgZgDimGAEYpBIAOIdYB4CpRGBwegtAMaDVPLxKDBsIyRiYGZmYFBAK6rHs76DwTy"
    "QBrorPKizJLUIganxOLMYoXQvMyy1KLixBwFIz1TAwYGFpAuoDbxmWGv9y/9BNcv3grkG01nhPNnOr22P5KE4Lc6"
    "vY4XWQhXDwCeLySE"
)
DRACO, BASISU = "KHR_draco_mesh_compression", "KHR_texture_basisu"
MESHOPT = "EXT_meshopt_compression"
SPHERE = trimesh.creation.icosphere(subdivisions=2, radius=2.0)
VERTICES = np.asarray(SPHERE.vertices, np.float32)
FACES = np.asarray(SPHERE.faces, np.uint32)
RGB = np.asarray(255 * np.abs(VERTICES) / 2.0, np.uint8)


def padded(values, filling=0):
    """Rows of three numbers as rows of four, which begin at whole words."""
    return np.pad(values, ((0, 0), (0, 1)), constant_values=filling)


def write_quantised(gltf):
    """Positions as normalised 16-bit integers in a node that scales, colours as bytes."""
    position = padded(np.round(VERTICES / 2.0 * 32767).astype("<i2"))
    gltf.add("POSITION", position, stride=8, type="VEC3", normalized=True)
    gltf.add("COLOR_0", padded(RGB, 255), normalized=True)
    gltf.add("indices", FACES.astype("<u2").reshape(-1, 1))
    gltf.header["nodes"][0]["scale"] = [2.0, 2.0, 2.0]
    needs(gltf, "KHR_mesh_quantization")


def needs(gltf, *names):
    gltf.header["extensionsRequired"] = gltf.header["extensionsUsed"] = [*names]


def write_meshopt(gltf):
    """As gltfpack writes: compressed views that stand for those of a buffer that is not there."""
    from meshoptimizer import encode_index_buffer, encode_vertex_buffer

    write_quantised(gltf)
    plain, count, views = gltf.binary, len(VERTICES), gltf.header["bufferViews"]
    contents = [plain[v["byteOffset"] : v["byteOffset"] + v["byteLength"]] for v in views]
    gltf.binary, gltf.header["bufferViews"] = b"", []
    position, color = (np.frombuffer(part, np.uint8).reshape(count, -1) for part in contents[:2])
    encoded = [
        (encode_vertex_buffer(position), count, 8, "ATTRIBUTES"),
        (encode_vertex_buffer(color), count, 4, "ATTRIBUTES"),
        (encode_index_buffer(FACES.ravel()), FACES.size, 2, "TRIANGLES"),
    ]
    for view, (data, n, stride, mode) in zip(views, encoded, strict=True):
        stored = {"buffer": 0, "byteOffset": len(gltf.binary), "byteLength": len(data)}
        stored |= {"count": n, "byteStride": stride, "mode": mode}
        gltf.view(data)
        gltf.header["bufferViews"][-1] = {**view, "buffer": 1, "extensions": {MESHOPT: stored}}
    fallback = {"byteLength": len(plain), "extensions": {MESHOPT: {"fallback": True}}}
    gltf.header["buffers"].append(fallback)
    needs(gltf, "KHR_mesh_quantization", MESHOPT)


def write_draco(gltf):
    import DracoPy

    data = DracoPy.encode(VERTICES, FACES, quantization_bits=20, colors=RGB, preserve_order=True)
    kinds = DracoPy.AttributeType
    identity = {e["attribute_type"]: e["unique_id"] for e in DracoPy.decode(data).attributes}
    attributes = {"POSITION": identity[kinds.POSITION], "COLOR_0": identity[kinds.COLOR]}
    gltf.primitive["attributes"] = {
        "POSITION": gltf.accessor(VERTICES),
        "COLOR_0": gltf.accessor(RGB, normalized=True),
    }
    gltf.primitive["indices"] = gltf.accessor(FACES.reshape(-1, 1))
    stored = {"bufferView": gltf.view(data), "attributes": attributes}
    gltf.primitive["extensions"] = {DRACO: stored}
    needs(gltf, DRACO)


@pytest.mark.parametrize(
    ("make", "library"),
    [(write_quantised, None), (write_meshopt, "meshoptimizer"), (write_draco, "DracoPy")],
)
def test_a_compressed_file_is_read_as_the_plain_one(make, library, tmp_path):
    if library is not None:
        pytest.importorskip(library)
    gltf = Gltf()
    make(gltf)
    (part,) = load_mesh(gltf.store_glb(tmp_path), "z").parts
    assert len(part.faces) == len(FACES)
    assert np.abs(np.linalg.norm(part.vertices_m, axis=1) - 2.0).max() < 2e-4
    volume = trimesh.Trimesh(part.vertices_m, part.faces, process=False).volume
    assert volume == pytest.approx(SPHERE.volume, rel=1e-3)  # and all faces look outwards
    assert part.vertex_rgb is not None
    order = np.lexsort(np.round(part.vertices_m, 2).T)
    expected = np.lexsort(np.round(VERTICES, 2).T)
    np.testing.assert_allclose(part.vertices_m[order], VERTICES[expected], atol=2e-4)


def test_ktx2_textures_are_read(tmp_path):
    pytest.importorskip("opengl_basisu")
    content = zlib.decompress(base64.b64decode(KTX2))
    (tmp_path / "paint.ktx2").write_bytes(content)
    gltf = triangle_gltf(textured(), ["paint.ktx2"])
    gltf.header["textures"] = [{"extensions": {"KHR_texture_basisu": {"source": 0}}}]
    gltf.header["extensionsRequired"] = ["KHR_texture_basisu"]
    (part,) = load_mesh(gltf.store(tmp_path)).parts
    assert part.texture is not None
    assert part.texture.shape == (8, 8, 3)
    corners = part.texture[[0, 0, 7, 7], [0, 7, 0, 7]].astype(int)
    expected = [[200, 180, 90], [40, 180, 90], [200, 20, 90], [40, 20, 90]]
    np.testing.assert_allclose(corners, expected, atol=1)


@pytest.fixture
def without_decoders(monkeypatch):
    for library in ("meshoptimizer", "DracoPy", "opengl_basisu"):
        monkeypatch.setitem(sys.modules, library, None)


def load_changed(folder, change, alone):
    Image.new("RGB", (2, 2), (1, 2, 3)).save(folder / "paint.png")
    gltf = triangle_gltf(textured(), ["paint.png"])
    change(gltf, alone)
    load_mesh(gltf.store(folder))


# By what a file has of an extension: beside the plain form, or alone.
def draco(gltf, alone):
    gltf.primitive["extensions"] = {DRACO: {"bufferView": 0}}
    if alone:
        del gltf.header["accessors"][0]["bufferView"]


def meshopt(gltf, alone, name=MESHOPT):
    gltf.header["bufferViews"][0]["extensions"] = {name: {"buffer": 0}}
    gltf.header["buffers"][0]["extensions"] = {name: {"fallback": True}}
    if alone:
        del gltf.header["buffers"][0]["uri"]


def meshopt_of_khronos(gltf, alone):
    meshopt(gltf, alone, "KHR_meshopt_compression")


def basisu(gltf, alone):
    gltf.header["images"].append({"uri": "paint.ktx2", "mimeType": "image/ktx2"})
    gltf.header["textures"][0]["extensions"] = {BASISU: {"source": 1}}
    if alone:
        del gltf.header["textures"][0]["source"]


def instancing(gltf, _):
    gltf.header["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {}}}


def sparse(gltf, _):
    gltf.header["accessors"][0]["sparse"] = {"count": 1}


def requires(*names):
    return lambda gltf, _: gltf.header.update(extensionsRequired=names)


@pytest.mark.usefixtures("without_decoders")
@pytest.mark.parametrize(
    ("change", "words"),
    [
        (draco, [DRACO, "synfeal[meshes]", "gltf-transform copy"]),
        (meshopt, [MESHOPT, "gltf-transform dequantize"]),
        (meshopt_of_khronos, ["KHR_meshopt_compression", "gltf-transform dequantize"]),
        (basisu, [BASISU, "gltf-transform ktxdecompress"]),
        (instancing, ["EXT_mesh_gpu_instancing", "one node per instance"]),
        (requires("ACME_voxels"), ["ACME_voxels", "export it without"]),
        *((requires(name), [name]) for name in (DRACO, MESHOPT, BASISU)),  # even beside the plain
        (sparse, ["sparse"]),
    ],
)
def test_what_is_not_read_is_refused_by_name(tmp_path, change, words):
    with pytest.raises(InputError) as caught:
        load_changed(tmp_path, change, alone=True)
    message = str(caught.value)
    assert all(word in message for word in [*words, "scene.gltf"]), message
    assert "\n" not in message


HARMLESS = requires("KHR_materials_unlit", "KHR_texture_transform", "KHR_mesh_quantization")


@pytest.mark.usefixtures("without_decoders")
@pytest.mark.parametrize("change", [draco, meshopt, basisu, HARMLESS])
def test_compressed_forms_beside_plain_ones_and_harmless_extensions_pass(tmp_path, change):
    load_changed(tmp_path, change, alone=False)
