"""OBJ and MTL as their authors see them; what is right follows from how each file was made."""

import numpy as np
import pytest
from PIL import Image

from synfeal.errors import InputError
from synfeal.mesh.load import load_mesh
from synfeal.mesh.mtl import parse_mtl, parse_texture
from synfeal.mesh.polygons import triangulated
from tests.support.mesh_samples import paint_halves
from tests.support.walls import (
    BLUE,
    GREEN,
    RED,
    UV_OF_SQUARE,
    YELLOW,
    area_m2,
    colors_along,
    square,
)

PAINTS = {"red": RED, "green": GREEN, "blue": BLUE, "yellow": YELLOW}
MIDDLES = [(k + 0.5, 0.5) for k in range(4)]  # of four squares side by side


def corners(first, indices, with_uv=True):
    """A face line of corners counted from ``first``, texture coordinates by the same numbers."""
    form = "{0}/{0}" if with_uv else "{0}"
    return "f " + " ".join(form.format(first + k) for k in indices)


def four_squares(relative=False, header="mtllib paint.mtl\n", with_uv=True):
    """Lines of an OBJ: four squares of a metre, each in a paint of its own."""
    lines = [header]
    for k, name in enumerate(PAINTS):
        lines += [f"v {x} {y} {z}\n" for x, y, z in square(k)]
        lines += [f"vt {u} {v}\n" for u, v in UV_OF_SQUARE] if with_uv else []
        first = -4 if relative else 4 * k + 1
        lines += [f"usemtl {name}\n", corners(first, range(4), with_uv) + "\n"]
    return "".join(lines)


def mtl_of(names=PAINTS, more=""):
    """Lines of an MTL with a texture of one colour for each paint."""
    return "".join(f"newmtl {name}\nKd 1 1 1\nmap_Kd {name}.png\n{more}" for name in names)


@pytest.fixture
def write(tmp_path):
    """Write an OBJ and its MTL beside textures of the four paints, and load it."""
    for name, color in PAINTS.items():
        Image.new("RGB", (4, 4), color).save(tmp_path / f"{name}.png")

    def load(obj, mtl=None, **others):
        content = obj if isinstance(obj, bytes) else obj.encode()
        (tmp_path / "scene.obj").write_bytes(content)
        if mtl is not None:
            (tmp_path / "paint.mtl").write_bytes(mtl if isinstance(mtl, bytes) else mtl.encode())
        for name, text in others.items():
            (tmp_path / f"{name}.mtl").write_text(text)
        return load_mesh(tmp_path / "scene.obj")

    return load


def test_relative_indices_count_back_from_where_they_stand(write):
    mesh = write(four_squares(relative=True), mtl_of())
    assert area_m2(mesh) == pytest.approx(4.0)
    assert colors_along(mesh, MIDDLES) == [list(color) for color in PAINTS.values()]
    with pytest.raises(InputError, match="counts back to a vertex before the first"):
        write("v 0 0 0\nv 1 0 0\nf -1 -2 -3\nv 0 1 0\n")
    with pytest.raises(InputError, match="names vertex 0"):
        write("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n")


@pytest.mark.parametrize("chunk_bytes", [1, 37, 1 << 25])
def test_the_same_is_read_whatever_is_read_at_once(write, monkeypatch, chunk_bytes):
    monkeypatch.setattr("synfeal.mesh.obj_text.CHUNK_BYTES", chunk_bytes)
    for relative in (True, False):
        mesh = write(four_squares(relative), mtl_of())
        assert colors_along(mesh, MIDDLES) == [list(color) for color in PAINTS.values()]


DOORWAY = [(0, 0), (1, 0), (1, 2), (2, 2), (2, 0), (3, 0), (3, 2.5), (0, 2.5)]


def polygon(outline, turn=lambda x, z: (x, 0.0, z)):
    return "".join("v {} {} {}\n".format(*turn(x, z)) for x, z in outline)


