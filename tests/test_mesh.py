"""Meshes: loading and saving, materials, checks, ray queries, decimation."""

from __future__ import annotations

import json
import logging
import os
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from synfeal.errors import InputError
from synfeal.mesh.checks import check_sampling_box
from synfeal.mesh.decimate import (
    collision_mesh,
    load_collision_mesh,
    merge_vertices,
    save_collision_mesh,
)
from synfeal.mesh.load import load_mesh
from synfeal.mesh.materials import linear_from_srgb, srgb_from_linear, to_rgb
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.properties import mesh_properties
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.save import save_glb

TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 3]])
FACE = np.array([[0, 1, 2]])
UV = np.array([[0.0, 0.0], [1.0, 0.0], [0.25, 0.75]])


def part_of(mesh: trimesh.Trimesh, **values: object) -> MeshPart:
    return MeshPart("part", np.asarray(mesh.vertices), np.asarray(mesh.faces), **values)  # type: ignore[arg-type]


def box_mesh(extents: tuple[float, float, float] = (2.0, 3.0, 4.0)) -> TexturedMesh:
    box = trimesh.creation.box(extents)
    return TexturedMesh((part_of(box, vertex_rgb=np.full((8, 3), 99, np.uint8)),))


def write_gltf(folder: Path, material: dict[str, object], images: list[str]) -> Path:
    """A one-triangle glTF written by hand, so that the reader is not tested with its own writer."""
    vertices, uv = TRIANGLE.astype("<f4").tobytes(), UV.astype("<f4").tobytes()
    (folder / "data.bin").write_bytes(vertices + uv)
    header = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": [10.0, 20.0, 30.0], "scale": [2.0, 2.0, 2.0]}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}
        ],
        "materials": [{"name": "Paint", **material}],
        "textures": [{"source": index} for index in range(len(images))],
        "images": [{"uri": uri} for uri in images],
        "buffers": [{"uri": "data.bin", "byteLength": 60}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 24},
        ],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 3,
                "type": "VEC3",
                "min": [0, 0, 0],
                "max": [1, 2, 3],
            },
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
        ],
    }
    path = folder / "scene.gltf"
    path.write_text(json.dumps(header))
    return path


