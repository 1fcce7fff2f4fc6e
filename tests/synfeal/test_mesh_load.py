"""Loading: scene graphs, axes, units, colours of vertices, and files that cannot be used."""

import struct

import numpy as np
import pytest
import trimesh
from PIL import Image

from synfeal.errors import InputError
from synfeal.mesh.load import load_mesh
from tests.support.mesh_samples import (
    FACE,
    TRIANGLE,
    UV,
    textured,
    triangle_gltf,
    write_gltf,
    write_obj,
)

pytestmark = pytest.mark.portable


@pytest.fixture
def paint(tmp_path):
    Image.new("RGB", (2, 2), (1, 2, 3)).save(tmp_path / "paint.png")
    return ["paint.png"]


def z_up(points):
    """Coordinates of a y-up file in the world."""
    return np.stack([points[:, 0], -points[:, 2], points[:, 1]], axis=1)


def test_gltf_transforms_axes_and_units_and_glb_is_the_same(tmp_path, paint):
    path = write_gltf(tmp_path, textured(), paint)
    in_file = 2.0 * TRIANGLE + [10.0, 20.0, 30.0]  # scale, then translation
    np.testing.assert_allclose(load_mesh(path).parts[0].vertices_m, z_up(in_file))
    np.testing.assert_allclose(load_mesh(path, "z", 0.01).parts[0].vertices_m, 0.01 * in_file)
    gltf = triangle_gltf(textured(), paint)
    plain = load_mesh(gltf.store(tmp_path)).parts[0]
    packed = load_mesh(gltf.store_glb(tmp_path)).parts[0]
    np.testing.assert_array_equal(packed.vertices_m, plain.vertices_m)
    np.testing.assert_array_equal(packed.uv, plain.uv)
    np.testing.assert_array_equal(packed.texture, plain.texture)


def test_nodes_nest_make_instances_need_no_scene_and_keep_the_order_of_the_file(tmp_path, paint):
    gltf = triangle_gltf(textured(), paint)
    quarter_turn = [0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)]  # about y: x becomes -z
    gltf.header["nodes"] = [
        {"children": [1, 2], "translation": [5.0, 0.0, 0.0]},
        {"mesh": 0, "rotation": quarter_turn, "name": "turned"},
        {"mesh": 0, "scale": [3.0, 1.0, 1.0], "name": "stretched"},
    ]
    parts = load_mesh(gltf.store(tmp_path), "z").parts
    x, y, z = TRIANGLE.T
    np.testing.assert_allclose(parts[0].vertices_m, np.stack([z + 5.0, y, -x], axis=1), atol=1e-6)
    np.testing.assert_allclose(parts[1].vertices_m, TRIANGLE * [3.0, 1.0, 1.0] + [5.0, 0.0, 0.0])
    assert parts[0].texture is parts[1].texture  # decoded once
    gltf = triangle_gltf(textured(), paint)
    expected = load_mesh(gltf.store(tmp_path)).parts[0].vertices_m
    gltf.header["nodes"].append({"children": [0]})
    del gltf.header["scenes"], gltf.header["scene"]
    (part,) = load_mesh(gltf.store(tmp_path)).parts
    np.testing.assert_array_equal(part.vertices_m, expected)
    gltf = triangle_gltf(textured(), paint)
    primitive = gltf.primitive
    gltf.header["meshes"] = [
        {"name": "z", "primitives": [primitive, dict(primitive)]},
        {"name": "a", "primitives": [dict(primitive)]},
    ]
    gltf.header["nodes"] = [
        {"children": [1, 2, 3]},
        {"mesh": 1},
        {"mesh": 0},
        {"mesh": 0, "name": "n"},
    ]
    path = gltf.store(tmp_path)
    for _ in range(3):  # trimesh names the nodes of such primitives at random
        assert [part.name for part in load_mesh(path).parts] == ["z", "z", "z_1", "z_1", "a"]