def test_a_doorway_in_one_concave_polygon_is_open(write):
    behind = "v -9 5 -9\nv 9 5 -9\nv 9 5 9\nv -9 5 9\nf -4 -3 -2 -1\n"
    colored = (polygon(DOORWAY) + "f 1 2 3 4 5 6 7 8\n").replace("\nv", " 1 0 0\nv", 7)
    text = colored.replace("v 0 0.0 2.5\n", "v 0 0.0 2.5 1 0 0\n")
    mesh = write(text + behind.replace("9\nv", "9 0 0 1\nv").replace("9 5 9\nf", "9 5 9 0 0 1\nf"))
    places = [(0.5, 1.0), (1.5, 1.0), (2.5, 1.0), (1.5, 2.2), (1.1, 0.3), (1.9, 1.9)]
    red, blue = [255, 0, 0], [0, 0, 255]
    assert colors_along(mesh, places) == [red, blue, red, red, blue, blue]
    assert area_m2(mesh) == pytest.approx(3 * 2.5 - 2 + 18 * 18)


def outline_area(outline):
    x, y = np.array(outline, float).T
    return abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))) / 2


TURNS = np.arange(14) * np.pi / 7
STAR = np.column_stack([np.cos(TURNS), np.sin(TURNS)])
STAR[::2] *= 3.0
COMB = [(0, 0), (9, 0), *((x, 3 if x % 2 else 1) for x in range(9, -1, -1))]
OUTLINES = {
    "arrow": [(0, 0), (2, -1), (0, 3), (-2, -1)],
    "arrow from its notch": [(0, -0.5), (2, -1), (0, 3), (-2, -1)][::-1],
    "doorway": DOORWAY,
    "star": STAR,
    "comb": COMB,
    "corners on its sides": [(0, 0), (1, 0), (2, 0), (2, 1), (2, 2), (1, 2), (0, 2), (0, 1)],
    "repeated corners": [(0, 0), (2, 0), (2, 0), (2, 2), (1, 1), (1, 1), (0, 2), (0, 2)],
    "hole with a bridge": [
        *((0, 0), (4, 0), (4, 4), (0, 4), (0, 0)),
        *((1, 1), (1, 3), (3, 3), (3, 1), (1, 1)),
    ],
}


@pytest.mark.parametrize("far", [0.0, 1e6])
@pytest.mark.parametrize("outline", OUTLINES.values(), ids=OUTLINES)
def test_triangles_cover_a_polygon_once_and_keep_its_side(outline, far):
    turn = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    points = np.column_stack([outline, np.zeros(len(outline))]) @ turn.T + far
    count = np.array([len(outline)])
    cut = triangulated(points, count, np.arange(len(outline)))
    a, b, c = (points[cut.corners[:, k]] for k in range(3))
    doubled = np.cross(b - a, c - a)
    area = outline_area(outline)
    assert np.linalg.norm(doubled, axis=1).sum() / 2 == pytest.approx(area, rel=1e-6)
    # The sum of vectors is that of the outline: no triangle is turned over.
    assert np.linalg.norm(doubled.sum(axis=0)) / 2 == pytest.approx(area, rel=1e-6)
    assert not cut.crossing.any()


def test_quadrilaterals_that_are_not_flat_stay_whole_and_crossing_ones_are_told(write):
    bent = "v 0 0 0\nv 1 0 0.3\nv 1 1 0\nv 0 1 0.3\nf 1 2 3 4\n"
    assert area_m2(write(bent)) > 1.0
    bow_tie = "v 0 0 0\nv 3 2 0\nv 3 0 0\nv 0 1 0\nf 1 2 3 4\n"
    assert "cross themselves" in " ".join(write(bow_tie).findings)


