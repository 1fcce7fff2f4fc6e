"""All that glTF 2.0 allows: honoured by every renderer and in what is saved, or named."""

import numpy as np
import pytest

from synfeal.errors import InputError
from synfeal.mesh.cutting import opaque_side
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import MeshPart
from synfeal.mesh.save import save_glb
from synfeal.render import choose
from tests.support.mesh_samples import Gltf, paint_halves, textured
from tests.support.small_room import BACKENDS, PYOPENGL_WARNS
from tests.support.walls import BLUE, RED, UV_OF_SQUARE, area_m2, colors_along, seen_from, square

pytestmark = pytest.mark.filterwarnings(PYOPENGL_WARNS)

REPEAT, CLAMP, MIRROR = 10497, 33071, 33648  # of the specification
WRAPS = {REPEAT: "rbrbrb", CLAMP: "rrrbbb", MIRROR: "brrbbr"}  # from u = -1 to 2, by halves


def in_file(points):
    """Coordinates of the world, z up, as glTF has them, y up."""
    x, y, z = np.array(points, np.float32).T
    return np.column_stack([x, z, -y])


def wall(uv, material=None, colors=None, points=None):
    """A glTF of a square of a metre in the plane y = 0."""
    gltf = Gltf()
    gltf.add("POSITION", in_file(square(0) if points is None else points))
    gltf.add("TEXCOORD_0", np.array(uv, "<f4"))
    if colors is not None:
        gltf.add("COLOR_0", np.array(colors, "u1"), normalized=True)
    gltf.add("indices", np.array([[0], [1], [2], [0], [2], [3]], "<u2"))
    gltf.primitive["material"] = 0
    gltf.header["materials"] = [material or textured()]
    gltf.header |= {"textures": [{"source": 0}], "images": [{"uri": "halves.png"}]}
    return gltf


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize(("mode", "expected"), WRAPS.items(), ids=["repeat", "clamp", "mirror"])
def test_textures_go_on_as_samplers_say_everywhere(tmp_path, mode, expected, axis):
    paint_halves(tmp_path / "halves.png", RED, BLUE)
    along = 3.0 * np.array(UV_OF_SQUARE)[:, 0] - 1.0  # from -1 to 2
    uv = np.column_stack([along, np.full(4, 0.5)])
    places = [((k + 0.45) / 6, 0.5) for k in range(6)]
    if axis == 1:  # a texture that changes upwards, on the wall from left to right
        paint_halves(tmp_path / "halves.png", RED, BLUE, turned=True)
        uv = uv[:, ::-1]
    gltf = wall(uv)
    gltf.header["samplers"] = [{("wrapS", "wrapT")[axis]: mode}]
    gltf.header["textures"][0]["sampler"] = 0
    mesh = load_mesh(gltf.store(tmp_path))
    save_glb(tmp_path / "saved.glb", mesh)
    colors = {"r": list(RED), "b": list(BLUE)}
    wanted = np.array([colors[letter] for letter in expected])
    for backend in BACKENDS:
        for shown in (mesh, load_mesh(tmp_path / "saved.glb")):
            seen = colors_along(shown, places, choose.BACKENDS[backend])
            assert np.abs(np.array(seen) - wanted).max() <= 1, backend


def test_the_border_of_a_clamped_texture_does_not_bleed_from_the_other_side(tmp_path):
    paint_halves(tmp_path / "halves.png", RED, BLUE)
    for mode, is_mixed in ((REPEAT, True), (CLAMP, False), (MIRROR, False)):
        gltf = wall(UV_OF_SQUARE)
        gltf.header["samplers"] = [{"wrapS": mode, "wrapT": mode}]
        gltf.header["textures"][0]["sampler"] = 0
        mesh = load_mesh(gltf.store(tmp_path))
        for backend in BACKENDS:
            (seen,) = colors_along(mesh, [(0.002, 0.5)], choose.BACKENDS[backend], 0.5)
            assert (seen[2] > RED[2] + 20) == is_mixed, backend