@pytest.mark.parametrize("scale", [[-1.0, 1.0, 1.0], [1.0, 1.0, 1.0], [-2.0, -1.0, -3.0]])
def test_mirrored_nodes_keep_the_outside_outside(tmp_path, scale):
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    box.visual.vertex_colors = np.arange(32).reshape(8, 4).astype(np.uint8)
    scene = trimesh.Scene()
    scene.add_geometry(box, transform=np.diag([*scale, 1.0]))
    scene.export(tmp_path / "box.glb")
    (part,) = load_mesh(tmp_path / "box.glb").parts
    a, b, c = part.vertices_m[part.faces].transpose(1, 0, 2)
    volume = np.sum(np.cross(a, b) * c) / 6.0  # positive where faces point outwards
    assert volume == pytest.approx(6.0 * abs(np.prod(scale)))


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        (np.array([[0.0, 0.2140, 1.0]] * 3, "<f4"), [0, 127, 255]),
        (np.array([[0, 14025, 65535, 9]] * 3, "<u2"), [0, 127, 255]),
        (np.array([[0, 55, 255, 255]] * 3, "u1"), [0, 128, 255]),
    ],
    ids=["float", "16-bit", "8-bit"],
)
@pytest.mark.parametrize("has_material", [True, False])
def test_gltf_vertex_colours_are_linear(tmp_path, values, expected, has_material):
    # IEC 61966-2-1: linear 0.214 is display 0.5.
    gltf = triangle_gltf({}, [])
    if not has_material:
        del gltf.primitive["material"], gltf.header["materials"]
    is_integer = values.dtype.kind == "u"
    gltf.add("COLOR_0", values, normalized=is_integer)
    part = load_mesh(gltf.store(tmp_path)).parts[0]
    np.testing.assert_allclose(part.vertex_rgb, [expected] * 3, atol=1)


def test_obj_with_one_material_and_with_several(tmp_path):
    pixels = np.arange(2 * 2 * 3, dtype=np.uint8).reshape(2, 2, 3)
    Image.fromarray(pixels).save(tmp_path / "wall.png")
    part = load_mesh(write_obj(tmp_path)).parts[0]
    np.testing.assert_array_equal(part.vertices_m[part.faces[0]], TRIANGLE)  # z-up: unchanged
    assert part.uv is not None
    np.testing.assert_allclose(part.uv[part.faces[0]], UV)
    np.testing.assert_array_equal(part.texture, pixels)
    (tmp_path / "two.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n")
    (tmp_path / "two.obj").write_text(
        "mtllib two.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n"
        "usemtl red\nf 1 2 3\nusemtl blue\nf -3 -1 -2\nusemtl red\nf 1 2 4\n"
    )
    parts = load_mesh(tmp_path / "two.obj").parts
    colors = {tuple(part.base_color[:3]): len(part.faces) for part in parts}
    assert colors == {(255, 0, 0): 2, (0, 0, 255): 1}


@pytest.mark.parametrize("encoding", ["ascii", "binary"])
def test_ply_with_vertex_colours(tmp_path, encoding):
    colors = np.array([[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255]], np.uint8)
    mesh = trimesh.Trimesh(TRIANGLE, FACE, vertex_colors=colors)
    (tmp_path / "scan.ply").write_bytes(mesh.export(file_type="ply", encoding=encoding))
    part = load_mesh(tmp_path / "scan.ply").parts[0]
    np.testing.assert_array_equal(part.vertex_rgb, colors[:, :3])  # display colours, as they are
    np.testing.assert_allclose(part.vertices_m, TRIANGLE)


PLY_WITH_TEXTURE = """ply
format ascii 1.0
comment TextureFile paint.png
element vertex 3
property float x
property float y
property float z
element face 2
property list uchar int vertex_indices
property list uchar float texcoord
end_header
0 0 0
1 0 0
0 2 3
3 0 1 2 6 0 0 1 0 0.25 0.75
3 2 1 0 6 0.25 0.75 1 0 0 0
"""


def test_ply_with_texture_and_with_face_colours(tmp_path, paint):
    (tmp_path / "scan.ply").write_text(PLY_WITH_TEXTURE)
    mesh = load_mesh(tmp_path / "scan.ply")
    part = mesh.parts[0]
    assert mesh.findings == ("part 'scan.ply': 1 duplicate face removed",)
    assert part.uv is not None
    assert part.texture is not None
    np.testing.assert_allclose(part.uv[part.faces[0]], UV)
    assert part.texture[0, 0].tolist() == [1, 2, 3]
    box = trimesh.creation.box()
    box.visual.face_colors = np.arange(48).reshape(12, 4).astype(np.uint8)
    box.export(tmp_path / "box.ply")
    part = load_mesh(tmp_path / "box.ply").parts[0]
    for face, color in zip(part.faces, box.visual.face_colors, strict=True):
        assert (part.vertex_rgb[face] == color[:3]).all()