FORMS = {
    "two blanks": lambda text: text.replace("\nv ", "\nv  "),
    "tabs": lambda text: text.replace(" ", "\t"),
    "carriage returns": lambda text: text.replace("\n", "\r"),
    "windows": lambda text: text.replace("\n", "\r\n"),
    "byte order mark": lambda text: "\ufeff" + text,
    "indented": lambda text: "".join(f"   {line}\n" for line in text.split("\n")),
    "continued": lambda text: text.replace("f ", "f \\\n"),
    "continued on windows": lambda text: text.replace("f ", "f \\\r\n"),
    "comments": lambda text: text.replace("\nusemtl", " # a wall\n# usemtl blue\\\nusemtl"),
    "no last newline": lambda text: text.rstrip("\n"),
    "quoted library": lambda text: text.replace("paint.mtl", '"paint.mtl"'),
    "other case": lambda text: text.replace("paint.mtl", "Paint.MTL"),
    "upper case": lambda text: text.replace("\nv ", "\nV ").replace("\nf ", "\nF "),
    "empty lines": lambda text: text.replace("\n", "\n\n  \n"),
    "empty texture index": lambda text: text.replace("/", "/").replace("\nf 1/1", "\nf 1/1/"),
    "exponents": lambda text: text.replace("v 1 ", "v 1.0e+00 ").replace("v 2 ", "v 200E-2 "),
}


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
def test_text_is_read_as_other_programs_write_it(write, form):
    mesh = write(form(four_squares()), mtl_of())
    assert colors_along(mesh, MIDDLES) == [list(color) for color in PAINTS.values()]
    assert area_m2(mesh) == pytest.approx(4.0)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_names_and_marks_of_other_encodings(write, encoding):
    obj = four_squares().replace("red", "röt").encode(encoding)
    mtl = mtl_of().replace("newmtl red", "newmtl röt").encode(encoding)
    assert colors_along(write(obj, mtl), MIDDLES)[0] == list(RED)


def test_faces_of_several_forms_stand_beside_each_other(write):
    text = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nvt 0 0\nvn 0 1 0\n"
    text += "f 1 2 3\nf 1/1 3/1 4/1\nf 2//1 1//1 4//1\nf 2/1/1 3/1/1 4/1/1\nf 1 2/1 3//1 4/1/1\n"
    parts = write(text).parts
    assert sum(len(part.faces) for part in parts) == 4 + 1  # one of the quadrilateral's is there


@pytest.mark.parametrize(
    "line", ["mtllib a.mtl b.mtl\n", "mtllib a.mtl\nmtllib b.mtl\n", "mtllib a b.mtl a.mtl b.mtl\n"]
)
def test_all_libraries_are_read(write, line):
    names = list(PAINTS)
    mesh = write(four_squares(header=line), a=mtl_of(names[:2]), b=mtl_of(names[2:]), **{"a b": ""})
    assert colors_along(mesh, MIDDLES) == [list(color) for color in PAINTS.values()]
    assert mesh.findings == ()


def test_textures_lie_beside_their_library_too(write, tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "walls.mtl").write_text(mtl_of().replace("red.png", "only here.png"))
    (tmp_path / "red.png").rename(tmp_path / "sub" / "only here.png")
    mesh = write(four_squares(header="mtllib sub/walls.mtl\n"))
    assert colors_along(mesh, MIDDLES) == [list(color) for color in PAINTS.values()]
    assert mesh.findings == ()


def test_a_library_that_is_missing_and_one_that_lies_beside_instead(write):
    mesh = write(four_squares(header="mtllib gone.mtl\n"), scene=mtl_of())
    assert "'gone.mtl' is missing; 'scene.mtl' beside the file is read instead" in mesh.findings
    assert colors_along(mesh, MIDDLES)[0] == list(RED)


def test_undefined_materials_are_named_and_have_no_texture(write):
    mesh = write(four_squares(), mtl_of(["red", "green"]))
    assert "2 of 4 faces use materials that no MTL defines" in mesh.findings[0]
    assert "'blue', 'yellow'" in mesh.findings[0]
    assert [part.texture is None for part in mesh.parts] == [False, False, True, True]


def test_without_usemtl_the_only_material_is_meant(write):
    text = "".join(line + "\n" for line in four_squares().split("\n") if "usemtl" not in line)
    mesh = write(text, mtl_of(["red"]))
    assert mesh.findings[0] == "no usemtl: all faces take the one material, 'red'"
    assert colors_along(mesh, MIDDLES) == [list(RED)] * 4
    assert "name no material" in write(text, mtl_of(["red", "blue"])).findings[0]