def test_glb_round_trip_keeps_geometry_texture_and_order(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    parts = (
        MeshPart("z", TRIANGLE, FACE, UV, rng.integers(0, 256, (5, 7, 3), np.uint8)),
        MeshPart(
            "leaf",
            TRIANGLE + 1,
            FACE,
            UV,
            rng.integers(0, 256, (4, 3, 4), np.uint8),
            base_color=np.array([200, 100, 50, 255], np.uint8),
            alpha_cutoff=0.25,
        ),
        MeshPart("a", TRIANGLE - 1, FACE, vertex_rgb=rng.integers(0, 256, (3, 3), np.uint8)),
        MeshPart("plain", TRIANGLE, FACE, base_color=np.array([10, 128, 250, 255], np.uint8)),
    )
    save_glb(tmp_path / "mesh.glb", TexturedMesh(parts))
    loaded = load_mesh(tmp_path / "mesh.glb")
    assert [part.name for part in loaded.parts[:2]] == ["z", "leaf"]
    for part, back in zip(parts, loaded.parts, strict=True):
        np.testing.assert_allclose(back.vertices_m, part.vertices_m, rtol=1e-6)
        np.testing.assert_array_equal(back.faces, part.faces)
        assert back.alpha_cutoff == part.alpha_cutoff
        np.testing.assert_allclose(back.base_color.astype(int), part.base_color, atol=3)
        for name in ("uv", "texture", "vertex_rgb"):
            np.testing.assert_equal(getattr(back, name), getattr(part, name))


def test_glb_is_stored_y_up_as_the_format_demands(tmp_path: Path) -> None:
    save_glb(tmp_path / "mesh.glb", box_mesh((1.0, 2.0, 9.0)))
    raw = trimesh.load_scene(tmp_path / "mesh.glb")
    np.testing.assert_allclose(raw.extents, [1.0, 9.0, 2.0])


def test_save_glb_refuses_other_formats(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.glb"):
        save_glb(tmp_path / "mesh.obj", box_mesh())


def test_gltf_node_transform_axes_and_units(tmp_path: Path) -> None:
    path = write_gltf(tmp_path, {}, [])
    (factor,) = ({"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1]}},)
    with pytest.raises(InputError, match="neither a texture nor"):
        load_mesh(path)
    Image.new("RGB", (2, 2)).save(tmp_path / "paint.png")
    factor["pbrMetallicRoughness"]["baseColorTexture"] = {"index": 0}
    path = write_gltf(tmp_path, factor, ["paint.png"])
    in_file = 2.0 * TRIANGLE + [10.0, 20.0, 30.0]  # scale, then translation
    y_up = np.stack([in_file[:, 0], -in_file[:, 2], in_file[:, 1]], axis=1)
    np.testing.assert_allclose(load_mesh(path).parts[0].vertices_m, y_up)
    np.testing.assert_allclose(load_mesh(path, "z", 0.01).parts[0].vertices_m, 0.01 * in_file)


def test_gltf_names_a_missing_base_colour_texture_only(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    Image.new("RGB", (2, 2)).save(tmp_path / "unused.png")
    material = {
        "normalTexture": {"index": 1},
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0},
            "baseColorFactor": [0.5, 0.0, 1.0, 1.0],
        },
    }
    path = write_gltf(tmp_path, material, ["wall.png", "bumps.png"])
    with caplog.at_level(logging.WARNING, "synfeal"), pytest.raises(InputError, match="colour"):
        load_mesh(path)
    text = "\n".join(record.getMessage() for record in caplog.records)
    assert "wall.png" in text
    assert "Paint" in text
    assert "bumps.png" not in text


def test_broken_texture_is_a_warning(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    Image.effect_noise((64, 64), 50).save(tmp_path / "paint.png")
    whole = (tmp_path / "paint.png").read_bytes()
    (tmp_path / "paint.png").write_bytes(whole[: len(whole) // 2])
    path = write_gltf(
        tmp_path, {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}, ["paint.png"]
    )
    with pytest.raises(InputError, match="one colour"):
        load_mesh(path)
    assert "Paint" in caplog.text
    assert "cannot be decoded" in caplog.text


@pytest.mark.parametrize(("mode", "cutoff"), [("MASK", 0.5), ("BLEND", 0.5), ("OPAQUE", None)])
def test_alpha_mode_becomes_a_cutoff(tmp_path: Path, mode: str, cutoff: float | None) -> None:
    Image.new("RGBA", (2, 2), (1, 2, 3, 200)).save(tmp_path / "paint.png")
    material = {
        "alphaMode": mode,
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
    }
    part = load_mesh(write_gltf(tmp_path, material, ["paint.png"])).parts[0]
    assert part.alpha_cutoff == cutoff
    assert part.texture is not None
    assert part.texture[0, 0].tolist() == [1, 2, 3, 200]


def test_what_is_never_visible_is_dropped(tmp_path: Path) -> None:
    Image.new("LA", (2, 2), (255, 255)).save(tmp_path / "paint.png")
    material = {
        "alphaMode": "BLEND",
        "pbrMetallicRoughness": {
            "baseColorTexture": {"index": 0},
            "baseColorFactor": [1, 1, 1, 0.03],
        },
    }
    with pytest.raises(InputError, match="no faces"):
        load_mesh(write_gltf(tmp_path, material, ["paint.png"]))


def test_obj_with_material_and_texture(tmp_path: Path) -> None:
    pixels = np.arange(2 * 2 * 3, dtype=np.uint8).reshape(2, 2, 3)
    Image.fromarray(pixels).save(tmp_path / "wall.png")
    write_obj(tmp_path)
    part = load_mesh(tmp_path / "scene.obj").parts[0]
    np.testing.assert_array_equal(part.vertices_m[part.faces[0]], TRIANGLE)  # z-up: unchanged
    assert part.uv is not None
    np.testing.assert_allclose(part.uv[part.faces[0]], UV)
    np.testing.assert_array_equal(part.texture, pixels)


def test_obj_with_missing_texture_names_the_file(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    write_obj(tmp_path)
    with pytest.raises(InputError, match="one colour"):
        load_mesh(tmp_path / "scene.obj")
    assert "wall.png" in caplog.text


def write_obj(folder: Path) -> None:
    (folder / "scene.mtl").write_text("newmtl wall\nKd 0.2 0.4 0.6\nmap_Kd wall.png\n")
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in TRIANGLE)
    uv = "".join(f"vt {u} {v}\n" for u, v in UV)
    faces = "usemtl wall\nf 1/1 2/2 3/3\n"
    (folder / "scene.obj").write_text("mtllib scene.mtl\n" + vertices + uv + faces)


def test_ply_with_vertex_colours(tmp_path: Path) -> None:
    colors = np.array([[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255]], np.uint8)
    trimesh.Trimesh(TRIANGLE, FACE, vertex_colors=colors).export(tmp_path / "scan.ply")
    part = load_mesh(tmp_path / "scan.ply").parts[0]
    np.testing.assert_array_equal(part.vertex_rgb, colors[:, :3])
    np.testing.assert_allclose(part.vertices_m, TRIANGLE)


@pytest.mark.parametrize(
    ("image", "expected"),
    [
        (Image.new("L", (3, 2), 7), [7, 7, 7]),
        (Image.new("LA", (3, 2), (7, 9)), [7, 7, 7, 9]),
        (Image.new("1", (3, 2), 1), [255, 255, 255]),
        (Image.new("RGBA", (3, 2), (1, 2, 3, 4)), [1, 2, 3, 4]),
        (Image.new("RGB", (3, 2), (1, 2, 3)).quantize(4), [1, 2, 3]),
        (Image.new("CMYK", (3, 2), (0, 0, 0, 0)), [255, 255, 255]),
        (Image.new("F", (3, 2), 0.2), [51, 51, 51]),
        (Image.fromarray(np.full((2, 3), 257 * 30, np.uint16)), [30, 30, 30]),
    ],
    ids=lambda value: getattr(value, "mode", ""),
)
def test_every_image_mode_becomes_8_bit_rgb(image: Image.Image, expected: list[int]) -> None:
    pixels = to_rgb(image)
    assert pixels.dtype == np.uint8
    assert pixels.shape == (2, 3, len(expected))
    assert (pixels == expected).all()


def test_srgb_curve_at_published_points() -> None:
    # IEC 61966-2-1: linear 0.214 is display 0.5; alpha has no curve.
    assert srgb_from_linear([0, 55, 255, 128]).tolist() == [0, 128, 255, 128]
    np.testing.assert_allclose(linear_from_srgb([0, 128, 255, 51]), [0, 0.2159, 1, 0.2], atol=1e-4)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("none.glb", None, "no such mesh file"),
        ("empty.obj", b"", "empty"),
        ("scene.fbx", b"x", "unknown kind"),
        ("bad.glb", b"not a glb at all, but long enough to be read as a header", "cannot be read"),
        ("bad.gltf", b"{]", "cannot be read"),
        ("bad.ply", b"not a ply", "cannot be read"),
        ("points.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "faces"),
        ("nan.obj", b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "NaN or infinite"),
        ("plain.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "neither a texture nor"),
    ],
)
def test_unusable_files_are_one_line(
    tmp_path: Path, name: str, content: bytes | None, message: str
) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=message) as caught:
        load_mesh(path)
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)


def test_stl_has_no_colours(tmp_path: Path) -> None:
    trimesh.creation.box().export(tmp_path / "part.stl")
    with pytest.raises(InputError, match="neither a texture nor vertex colours"):
        load_mesh(tmp_path / "part.stl")


def test_truncated_binary_is_one_line(tmp_path: Path) -> None:
    save_glb(tmp_path / "whole.glb", box_mesh())
    content = (tmp_path / "whole.glb").read_bytes()
    (tmp_path / "cut.glb").write_bytes(content[: len(content) * 2 // 3])
    with pytest.raises(InputError, match=r"cut\.glb"):
        load_mesh(tmp_path / "cut.glb")


@pytest.mark.parametrize(
    ("scale", "shift", "message"),
    [(1.0, 0.0, None), (1000.0, 0.0, "1000 times"), (1.0, 50.0, "outside"), (0.001, 2, "outside")],
)
def test_sampling_box_must_fit_the_mesh(scale: float, shift: float, message: str | None) -> None:
    bounds = np.array([[-1.0, -1, -1], [1, 1, 1]]) * scale + shift
    box = np.array([[-1.0, -1, -1], [1, 1, 1]])
    if message is None:
        check_sampling_box(box, bounds, "scenes.room")
        return
    with pytest.raises(InputError, match=message) as caught:
        check_sampling_box(box, bounds, "scenes.room")
    assert "unit_m" in str(caught.value)


def test_properties_of_a_box() -> None:
    properties = mesh_properties(box_mesh((2.0, 3.0, 4.0)))
    assert (properties["vertices"], properties["faces"]) == (8, 12)
    assert properties["volume_m3"] == pytest.approx(24.0)
    assert properties["extents_m"] == pytest.approx([2.0, 3.0, 4.0])


def test_merged_parts_keep_their_triangles() -> None:
    mesh = TexturedMesh((MeshPart("a", TRIANGLE, FACE), MeshPart("b", TRIANGLE + 5, FACE)))
    vertices, faces = mesh.merged()
    np.testing.assert_array_equal(vertices[faces[1]], TRIANGLE + 5)


def moller_trumbore(
    origin: NDArray[np.float64], direction: NDArray[np.float64], triangles: NDArray[np.float64]
) -> float:
    """First hit by the textbook formula in float64: the readable twin of the ray caster."""
    edge1, edge2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    p = np.cross(direction, edge2)
    determinant = np.sum(edge1 * p, axis=1)
    offset = origin - triangles[:, 0]
    u = np.sum(offset * p, axis=1) / determinant
    q = np.cross(offset, edge1)
    v = q @ direction / determinant
    t = np.sum(edge2 * q, axis=1) / determinant
    hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    return float(t[hit].min()) if hit.any() else np.inf


@pytest.mark.parametrize("offset", [0.0, 500_000.0])
def test_rays_agree_with_the_textbook_formula(offset: float) -> None:
    rng = np.random.default_rng(3)
    triangles = rng.uniform(-2, 2, (60, 3, 3))
    origins, directions = rng.uniform(-2, 2, (200, 3)), rng.normal(size=(200, 3))
    unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    expected = [moller_trumbore(o, d, triangles) for o, d in zip(origins, unit, strict=True)]
    caster = RayCaster(triangles.reshape(-1, 3) + offset, np.arange(180).reshape(-1, 3))
    found = caster.first_hit_m(origins + offset, directions)
    assert np.isinf(expected).any()
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-5)


def test_distance_does_not_depend_on_the_length_of_the_direction() -> None:
    caster = RayCaster(*box_mesh((2.0, 2.0, 2.0)).merged())
    found = caster.first_hit_m(np.zeros((2, 3)), [[7.0, 0.1, 0.2], [0.007, 0.0001, 0.0002]])
    assert found[0] == pytest.approx(np.linalg.norm([1.0, 0.1 / 7, 0.2 / 7]), rel=1e-6)
    assert found[1] == pytest.approx(found[0], rel=1e-5)


def test_sees_stops_at_a_wall_but_not_before_it() -> None:
    caster = RayCaster(*box_mesh((2.0, 2.0, 2.0)).merged())
    origins = np.tile([0.0, 0.1, 0.2], (2, 1))
    assert caster.sees(origins, [[0.99, 0.1, 0.2], [1.01, 0.1, 0.2]]).tolist() == [True, False]


def test_collision_mesh_keeps_what_blocks_a_line() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=5, radius=2.0)  # 20,480 faces
    mesh = TexturedMesh((part_of(sphere),))
    vertices, faces = collision_mesh(mesh, 2000)
    assert 500 < len(faces) <= 16_000
    directions = np.random.default_rng(0).normal(size=(500, 3))
    hits = RayCaster(vertices, faces).first_hit_m(np.zeros((500, 3)), directions)
    np.testing.assert_allclose(hits, 2.0, atol=0.02)


def test_collision_mesh_does_not_lose_a_thin_bar() -> None:
    wall = trimesh.creation.box((4.0, 0.01, 4.0)).subdivide().subdivide().subdivide().subdivide()
    room = trimesh.creation.box((6.0, 6.0, 6.0))
    mesh = TexturedMesh((part_of(wall), part_of(room)))
    vertices, faces = collision_mesh(mesh, 100)
    caster = RayCaster(vertices, faces)
    through = np.random.default_rng(1).uniform(-1.9, 1.9, (200, 3)) * [1, 0, 1] - [0, 1, 0]
    beyond = through + np.array([0, 2, 0])
    assert not caster.sees(through, beyond).any()


def test_small_meshes_are_not_decimated() -> None:
    mesh = box_mesh()
    assert len(collision_mesh(mesh, 20_000)[1]) == mesh.n_faces


def test_seam_copies_are_merged() -> None:
    box = trimesh.creation.box()
    soup, faces = box.vertices[box.faces].reshape(-1, 3), np.arange(36).reshape(-1, 3)
    vertices, merged = merge_vertices(soup, faces)
    assert len(vertices) == 8
    np.testing.assert_allclose(vertices[merged], soup[faces], atol=1e-5)


def test_collision_mesh_file(tmp_path: Path) -> None:
    vertices, faces = box_mesh().merged()
    save_collision_mesh(tmp_path / "collision.ply", vertices, faces)
    back_vertices, back_faces = load_collision_mesh(tmp_path / "collision.ply")
    np.testing.assert_allclose(back_vertices, vertices)
    np.testing.assert_array_equal(back_faces, faces)
    with pytest.raises(InputError, match="collision mesh"):
        load_collision_mesh(tmp_path / "none.ply")


def test_vertex_colours_and_material_from_another_writer(tmp_path: Path) -> None:
    material = PBRMaterial(baseColorTexture=Image.new("P", (4, 4), 3), name="palette")
    visual = TextureVisuals(uv=UV, material=material)
    trimesh.Trimesh(TRIANGLE, FACE, visual=visual, process=False).export(tmp_path / "mesh.glb")
    part = load_mesh(tmp_path / "mesh.glb").parts[0]
    assert part.texture is not None
    assert part.texture.shape[2] in (3, 4)


@pytest.mark.skipif("SYNFEAL_TEST_MESHES" not in os.environ, reason="no downloaded meshes")
def test_a_downloaded_scene_loads_upright(caplog: pytest.LogCaptureFixture) -> None:
    path = Path(os.environ["SYNFEAL_TEST_MESHES"]) / "botanists-greenhouse" / "scene.gltf"
    mesh = load_mesh(path)
    assert "M_Glass_01_baseColor.png" in caplog.text
    assert mesh.n_faces > 7000
    room = next(part for part in mesh.parts if "Room" in part.name)
    leaves = next(part for part in mesh.parts if "Plants" in part.name)
    assert leaves.alpha_cutoff == pytest.approx(0.9077, abs=1e-4)
    assert room.vertices_m[:, 2].max() == mesh.bounds_m[1, 2]  # the roof is on top
