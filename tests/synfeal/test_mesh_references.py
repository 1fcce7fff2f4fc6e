"""A mesh reads files of its own folder only, and takes no memory for what it merely claims."""

import json
import struct
import zipfile
import zlib
from contextlib import suppress

import numpy as np
import pytest
from PIL import Image

from baselines.references.arrays import read_arrays
from baselines.training.localize import open_picture
from synfeal.dataset.images import image_size, read_image
from synfeal.dataset.posed_sequence import read_posed_sequence
from synfeal.errors import InputError
from synfeal.mesh import claims
from synfeal.mesh.load import load_mesh
from synfeal.mesh.materials import MAX_SIDE_PX
from tests.support.fuzzing import little_memory
from tests.support.mesh_samples import TRIANGLE, textured, triangle_gltf, write_gltf, write_obj

PLY_TEXTURE = (
    "ply\nformat ascii 1.0\ncomment TextureFile {}\nelement vertex 3\nproperty float x\nproperty"
    " float y\nproperty float z\nproperty float s\nproperty float t\nelement face 1\nproperty list"
    " uchar int vertex_indices\nend_header\n0 0 0 0 0\n1 0 0 1 0\n0 1 0 0 1\n3 0 1 2\n"
)


def gltf_image(folder, name):
    return write_gltf(folder, textured(), [name])


def gltf_buffer(folder, name):
    """A triangle whose coordinates are the bytes of another file."""
    gltf = triangle_gltf({}, [])
    gltf.header["buffers"][0]["uri"] = name
    return gltf.store(folder)


def obj_texture(folder, name):
    return write_obj(folder, f"Kd 0.2 0.4 0.6\nmap_Kd {name}\n")


def obj_material(folder, name):
    path = write_obj(folder)
    path.write_text(path.read_text().replace("scene.mtl", name))
    return path


def ply_texture(folder, name):
    path = folder / "scene.ply"
    path.write_text(PLY_TEXTURE.format(name))
    return path


KINDS = (gltf_image, gltf_buffer, obj_texture, obj_material, ply_texture)


@pytest.fixture
def secret(tmp_path):
    """A file that is an image, and long enough for a buffer, outside of the mesh's folder."""
    path = tmp_path / "private" / "secret.png"
    path.parent.mkdir()
    Image.new("RGB", (40, 40), (9, 99, 199)).save(path)
    (tmp_path / "mesh").mkdir()
    return path


@pytest.mark.parametrize("write", KINDS)
@pytest.mark.parametrize("way", ["up", "absolute", "percent", "windows", "link", "linked folder"])
def test_what_leads_out_of_the_folder_is_not_read(write, way, secret, tmp_path):
    folder = tmp_path / "mesh"
    name = {
        "up": "../private/secret.png",
        "absolute": str(secret),
        "percent": "%2e%2e/private/secret.png",
        "windows": "..\\private\\secret.png",
        "link": "inside.png",
        "linked folder": "textures/secret.png",
    }[way]
    (folder / "inside.png").symlink_to(secret)
    (folder / "textures").symlink_to(secret.parent)
    with pytest.raises(InputError, match="leads out of its folder and is not read") as caught:
        load_mesh(write(folder, name))
    assert str(caught.value).startswith(f"{folder}/scene.")
    assert f"'{name}'" in str(caught.value)


@pytest.mark.parametrize(
    "name", ["textures/wall.png", "./wall.png", "../mesh/wall.png", "/a/wall.png"]
)
def test_what_stays_in_the_folder_or_lies_beside_the_mesh_is_read(name, tmp_path):
    """The last is the path on an artist's disk."""
    folder = tmp_path / "mesh"
    (folder / "textures").mkdir(parents=True)
    for path in (folder / "wall.png", folder / "textures" / "wall.png"):
        Image.new("RGB", (4, 4), (9, 99, 199)).save(path)
    (part,) = load_mesh(gltf_image(folder, name)).parts
    assert part.texture[0, 0].tolist() == [9, 99, 199]


def test_a_mesh_that_is_a_link_has_its_companions_at_either_end(tmp_path):
    """Download caches consist of links, companions included."""
    store, folder = tmp_path / "store", tmp_path / "mesh"
    store.mkdir()
    folder.mkdir()
    Image.new("RGB", (4, 4), (9, 99, 199)).save(store / "wall.png")
    write_gltf(store, textured(), ["wall.png"])
    for path in list(store.iterdir()):
        (folder / path.name).symlink_to(path)
    assert load_mesh(folder / "scene.gltf").parts[0].texture is not None


def test_lists_of_tum_name_files_of_the_sequence_only(secret, tmp_path):
    folder = tmp_path / "mesh"
    (folder / "rgb.txt").write_text("0.0 ../private/secret.png\n")
    (folder / "groundtruth.txt").write_text("0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n")
    with pytest.raises(InputError, match=r"rgb\.txt: line 1 names .* leads out of the sequence's"):
        read_posed_sequence(folder)


def refused_with_little_memory(read, match):
    """The message; nothing like what is claimed was asked for."""
    with little_memory(), pytest.raises(InputError, match=match) as caught:
        read()
    return str(caught.value)


@pytest.mark.parametrize("is_positions", [True, False])
def test_values_that_are_not_stored_are_not_made_up(is_positions, tmp_path):
    """A glTF of 1 kB asked for 22 GiB."""
    gltf = triangle_gltf({}, [])
    gltf.header["accessors"].append({"componentType": 5126, "count": 2 * 10**9, "type": "VEC3"})
    if is_positions:
        gltf.primitive["attributes"]["POSITION"] = len(gltf.header["accessors"]) - 1
    path = gltf.store(tmp_path)
    refused_with_little_memory(lambda: load_mesh(path), r"scene\.gltf: claims 24\.0 GB of values")


