"""glTF extensions that are not read: refused by name, unless the file holds the plain form too."""

import sys

import numpy as np
import pytest
from PIL import Image

from synfeal.errors import InputError
from synfeal.mesh.load import load_mesh
from tests.mesh_samples import add_attribute, store_gltf, textured, triangle_gltf

DRACO, BASISU = "KHR_draco_mesh_compression", "KHR_texture_basisu"


@pytest.fixture(autouse=True)
def _without_decoders(monkeypatch):
    for library in ("meshoptimizer", "DracoPy", "opengl_basisu"):
        monkeypatch.setitem(sys.modules, library, None)


def load_changed(folder, change):
    Image.new("RGB", (2, 2), (1, 2, 3)).save(folder / "paint.png")
    header, binary = triangle_gltf(textured(), ["paint.png"])
    change(header)
    load_mesh(store_gltf(folder, header, binary))


def draco(header):
    header["meshes"][0]["primitives"][0]["extensions"] = {DRACO: {"bufferView": 0}}


def draco_alone(header):
    draco(header)
    del header["accessors"][0]["bufferView"]


def meshopt(header, name="EXT_meshopt_compression"):
    header["bufferViews"][0]["extensions"] = {name: {"buffer": 0}}
    header["buffers"][0]["extensions"] = {name: {"fallback": True}}


def meshopt_alone(header):
    meshopt(header)
    del header["buffers"][0]["uri"]


def meshopt_of_khronos_alone(header):
    meshopt(header, "KHR_meshopt_compression")
    del header["buffers"][0]["uri"]


def basisu(header):
    header["images"].append({"uri": "paint.ktx2", "mimeType": "image/ktx2"})
    header["textures"][0]["extensions"] = {BASISU: {"source": 1}}


def basisu_alone(header):
    basisu(header)
    del header["textures"][0]["source"]


def instancing(header):
    header["nodes"][0]["extensions"] = {"EXT_mesh_gpu_instancing": {"attributes": {}}}


def unknown(header):
    header["extensionsRequired"] = ["ACME_voxels"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (draco_alone, [DRACO, "synfeal[meshes]", "gltf-transform copy"]),
        (meshopt_alone, ["EXT_meshopt_compression", "gltf-transform dequantize"]),
        (meshopt_of_khronos_alone, ["KHR_meshopt_compression", "gltf-transform dequantize"]),
        (basisu_alone, [BASISU, "gltf-transform ktxdecompress"]),
        (instancing, ["EXT_mesh_gpu_instancing", "one node per instance"]),
        (unknown, ["ACME_voxels", "export it without"]),
    ],
)
def test_what_is_not_read_is_refused_by_name(tmp_path, change, words):
    with pytest.raises(InputError) as caught:
        load_changed(tmp_path, change)
    message = str(caught.value)
    assert all(word in message for word in [*words, "scene.gltf"]), message
    assert "\n" not in message


@pytest.mark.parametrize("change", [draco, meshopt, basisu])
def test_compressed_forms_beside_plain_ones_are_ignored(tmp_path, change):
    load_changed(tmp_path, change)


@pytest.mark.parametrize("name", [DRACO, "EXT_meshopt_compression", BASISU])
def test_a_required_extension_is_refused_even_so(tmp_path, name):
    with pytest.raises(InputError, match=name):
        load_changed(tmp_path, lambda header: header.update(extensionsRequired=[name]))


def test_harmless_required_extensions_pass(tmp_path):
    names = ["KHR_materials_unlit", "KHR_texture_transform", "KHR_mesh_quantization"]
    load_changed(tmp_path, lambda header: header.update(extensionsRequired=names))


def test_integer_positions_without_scale_are_read(tmp_path):
    Image.new("RGB", (2, 2)).save(tmp_path / "paint.png")
    header, binary = triangle_gltf(textured(), ["paint.png"])
    corners = np.array([[0, 0, 0, 0], [300, 0, 0, 0], [0, 200, 100, 0]], "<i2")
    binary = add_attribute(header, binary, "POSITION", corners)
    header["accessors"][-1]["type"] = "VEC3"
    header["bufferViews"][-1]["byteStride"] = 8
    header["nodes"] = [{"mesh": 0, "scale": [0.01, 0.01, 0.01]}]
    part = load_mesh(store_gltf(tmp_path, header, binary), "z").parts[0]
    np.testing.assert_allclose(part.vertices_m, corners[:, :3] / 100.0)


def test_sparse_accessors_are_refused(tmp_path):
    with pytest.raises(InputError, match="sparse"):
        load_changed(tmp_path, lambda header: header["accessors"][0].update(sparse={"count": 1}))
