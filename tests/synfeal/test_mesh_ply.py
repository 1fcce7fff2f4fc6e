"""PLY as other programs write it: polygons, strips, textures and kinds of colours, by hand."""

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from synfeal.errors import InputError
from synfeal.mesh.load import load_mesh
from synfeal.mesh.ply_text import Lists, parse_ply
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

FORMATS = ("ascii", "binary_little_endian", "binary_big_endian")
CODES = {
    "uchar": "B",
    "ushort": "H",
    "short": "h",
    "int": "i",
    "uint": "I",
    "float": "f",
    "double": "d",
}
PAINTS = (RED, GREEN, BLUE, YELLOW)
MIDDLES = [(k + 0.4, 0.5) for k in range(4)]
VERTICES = [corner for k in range(4) for corner in square(k)]
# A square of two triangles, one of a quadrilateral, a pentagon, and again two triangles.
FACES = [(0, 1, 2), (0, 2, 3), (4, 5, 6, 7), (8, 9, 16, 10, 11), (12, 13, 14), (12, 14, 15)]
MIDDLE_OF_SIDE = (3, 0, 0.5)


def row(format_, kinds, values):
    """One row: text, or bytes by the types of PLY, where a list is a pair of its types."""
    flat = []
    for kind, value in zip(kinds, values, strict=True):
        if isinstance(kind, tuple):
            flat += [(kind[0], len(value)), *((kind[1], one) for one in value)]
        else:
            flat.append((kind, value))
    if format_ == "ascii":
        return (" ".join(f"{value:g}" for _, value in flat) + "\n").encode()
    order = "<" if "little" in format_ else ">"
    return b"".join(struct.pack(order + CODES[kind], value) for kind, value in flat)


def ply(format_, *elements, comments=()):
    """A file of elements (name, properties {name: kind}, rows)."""
    lines = ["ply", f"format {format_} 1.0", *(f"comment {text}" for text in comments)]
    body = b""
    for name, properties, rows in elements:
        lines.append(f"element {name} {len(rows)}")
        for each, kind in properties.items():
            words = f"list {kind[0]} {kind[1]}" if isinstance(kind, tuple) else kind
            lines.append(f"property {words} {each}")
        body += b"".join(row(format_, properties.values(), values) for values in rows)
    return ("\n".join([*lines, "end_header"]) + "\n").encode() + body


XYZ = dict.fromkeys("xyz", "float")
INDICES = {"vertex_indices": ("uchar", "int")}


@pytest.fixture
def load(tmp_path):
    def written(content):
        (tmp_path / "scan.ply").write_bytes(content)
        return load_mesh(tmp_path / "scan.ply")

    return written


def colored(format_, names="red green blue", kind="uchar", convert=lambda level: level):
    """Four painted squares of mixed polygons."""
    paints = [PAINTS[k] for k in range(4) for _ in range(4)] + [PAINTS[2]]
    rows = [
        (*place, *(convert(level) for level in paint))
        for place, paint in zip([*VERTICES, MIDDLE_OF_SIDE], paints, strict=True)
    ]
    properties = XYZ | dict.fromkeys(names.split(), kind)
    return ply(format_, ("vertex", properties, rows), ("face", INDICES, [(f,) for f in FACES]))


@pytest.mark.parametrize("format_", FORMATS)
def test_triangles_and_polygons_stand_in_one_list(load, format_):
    mesh = load(colored(format_))
    assert area_m2(mesh) == pytest.approx(4.0)
    assert mesh.n_faces == 2 + 2 + 3 + 2
    assert colors_along(mesh, MIDDLES) == [list(color) for color in PAINTS]


KINDS = {
    "fractions": ("red green blue", "float", lambda level: level / 255),
    "float levels": ("red green blue", "float", float),
    "double levels": ("r g b", "double", float),
    "short names": ("r g b", "uchar", int),
    "diffuse": ("diffuse_red diffuse_green diffuse_blue", "uchar", int),
    "16 bits": ("red green blue", "ushort", lambda level: level * 257),
    "levels in 16 bits": ("red green blue", "ushort", int),
    "integers": ("red green blue", "int", int),
}


@pytest.mark.parametrize(("names", "kind", "convert"), KINDS.values(), ids=KINDS)
@pytest.mark.parametrize("format_", FORMATS[:2])
def test_colours_of_every_kind(load, format_, names, kind, convert):
    seen = colors_along(load(colored(format_, names, kind, convert)), MIDDLES)
    assert np.abs(np.array(seen) - PAINTS).max() <= 1


def test_dark_fractions_stay_dark_and_what_is_no_colour_is_refused(load):
    dark = load(colored("ascii", kind="float", convert=lambda level: level / 255 / 300))
    assert np.array(colors_along(dark, MIDDLES)).max() <= 1
    with pytest.raises(InputError, match="colours reach"):
        load(colored("ascii", kind="float", convert=lambda level: level * 1000.0))


