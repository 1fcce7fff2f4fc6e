"""Materials and textures: every kind of image, alpha, and what is named when colour is lost."""

import logging

import numpy as np
import pytest
from PIL import Image

from synfeal.errors import InputError
from synfeal.mesh import materials
from synfeal.mesh.load import load_mesh
from synfeal.mesh.materials import MAX_SIDE_PX, linear_from_srgb, srgb_from_linear, to_rgb
from tests.support.mesh_samples import (
    FACE,
    TRIANGLE,
    UV,
    textured,
    triangle_gltf,
    write_gltf,
    write_obj,
)

COLORS = np.array([[1, 2, 3, 255]] * 3, np.uint8)


def plain(*color):
    """An image of one colour, grey with alpha or what else its number of channels says."""
    return Image.new({2: "LA", 3: "RGB", 4: "RGBA"}[len(color)], (2, 2), color)


@pytest.fixture
def painted(tmp_path):
    """A triangle with an image as its texture, loaded."""

    def load(image, material, change=lambda gltf: None):
        image.save(tmp_path / "paint.png")
        gltf = triangle_gltf(material, ["paint.png"])
        change(gltf)
        return load_mesh(gltf.store(tmp_path))

    return load


def test_gltf_names_missing_and_broken_textures_and_what_depends_on_them(tmp_path, caplog):
    material = textured({"normalTexture": {"index": 1}, "alphaMode": "BLEND"})
    gltf = triangle_gltf(material, ["wall.png", "bumps.png"])
    gltf.add("COLOR_0", COLORS)
    with caplog.at_level(logging.WARNING, "synfeal"):
        findings = load_mesh(gltf.store(tmp_path)).findings
    assert len(findings) == 3
    assert "texture 'wall.png' of material 'Paint' is missing" in findings[0]
    assert "not needed: 'bumps.png'" in findings[1]
    assert "drawn opaque" in findings[2]
    assert "wall.png" in caplog.text
    assert "bumps.png" not in caplog.text
    Image.effect_noise((64, 64), 50).save(tmp_path / "paint.png")
    whole = (tmp_path / "paint.png").read_bytes()
    for content, words in ((whole[: len(whole) // 2], "decoded"), (b"none", "read as an image")):
        (tmp_path / "paint.png").write_bytes(content)
        mesh = load_mesh(write_gltf(tmp_path, textured(), ["paint.png"]))
        assert mesh.parts[0].texture is None
        assert words in mesh.findings[0]
        assert words in caplog.text


@pytest.mark.parametrize(
    "name",
    [
        "-s 1 1 1 wall.png",
        "textures/wall 1.png",
        "textures/wall%201.png",
        "C:\\art\\textures\\wall 1.png",
    ],
)
def test_textures_are_found_as_exporters_write_them(tmp_path, name):
    (tmp_path / "textures").mkdir()
    for file in ("textures/wall 1.png", "wall 1.png", "wall.png"):
        plain(1, 2, 3).save(tmp_path / file)
    part = load_mesh(write_obj(tmp_path, f"map_Kd {name}\n")).parts[0]
    assert part.texture is not None
    assert part.texture[0, 0].tolist() == [1, 2, 3]


@pytest.mark.parametrize(
    ("mode", "alpha", "cutoff", "finding"),
    [
        ({"alphaMode": "MASK"}, 200, 0.5, "alpha-tested at 0.5"),
        ({"alphaMode": "MASK", "alphaCutoff": 0.75}, 200, 0.75, "alpha-tested at 0.75"),
        ({"alphaMode": "BLEND"}, 200, 0.5, "blended transparency"),
        ({"alphaMode": "BLEND"}, 255, None, None),  # without holes
        ({"alphaMode": "OPAQUE"}, 200, None, None),
        ({}, 200, None, None),
    ],
)
def test_alpha_mode_becomes_a_cutoff(painted, mode, alpha, cutoff, finding):
    mesh = painted(plain(1, 2, 3, alpha), textured(mode))
    assert mesh.parts[0].alpha_cutoff == cutoff
    assert mesh.parts[0].texture is not None
    assert mesh.parts[0].texture[0, 0].tolist() == [1, 2, 3, alpha]
    assert len(mesh.findings) == (finding is not None)
    assert finding is None or finding in mesh.findings[0]


@pytest.mark.parametrize(
    ("mtl", "channels", "cutoff"),
    [("map_Kd wall.png\nmap_d wall.png\n", 4, 0.5), ("map_Kd wall.png\n", 3, None)],
)
def test_obj_alpha_counts_where_the_mtl_says_so(tmp_path, mtl, channels, cutoff):
    plain(1, 2, 3, 200).save(tmp_path / "wall.png")
    part = load_mesh(write_obj(tmp_path, mtl)).parts[0]
    assert part.texture is not None
    assert part.texture.shape == (2, 2, channels)
    assert part.alpha_cutoff == cutoff


def test_glass_is_not_drawn(painted, tmp_path):
    material = textured({"alphaMode": "BLEND"})
    material["pbrMetallicRoughness"]["baseColorFactor"] = [1, 1, 1, 0.03]
    with pytest.raises(InputError, match="is transparent everywhere"):
        painted(plain(255, 255), material)
    plain(0, 0, 0).save(tmp_path / "wall.png")
    for opacity in ("d 0.03", "Tr 0.97"):
        with pytest.raises(InputError, match="is transparent everywhere"):
            load_mesh(write_obj(tmp_path, f"map_Kd wall.png\n{opacity}\n"))


def test_webp_and_the_diffuse_colour_of_specular_glossiness_are_shown(tmp_path):
    plain(9, 8, 7).save(tmp_path / "paint.png")
    plain(1, 1, 1).save(tmp_path / "fallback.png")
    material = textured()
    material["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 1
    glossy = {"diffuseTexture": {"index": 0}, "diffuseFactor": [1.0, 0.2140, 1.0, 1.0]}
    material["extensions"] = {"KHR_materials_pbrSpecularGlossiness": glossy}
    part = load_mesh(write_gltf(tmp_path, material, ["paint.png", "fallback.png"])).parts[0]
    assert part.texture is not None
    assert part.texture[0, 0].tolist() == [9, 8, 7]
    assert part.base_color.tolist() == [255, 127, 255, 255]
    plain(10, 200, 30).save(tmp_path / "paint.webp", lossless=True)
    gltf = triangle_gltf(textured(), ["paint.webp"])
    gltf.header["textures"] = [{"extensions": {"EXT_texture_webp": {"source": 0}}}]
    gltf.header["extensionsRequired"] = gltf.header["extensionsUsed"] = ["EXT_texture_webp"]
    part = load_mesh(gltf.store(tmp_path)).parts[0]
    assert part.texture is not None
    assert part.texture[0, 0].tolist() == [10, 200, 30]


SECOND_UV = np.array([[0.5, 0.5], [0.25, 0.5], [1.0, 0.0]], "<f4")
TURNED = {"offset": [0.5, 0.25], "scale": [2.0, 1.0], "rotation": np.pi / 2}


def test_texture_coordinates_are_transformed_chosen_and_missed(painted):
    (part,) = painted(plain(0, 0, 0), textured(extensions={"KHR_texture_transform": TURNED})).parts
    # In glTF v points down: counter-clockwise takes (u, v) to (v, -u).
    u, v = UV[:, 0] * 2.0, UV[:, 1]
    np.testing.assert_allclose(part.uv, np.stack([v + 0.5, 1.0 - (-u + 0.25)], axis=1), atol=1e-12)
    second = painted(
        plain(0, 0, 0), textured(texCoord=1), lambda gltf: gltf.add("TEXCOORD_1", SECOND_UV)
    )
    np.testing.assert_allclose(second.parts[0].uv, SECOND_UV * [1, -1] + [0, 1])

    def without(gltf):
        del gltf.primitive["attributes"]["TEXCOORD_0"]
        gltf.add("COLOR_0", COLORS)

    mesh = painted(plain(0, 0, 0), textured(), without)
    assert mesh.parts[0].texture is None
    assert "no texture coordinates" in mesh.findings[0]


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_texture_coordinates_that_are_no_numbers_become_0(painted, bad):
    uv = UV.astype("<f4")
    uv[1, 0] = bad
    mesh = painted(plain(0, 0, 0), textured(), lambda gltf: gltf.add("TEXCOORD_0", uv))
    assert mesh.parts[0].uv is not None
    np.testing.assert_allclose(mesh.parts[0].uv[1], 0.0)
    assert "1 texture coordinates that are NaN or infinite" in mesh.findings[0]


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
def test_every_image_mode_becomes_8_bit_rgb(image, expected):
    pixels = to_rgb(image)
    assert pixels.dtype == np.uint8
    assert pixels.shape == (2, 3, len(expected))
    assert (pixels == expected).all()


def test_textures_too_wide_are_made_smaller_and_large_ones_no_bombs(painted, monkeypatch):
    halves = np.zeros((4, 2 * MAX_SIDE_PX, 3), np.uint8)
    halves[:, MAX_SIDE_PX:] = 200
    mesh = painted(Image.fromarray(halves), textured())
    pixels = mesh.parts[0].texture
    assert pixels is not None
    assert pixels.shape == (2, MAX_SIDE_PX, 3)
    assert (pixels == halves[::2, ::2]).all()
    assert "from 32768 x 4 to 16384 x 2 pixels" in mesh.findings[0]
    monkeypatch.setattr(Image, "MAX_IMAGE_PIXELS", 100)  # Pillow refuses twice as many
    assert painted(Image.new("RGB", (64, 64)), textured()).parts[0].texture is not None
    assert Image.MAX_IMAGE_PIXELS == 100
    monkeypatch.setattr(materials, "MAX_PIXELS", 100)
    assert painted(Image.new("RGB", (64, 64)), textured()).parts[0].texture is None


def test_srgb_curve_at_published_points():
    # IEC 61966-2-1: linear 0.214 is display 0.5; alpha has no curve.
    assert srgb_from_linear([0, 0.2140, 1, 0.5]).tolist() == [0, 127, 255, 128]
    np.testing.assert_allclose(linear_from_srgb([0, 128, 255, 51]), [0, 0.2159, 1, 0.2], atol=1e-4)
    every = np.repeat(np.arange(256)[:, None], 4, axis=1)
    np.testing.assert_array_equal(srgb_from_linear(linear_from_srgb(every)), every)


def test_parts_of_plain_colours_are_a_scene(tmp_path):
    gltf = triangle_gltf({}, [])
    factors = ([0.008, 0.0, 0.0, 1.0], [1.0, 1.0, 1.0, 1.0])
    gltf.header["materials"] = [
        {"pbrMetallicRoughness": {"baseColorFactor": value}} for value in factors
    ]
    gltf.header["meshes"][0]["primitives"].append({**gltf.primitive, "material": 1})
    parts = load_mesh(gltf.store(tmp_path)).parts
    # 255 * (1.055 * 0.008 ** (1 / 2.4) - 0.055) = 21.96: 8-bit linear factors would give 22 or 13.
    assert [part.base_color[0] for part in parts] == [22, 255]
    assert (parts[0].faces == FACE).all()
    assert len(parts[0].vertices_m) == len(TRIANGLE)