def test_objects_and_groups_of_one_material_are_parts_of_their_own(write):
    lines = ["mtllib paint.mtl\nusemtl red\n"]
    for k, head in enumerate(("o chair 1", "o chair 2", "g table", "o chair 1")):
        lines += [head + "\n", *(f"v {x} {y} {z}\n" for x, y, z in square(k)), "f -4 -3 -2 -1\n"]
    parts = write("".join(lines), mtl_of()).parts
    assert [(part.name, len(part.faces)) for part in parts] == [
        ("chair 1", 4),
        ("chair 2", 2),
        ("table", 2),
    ]


HALVES = {  # the left half of a square is red, its right half blue
    "map_Kd halves.png": "rrbb",
    "map_Kd -s 2 2 1 halves.png": "rbrb",
    "map_Kd -s 2 halves.png": "rbrb",
    "map_Kd -o 0.5 0 0 halves.png": "bbrr",
    "map_Kd -s 2 1 1 -o .5 0 0 -blendu on -boost 2 halves.png": "brbr",
    "map_Kd -o 0.5 -clamp on halves.png": "bbbb",
    "map_Kd -clamp off -o 0.5 halves.png": "bbrr",
    "map_Kd two halves.png": "bbrr",
    "map_Kd -s 1 1 1 two halves.png": "bbrr",
    'map_Kd "two halves.png"': "bbrr",
    "map_Kd .\\sub\\two halves.png": "bbrr",
    "map_Kd -mm 0 0.5 halves.png": "RRBB",
    "map_Ka halves.png": "rrbb",
}


@pytest.mark.parametrize(("line", "expected"), HALVES.items(), ids=HALVES)
def test_options_of_textures_and_names_with_blanks(write, tmp_path, line, expected):
    paint_halves(tmp_path / "halves.png", RED, BLUE)
    paint_halves(tmp_path / "two halves.png", BLUE, RED)
    (tmp_path / "halves").mkdir()
    obj = "mtllib paint.mtl\nusemtl wall\n" + "".join(f"v {x} {y} {z}\n" for x, y, z in square(0))
    obj += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\n"
    mesh = write(obj, f"newmtl wall\nKd 0.2 0.2 0.2\n{line}\n")
    letters = {"r": RED, "b": BLUE, "R": (100, 20, 20), "B": (20, 30, 100)}
    # A little beside the quarters: there one texel meets the next at half its size.
    seen = colors_along(mesh, [(x, 0.5) for x in (0.13, 0.37, 0.63, 0.87)])
    assert seen == [list(letters[letter]) for letter in expected]


def test_options_that_are_not_followed_are_named(write):
    mesh = write(four_squares(), mtl_of().replace("map_Kd red", "map_Kd -t 1 1 1 -imfchan r red"))
    assert "material 'red': option -t of its texture is not followed" in mesh.findings
    assert "material 'red': option -imfchan of its texture is not followed" in mesh.findings


def test_a_name_that_looks_like_an_option_is_a_name():
    assert parse_texture("-wall.png").name == "-wall.png"
    assert parse_texture("-s 2 2 3.png").name == "3.png"
    assert parse_texture("-s 1 1 1") is None


TR = {
    "textured": (mtl_of(more="Tr 1.000000\n"), 4),
    "one says d": (mtl_of(["red"], "d 1\n") + mtl_of(["green", "blue", "yellow"], "Tr 1\n"), 4),
    "plain, all": ("".join(f"newmtl {name}\nKd 1 0 0\nTr 1\n" for name in PAINTS), 4),
    "a pane": (mtl_of(["red", "green", "blue"], "Tr 0\n") + "newmtl yellow\nTr 1\n", 3),
    "d goes before": (mtl_of(["red", "green", "blue"]) + "newmtl yellow\nd 0\nTr 0\n", 3),
    "halo": (mtl_of(["red", "green", "blue"]) + "newmtl yellow\nd -halo 0.1\n", 3),
}