def textured(format_, numbers=None, files=("paint.png",), per_vertex=False):
    """Squares whose faces carry texture coordinates, the pentagon left out."""
    faces = [face for face in FACES if len(face) < 5]
    uv = {k: UV_OF_SQUARE[k % 4] for k in range(16)}
    face_kinds, rows = dict(INDICES), [[face] for face in faces]
    vertex_kinds, vertices = dict(XYZ), [list(place) for place in VERTICES]
    if per_vertex:
        vertex_kinds |= {"s": "float", "t": "float"}
        vertices = [[*place, *uv[k]] for k, place in enumerate(VERTICES)]
    else:
        face_kinds["texcoord"] = ("uchar", "float")
        rows = [[*r, [x for k in r[0] for x in uv[k]]] for r in rows]
    if numbers is not None:
        face_kinds["texnumber"] = "int"
        rows = [[*r, numbers[r[0][0] // 4]] for r in rows]
    comments = [f"TextureFile {name}" for name in files]
    return ply(
        format_, ("vertex", vertex_kinds, vertices), ("face", face_kinds, rows), comments=comments
    )


SHOWN = [MIDDLES[k] for k in (0, 1, 3)]


@pytest.mark.parametrize("per_vertex", [True, False])
@pytest.mark.parametrize("format_", FORMATS)
def test_texture_coordinates_of_mixed_polygons(load, tmp_path, format_, per_vertex):
    Image.new("RGB", (4, 4), GREEN).save(tmp_path / "paint.png")
    mesh = load(textured(format_, per_vertex=per_vertex))
    assert colors_along(mesh, SHOWN) == [list(GREEN)] * 3
    uv = np.concatenate([part.uv for part in mesh.parts])
    assert sorted({*map(tuple, uv.tolist())}) == sorted(UV_OF_SQUARE)


@pytest.mark.parametrize("format_", FORMATS[:2])
def test_several_textures_by_number(load, tmp_path, format_):
    for name, color in (("one.png", RED), ("a b.png", BLUE)):
        Image.new("RGB", (4, 4), color).save(tmp_path / name)
    mesh = load(textured(format_, numbers=(1, 0, 0, 1), files=("one.png", "a b.png")))
    assert colors_along(mesh, SHOWN) == [list(BLUE), list(RED), list(BLUE)]
    beyond = load(textured(format_, numbers=(1, 0, 0, 5), files=("one.png", "a b.png")))
    assert "2 faces name texture 5 of 2; drawn without" in beyond.findings


def test_strips_turn_every_other_triangle_and_are_joined_by_repeats(load):
    places = [(x, 0, z) for x in range(3) for z in (0, 1)]
    strips = [([0, 1, 2, 3, -1, 2, 3, 4, 5],)]
    kinds = {"vertex_indices": ("int", "int")}
    mesh = load(ply("binary_little_endian", ("vertex", XYZ, places), ("tristrips", kinds, strips)))
    assert area_m2(mesh) == pytest.approx(2.0)
    a, b, c = (mesh.parts[0].vertices_m[mesh.parts[0].faces[:, k]] for k in range(3))
    assert len(np.unique(np.sign(np.cross(b - a, c - a)[:, 1]))) == 1


SPLAT = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3"
REFUSED = {
    "is a Gaussian splat of 2 Gaussians": ply(
        "binary_little_endian",
        ("vertex", dict.fromkeys(SPLAT.split(), "float"), [[0.0] * 14] * 2),
    ),
    "no faces but 3 points; make a surface": ply("ascii", ("vertex", XYZ, VERTICES[:3])),
    "names vertex 9 of 3": ply(
        "ascii", ("vertex", XYZ, VERTICES[:3]), ("face", INDICES, [((0, 1, 9),)])
    ),
    "have no x, y and z": ply("ascii", ("vertex", {"x": "float"}, [(0,)]), ("face", INDICES, [])),
    "does not begin with 'ply'": b"plum\n",
    "its header does not end": b"ply\nformat ascii 1.0\n",
    "'format ascii_2 1.0' is not known": b"ply\nformat ascii_2 1.0\nend_header\n",
    "property list float int a": b"ply\nformat ascii 1.0\nelement a 1\nproperty list float int a\n",
    "declares 'x' twice": b"ply\nformat ascii 1.0\nelement a 1\n"
    + 2 * b"property int x\n"
    + b"end_header\n",
    "after 2 of 3 rows of 'vertex'": ply("ascii", ("vertex", XYZ, VERTICES[:3])).rpartition(
        b"1 0 1"
    )[0],
    "more rows than its header says": ply("ascii", ("vertex", XYZ, VERTICES[:3])) + b"1 2 3\n",
}


@pytest.mark.parametrize(("said", "content"), REFUSED.items(), ids=REFUSED)
def test_what_is_no_mesh_is_called_by_its_name(load, said, content):
    with pytest.raises(InputError, match=said):
        load(content)


@pytest.mark.parametrize("format_", FORMATS[1:])
def test_every_cut_of_a_binary_file_is_refused(load, format_):
    whole = colored(format_)
    for end in range(whole.index(b"end_header") + 11, len(whole), 7):
        with pytest.raises(InputError, match=r"download or export it again|no faces"):
            load(whole[:end])
    assert "6 bytes behind the last row" in " ".join(load(whole + b"behind").findings)


ROWS = st.lists(
    st.tuples(
        st.lists(st.integers(-9, 9), max_size=4),
        st.integers(0, 9),
        st.lists(st.just(7), max_size=2),
    ),
    min_size=1,
    max_size=12,
)


@settings(max_examples=60, deadline=None)
@given(ROWS, st.sampled_from(FORMATS), st.sampled_from(["uchar", "ushort", "int"]))
def test_lists_of_any_length_come_back(rows, format_, count):
    kinds = {"a": (count, "short"), "b": "uint", "c": (count, "double")}
    found = parse_ply(ply(format_, ("thing", kinds, rows), ("end", {"x": "int"}, [(5,)])))
    a, c = found.lists("thing", "a"), found.lists("thing", "c")
    assert isinstance(a, Lists)
    assert a.counts.tolist() == [len(each[0]) for each in rows]
    assert a.values.tolist() == [value for each in rows for value in each[0]]
    assert found.numbers("thing", "b").tolist() == [each[1] for each in rows]
    assert c.counts.tolist() == [len(each[2]) for each in rows]
    assert found.numbers("end", "x").tolist() == [5]