HEADER_ONLY = b'{"asset": {"version": "2.0"}, "meshes": [{"primitives": [{"attributes": {}}]}]}'


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("none.glb", None, "no such mesh file"),
        ("empty.obj", b"", "empty"),
        ("scene.fbx", b"x", "is an FBX scene"),
        ("scan.stl", b"solid\nendsolid\n", "without colour.*as GLB"),
        ("bad.glb", b"not a glb at all, but long enough to be read as a header", "not a GLB"),
        ("old.glb", b"glTF" + struct.pack("<II", 1, 24) + b"\0" * 12, "glTF 1"),
        ("bad.gltf", b"{]", "JSON is broken"),
        ("other.gltf", b'["a", "b"]', "not that of a glTF"),
        ("old.gltf", b'{"asset": {"version": "1.0"}}', r"glTF 1\.0"),
        ("odd.gltf", HEADER_ONLY, "cannot be read"),
        ("bad.ply", b"not a ply", "cannot be read"),
        ("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "faces"),
        ("nan.obj", b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "NaN or infinite"),
        ("index.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "cannot be read"),
        ("word.obj", b"v 0 0 0\nv 1 zero 0\nv 0 1 0\nf 1 2 3\n", "cannot be read"),
    ],
)
def test_unusable_files_are_one_line(tmp_path, name, content, message):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=message) as caught:
        load_mesh(path)
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("place", "key", "value"),
    [
        (("accessors", 0), "count", 30),  # beyond its buffer
        (("buffers", 0), "uri", "nowhere.bin"),
        (("accessors", 1), "count", -1),
        (("scenes", 0), "nodes", [7]),
    ],
)
def test_contradictory_gltf_is_one_line(tmp_path, place, key, value):
    gltf = triangle_gltf({}, [])
    kind, number = place
    gltf.header[kind][number][key] = value
    with pytest.raises(InputError, match=r"scene\.gltf"):
        load_mesh(gltf.store(tmp_path))


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("materials", "x", "materials of its JSON must be a list of mappings"),
        ("nodes", [None], "nodes of its JSON must be a list of mappings"),
        ("buffers", [{"uri": 3, "byteLength": 36}], "buffers/0/uri of its JSON must be text"),
        ("scenes", {"nodes": [0]}, "scenes of its JSON must be a list of mappings"),
        (
            "meshes",
            [{"primitives": [{"attributes": 3}]}],
            "meshes/0/primitives/0/attributes of its JSON must be a mapping",
        ),
        (
            "textures",
            [{"extensions": {"KHR_texture_basisu": 0}}],
            "textures/0/extensions/KHR_texture_basisu of its JSON must be a mapping",
        ),
    ],
)
def test_a_gltf_of_other_kinds_of_values_says_which(key, value, said, tmp_path):
    gltf = triangle_gltf({}, [])
    gltf.header[key] = value
    with pytest.raises(InputError, match=f"scene.gltf: .*{said}"):
        load_mesh(gltf.store(tmp_path))


def test_what_other_programs_keep_in_a_gltf_may_be_anything(tmp_path):
    gltf = triangle_gltf({}, [])
    gltf.header["extras"] = gltf.header["nodes"][0]["extras"] = 7
    gltf.header["nodes"][0]["extensions"] = {"VENDOR_lists": 3, "VENDOR_more": {"meshes": 4}}
    in_file = 2.0 * TRIANGLE + [10.0, 20.0, 30.0]  # scale, then translation
    np.testing.assert_allclose(load_mesh(gltf.store(tmp_path), "z").parts[0].vertices_m, in_file)


@pytest.mark.parametrize("broken", [MemoryError, AttributeError, NameError])
def test_faults_of_the_program_are_no_damage_of_the_file(broken, tmp_path, monkeypatch):
    def fail(*_):
        raise broken("of ours")

    monkeypatch.setattr("synfeal.mesh.load._placed", fail)
    with pytest.raises(broken, match="of ours"):
        load_mesh(triangle_gltf({}, []).store(tmp_path))


def test_an_index_beyond_the_vertices_is_one_line(tmp_path):
    gltf = triangle_gltf({}, [])
    gltf.add("indices", np.array([[0], [1], [9]], "<u4"))
    with pytest.raises(InputError, match=r"scene\.gltf"):
        load_mesh(gltf.store(tmp_path))