@pytest.mark.parametrize(("mtl", "drawn"), TR.values(), ids=TR)
def test_tr_is_transparency_unless_all_that_is_painted_would_vanish(write, mtl, drawn):
    mesh = write(four_squares(), mtl)
    assert len(mesh.parts) == drawn
    assert any("'Tr 1' taken as opaque" in said for said in mesh.findings) == (drawn == 4)


def test_a_mask_of_its_own_cuts_holes(write, tmp_path):
    Image.fromarray(np.array([[0, 255]], np.uint8)).resize((8, 8), 0).save(tmp_path / "mask.png")
    mesh = write(four_squares(), mtl_of(more="map_d mask.png\n"))
    seen = colors_along(mesh, [(0.2, 0.5), (0.8, 0.5)])
    assert seen == [[0, 0, 0], list(RED)]


def test_faces_without_texture_coordinates_do_not_take_them_from_others(write):
    text = four_squares().replace("usemtl green\nf 5/5 6/6 7/7 8/8", "usemtl red\nf 5 6 7 8")
    mesh = write(text, mtl_of())
    assert "2 faces have a texture but no texture coordinates" in " ".join(mesh.findings)
    assert colors_along(mesh, MIDDLES)[0] == list(RED)
    assert [part.texture is None for part in mesh.parts].count(True) == 1


@pytest.mark.parametrize("scale", [1.0, 255.0])
@pytest.mark.parametrize("weights", ["", " 1.0"])
def test_colours_behind_coordinates_are_fractions_or_levels(write, scale, weights):
    paints = np.array([RED, GREEN, BLUE, YELLOW]) / 255.0 * scale
    text = ""
    for k, color in enumerate(paints):
        numbers = " ".join(f"{value:.6g}" for value in color)
        text += "".join(f"v {x} {y} {z} {numbers}{weights}\n" for x, y, z in square(k))
        text += "f -4 -3 -2 -1\n"
    assert np.abs(np.array(colors_along(write(text), MIDDLES)) - paints / scale * 255).max() <= 1


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("v 0 0 0\nv 1 1 1\nl 1 2\n", "holds no faces but 1 lines"),
        ("v 0 0 0\nv 1 1 1\np 1\n", "holds no faces but 2 points; make a surface of them"),
        ("v 0 0 0\ncstype bezier\nsurf 0 1 0 1 1\n", "free-form surfaces"),
        ("v 0,5 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "write decimals with a point"),
        ("v 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "fewer than 3 numbers"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1.5 2.0 3.0\n", "is no whole number"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 NaN\n", "'NaN' in '1 2 NaN' is no whole number"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999\n", "'9{20}' in .* is too large"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "names vertex 4 of 3"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/2\n", "texture coordinate 2 of 1"),
        ("v 0 0 0\0\nf 1 1 1\n", "no text"),
    ],
)
def test_what_cannot_be_read_is_quoted(write, text, said):
    with pytest.raises(InputError, match=said):
        write(text)


def test_what_is_not_drawn_is_counted(write):
    text = four_squares(with_uv=False) + "l 1 2\nl 2 3\np 1\nf 1 2\nblob 3\ncurv 1\n"
    findings = " ".join(write(text, mtl_of()).findings)
    for words in (
        "2 lines and 1 points are not drawn",
        "1 faces with fewer than 3 corners left out",
        "'blob' is not read (once)",
        "1 statements of free-form surfaces",
    ):
        assert words in findings


def test_a_material_says_what_of_its_colour_is_not_followed():
    text = b"newmtl a\nKd spectral file.rfl\nnewmtl b\nKd 0.5\nnewmtl c\ndecal x.png\n"
    a, b, c = parse_mtl(text)
    assert a.diffuse is None
    assert a.unread == ("Kd spectral file.rfl",)
    assert b.diffuse == (0.5, 0.5, 0.5)
    assert c.unread == ("decal",)