CORNERS = [0, 1, 2, 3]
SHAPES = {
    "strip": (5, [0, 1, 3, 2], None),
    "fan": (6, CORNERS, None),
    "indexed fan": (6, CORNERS, CORNERS),
    "indexed strip": (5, CORNERS, [0, 1, 3, 2]),
    "list": (4, [0, 1, 2, 0, 2, 3], None),
}


@pytest.mark.parametrize(("mode", "order", "indices"), SHAPES.values(), ids=SHAPES)
def test_strips_and_fans_are_drawn_with_their_front_in_front(tmp_path, mode, order, indices):
    gltf = Gltf()
    gltf.add("POSITION", in_file([square(0)[k] for k in order]))
    gltf.add("COLOR_0", np.tile(np.array([255, 0, 0, 255], "u1"), (len(order), 1)), normalized=True)
    if indices is not None:
        gltf.add("indices", np.array(indices, "<u2").reshape(-1, 1))
    gltf.primitive["mode"] = mode
    mesh = load_mesh(gltf.store(tmp_path))
    assert area_m2(mesh) == pytest.approx(1.0)
    a, b, c = (mesh.parts[0].vertices_m[mesh.parts[0].faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 1] < 0).all()  # towards -y, where the square is seen from
    assert colors_along(mesh, [(0.2, 0.7), (0.7, 0.2)]) == [[255, 0, 0]] * 2
    assert mesh.findings == ()


@pytest.mark.parametrize("mode", ["MASK", "BLEND", "OPAQUE"])
def test_what_vertices_make_transparent_is_cut_out_everywhere(tmp_path, mode):
    """Opacity falls from 1 on the left to 0 on the right: half of the square is seen."""
    colors = [(255, 255, 255, 255 * (1 - u)) for u, _ in UV_OF_SQUARE]
    gltf = wall(UV_OF_SQUARE, {"name": "Paint", "alphaMode": mode}, colors)
    mesh = load_mesh(gltf.store(tmp_path))
    save_glb(tmp_path / "saved.glb", mesh)
    share = 1.0 if mode == "OPAQUE" else 0.5
    assert area_m2(mesh) == pytest.approx(share)
    for backend in BACKENDS:
        for shown in (mesh, load_mesh(tmp_path / "saved.glb")):
            opened = choose.BACKENDS[backend]
            assert seen_from(shown, (0.47, -3, 0.5), opened)[1] == pytest.approx(3.0)
            beyond = seen_from(shown, (0.53, -3, 0.5), opened)[1]
            assert np.isinf(beyond) == (mode != "OPAQUE")
    is_told = any("vertices are less opaque than 0.5" in said for said in mesh.findings)
    assert is_told == (mode != "OPAQUE")


def test_a_mesh_that_its_vertices_make_transparent_says_so(tmp_path):
    colors = [(255, 255, 255, 0)] * 4
    gltf = wall(UV_OF_SQUARE, {"name": "Paint", "alphaMode": "BLEND"}, colors)
    with pytest.raises(InputError, match="transparent everywhere"):
        load_mesh(gltf.store(tmp_path))


def test_cutting_keeps_the_plane_the_sides_and_what_varies_over_them():
    rng = np.random.default_rng(4)
    vertices = rng.normal(size=(300, 3))
    faces = np.arange(300).reshape(-1, 3)
    opacity = rng.uniform(size=300)
    part = MeshPart("p", vertices, faces, uv=vertices[:, :2] * [2.0, -1.0] + 0.5)
    cut = opaque_side(part, opacity, 0.4)
    np.testing.assert_allclose(cut.uv, cut.vertices_m[:, :2] * [2.0, -1.0] + 0.5, atol=1e-12)
    left = opaque_side(part, 1.0 - opacity, 0.6)
    total = sum(normals(each).sum(axis=0) for each in (cut, left))
    np.testing.assert_allclose(total, normals(part).sum(axis=0), atol=1e-9)
    areas = [np.linalg.norm(normals(each), axis=1).sum() for each in (cut, left, part)]
    assert areas[0] + areas[1] == pytest.approx(areas[2])