@pytest.mark.parametrize(("key", "value"), [("count", 4), ("count", 10**12), ("byteOffset", 5)])
def test_an_accessor_beyond_its_view_is_named(key, value, tmp_path):
    gltf = triangle_gltf({}, [])
    gltf.header["accessors"][0][key] = value
    with pytest.raises(InputError, match=r"accessor 0 claims \d+ values, more than"):
        load_mesh(gltf.store(tmp_path))


def test_rows_that_overlap_are_refused(tmp_path):
    """Each byte of a view would become as many as a row has."""
    gltf = triangle_gltf({}, [])
    gltf.add("NORMAL", TRIANGLE.astype("<f4"), stride=4)
    with pytest.raises(InputError, match="accessor 2 claims 3 values"):
        load_mesh(gltf.store(tmp_path))


def test_instances_are_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(claims, "MOST_FACES", 99)
    gltf = triangle_gltf({"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}}, [])
    gltf.header["nodes"] = [{"mesh": 0}] * 100
    gltf.header["scenes"] = [{"nodes": list(range(100))}]
    with pytest.raises(InputError, match=r"scene\.gltf: draws 100 faces"):
        load_mesh(gltf.store(tmp_path))


def png_of_one_color(width, height):
    """A PNG bomb: rows of zeros."""

    def chunk(kind, data):
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    rows = zlib.compress(bytes(3 * width + 1) * 100, 9)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")
    )


@pytest.mark.parametrize("write", [gltf_image, obj_texture, ply_texture])
def test_a_texture_that_claims_too_much_is_left_out(write, tmp_path, caplog):
    (tmp_path / "wall.png").write_bytes(png_of_one_color(100_000, 100_000))
    path = write(tmp_path, "wall.png")
    with little_memory(), suppress(InputError):  # nothing else colours it
        load_mesh(path)
    assert "texture of 100000 x 100000 pixels is too large to be read" in caplog.text
    assert f"at most {MAX_SIDE_PX} pixels" in caplog.text


@pytest.mark.parametrize("read", [read_image, image_size, open_picture])
def test_an_image_that_claims_too_much_is_refused_without_a_warning(read, tmp_path):
    """Python warns of images a little smaller than those that Pillow itself refuses."""
    path = tmp_path / "frame.png"
    for side in (100_000, 12_000):
        path.write_bytes(png_of_one_color(side, side))
        line = refused_with_little_memory(lambda: read(path), r"frame\.png")
        assert "\n" not in line


def test_textures_have_to_fit_into_memory_together(tmp_path, monkeypatch):
    monkeypatch.setattr(claims.os, "sysconf", lambda name: 30)  # 900 bytes, and 16 x 16 x 4 needed
    Image.new("RGB", (16, 16)).save(tmp_path / "wall.png")
    with pytest.raises(InputError, match=r"scene\.gltf: its textures take"):
        load_mesh(gltf_image(tmp_path, "wall.png"))


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian"])
@pytest.mark.parametrize("element", ["vertex 3", "face 1"])
def test_a_ply_header_may_claim_anything(encoding, element, tmp_path):
    text = PLY_TEXTURE.format("wall.png").replace("ascii", encoding)
    path = tmp_path / "scene.ply"
    path.write_text(text.replace(element, f"{element.split()[0]} 99999999999"))
    refused_with_little_memory(lambda: load_mesh(path), r"scene\.ply")


def test_the_length_of_a_list_in_a_ply_may_be_anything(tmp_path):
    path = tmp_path / "scene.ply"
    header = PLY_TEXTURE.format("wall.png").replace("ascii", "binary_little_endian")
    header = header.replace("list uchar int", "list uint int").partition("end_header\n")[0]
    vertices = np.zeros((3, 5), "<f4").tobytes()
    path.write_bytes(f"{header}end_header\n".encode() + vertices + struct.pack("<I", 2**32 - 1))
    refused_with_little_memory(lambda: load_mesh(path), r"scene\.ply")


def test_arrays_of_a_map_hold_what_they_claim(tmp_path):
    path = tmp_path / "map.npz"
    np.savez(path, points=np.zeros((4, 3)))
    np.testing.assert_array_equal(read_arrays(path, ["points"])["points"], np.zeros((4, 3)))
    with zipfile.ZipFile(path) as package:
        content = package.read("points.npy")
    for claimed, compression in ((b"(4999999999, 3)", zipfile.ZIP_STORED), (b"(4, 3)", 8)):
        held = content.replace(b"(4, 3)", claimed).replace(b" " * len(claimed), b" " * 6, 1)
        with zipfile.ZipFile(path, "w", compression) as package:
            package.writestr("points.npy", held)
        refused_with_little_memory(lambda: read_arrays(path, ["points"]), r"map\.npz")


def test_jsons_own_claims_are_bounded_by_the_file(tmp_path):
    """The header of a GLB may say that it goes on."""
    gltf = triangle_gltf({}, [])
    path = gltf.store_glb(tmp_path)
    content = bytearray(path.read_bytes())
    struct.pack_into("<I", content, 12, 2**32 - 1)
    path.write_bytes(content)
    refused_with_little_memory(lambda: load_mesh(path), r"scene\.glb")
    assert json.loads(json.dumps(gltf.header))