def normals(part):
    a, b, c = (part.vertices_m[part.faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def change(key, value):
    return lambda gltf: gltf.header.update({key: value})


def material_with(**values):
    return lambda gltf: gltf.header["materials"][0].update(values)


def node_with(**values):
    return lambda gltf: gltf.header["nodes"][0].update(values)


NAMED = {
    "only the default one is read": change("scenes", [{"nodes": [0]}, {"nodes": []}]),
    "drawn at rest": change("animations", [{"channels": [], "samplers": []}]),
    "have a skin, which is not followed": node_with(skin=0),
    "morph targets with weights": node_with(weights=[0.5]),
    "what it emits is not added": material_with(emissiveFactor=[1, 1, 1]),
    "lets light through (KHR_materials_transmission)": material_with(
        extensions={"KHR_materials_transmission": {"transmissionFactor": 1.0}}
    ),
    "has variants of materials": change("extensionsUsed", ["KHR_materials_variants"]),
    "extension ACME_wobble is not followed": change("extensionsUsed", ["ACME_wobble"]),
    "asks for unfiltered texels": lambda gltf: gltf.header.update(
        samplers=[{"magFilter": 9728}], textures=[{"source": 0, "sampler": 0}]
    ),
    "its texture cannot be read": change("textures", [{}]),
}


@pytest.mark.parametrize(("said", "changed"), NAMED.items(), ids=NAMED)
def test_what_is_not_followed_is_named(tmp_path, said, changed):
    paint_halves(tmp_path / "halves.png", RED, BLUE)
    gltf = wall(UV_OF_SQUARE)
    assert load_mesh(gltf.store(tmp_path)).findings == ()
    changed(gltf)
    findings = load_mesh(gltf.store(tmp_path)).findings
    assert any(said in finding for finding in findings), findings


def test_hidden_nodes_are_left_out_with_what_hangs_on_them(tmp_path):
    paint_halves(tmp_path / "halves.png", RED, BLUE)
    gltf = wall(UV_OF_SQUARE)
    hidden = {"extensions": {"KHR_node_visibility": {"visible": False}}, "children": [2], "mesh": 0}
    gltf.header["nodes"] = [{"mesh": 0}, hidden, {"mesh": 0, "translation": [5, 0, 0]}]
    gltf.header["scenes"] = [{"nodes": [0, 1]}]
    mesh = load_mesh(gltf.store(tmp_path))
    assert area_m2(mesh) == pytest.approx(1.0)
    assert "2 nodes are hidden" in mesh.findings[0]


def test_a_black_material_that_emits_a_texture_shows_it(tmp_path):
    paint_halves(tmp_path / "halves.png", RED, BLUE)
    baked = {
        "name": "Baked",
        "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1]},
        "emissiveTexture": {"index": 0},
        "emissiveFactor": [1, 1, 1],
    }
    mesh = load_mesh(wall(UV_OF_SQUARE, baked).store(tmp_path))
    assert colors_along(mesh, [(0.25, 0.5), (0.75, 0.5)]) == [list(RED), list(BLUE)]


@pytest.mark.parametrize(
    ("mode", "used", "said"),
    [
        (0, [], "holds points and no faces; make a surface"),
        (1, [], "lines or points and no faces"),
        (0, ["KHR_gaussian_splatting"], "is a Gaussian splat"),
    ],
)
def test_what_has_no_surface_is_called_by_its_name(tmp_path, mode, used, said):
    gltf = wall(UV_OF_SQUARE)
    gltf.primitive["mode"] = mode
    gltf.header["extensionsUsed"] = used
    with pytest.raises(InputError, match=said):
        load_mesh(gltf.store(tmp_path))
