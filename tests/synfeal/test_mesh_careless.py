"""Meshes written carelessly: refused in one line that says why, or read with what was odd named."""

import json
import struct

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from PIL import Image

from synfeal.errors import InputError
from synfeal.mesh.load import load_mesh
from tests.support.mesh_samples import textured, triangle_gltf
from tests.support.walls import area_m2

V = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
VT = "vt 0 0\nvt 1 0\nvt 0 1\n"
PAINTED = f"mtllib a.mtl\n{V}{VT}usemtl a\nf 1/1 2/2 3/3\n"
KD = "newmtl a\nKd 1 0 0\n"
XYZ = "property float x\nproperty float y\nproperty float z\n"
FACE = "property list uchar int vertex_indices\n"
POINTS = "0 0 0\n1 0 0\n0 1 0\n"
QUIET = ""  # nothing is said, because nothing is odd


def ply(header, body, format_="ascii"):
    return f"ply\nformat {format_} 1.0\n{header}end_header\n".encode() + body


THREE = f"element vertex 3\n{XYZ}"


def faces(count, rows):
    """Three points and rows of faces, as text."""
    return ply(f"{THREE}element face {count}\n{FACE}", f"{POINTS}{rows}".encode())


PLY_UV = f"comment TextureFile a.png\n{THREE}element face {{}}\n{FACE}"
PLY_UV += "property list uchar float texcoord\n"
# What is read, with an area of half a square metre, and what is said of it.
READ = {
    "obj: normals beyond the end": (V + "f 1//9 2//9 3//9\n", QUIET),
    "obj: texture coordinates named, none there": (
        V + "f 1/1 2/1 3/1\n",
        "name texture coordinates",
    ),
    "obj: face before its vertices": ("f 1 2 3\n" + V, QUIET),
    "obj: capital exponents": (V.replace("v 1", "v 1E+0") + "f 1 2 3\n", QUIET),
    "obj: plus signs": (V.replace("v 1", "v +1") + "f 1 2 3\n", QUIET),
    "obj: no digits before the point": (V.replace("v 1 0 0", "v 1. .0 -.0") + "f 1 2 3\n", QUIET),
    "obj: slashes at the end": (V + VT + "f 1/1/ 2/2/ 3/3/\n", QUIET),
    "obj: one vertex twice in a row": (V + "f 1 2 2 3\n", "zero-area"),
    "obj: first vertex again at the end": (V + "f 1 2 3 1\n", "zero-area"),
    "obj: weights": (V.replace("0\n", "0 1\n") + "f 1 2 3\n", QUIET),
    "obj: weights that are not 1": (V.replace("v 0 0 0", "v 0 0 0 2") + "f 1 2 3\n", "4 numbers"),
    "obj: five numbers": (V.replace("v 0 0 0", "v 0 0 0 1 1") + "f 1 2 3\n", "5 numbers"),
    "obj: an empty object and group": ("o\ng\n" + V + "f 1 2 3\n", QUIET),
    "obj: a web page behind it": (V + "f 1 2 3\n<html>\n", "'<html>' is not read"),
    "obj: old faces": (V + "f 1 2 3\nfo 1 2 3\n", "fewer than 3 corners"),
    "obj: library without a name": ("mtllib\n" + V + "f 1 2 3\n", QUIET),
    "obj: material without a name": ("usemtl\n" + V + "f 1 2 3\n", QUIET),
    "obj: form feeds": (V.replace("\n", "\f\n") + "f 1 2 3\n", QUIET),
    "obj: comment that looks like a face": (V + "# f 1 2 3\nf 1 2 3 # f 3 2 1\n", QUIET),
    "obj: backslash at the end of the file": (V + "f 1 2 3\\", QUIET),
    "obj: colours for some": (V.replace("v 0 0 0", "v 0 0 0 1 0 0") + "f 1 2 3\n", "no colour"),
    "ply: windows line ends": (
        faces(1, "3 0 1 2\n").replace(b"\n", b"\r\n"),
        QUIET,
    ),
    "ply: empty lines": (
        ply(f"{THREE}element face 1\n{FACE}", b"0 0 0\n\n1 0 0\n0 1 0\n 3 0 1 2\n"),
        QUIET,
    ),
    "ply: faces before vertices": (
        ply(f"element face 1\n{FACE}{THREE}", f"3 0 1 2\n{POINTS}".encode()),
        QUIET,
    ),
    "ply: a comment broken in two": (
        faces(1, "3 0 1 2\n").replace(
            b"element vertex", b"comment by\nsome program\nelement vertex"
        ),
        QUIET,
    ),
    "ply: other elements": (
        ply(
            f"{THREE}element face 1\n{FACE}element edge 1\nproperty int a\n",
            f"{POINTS}3 0 1 2\n7\n".encode(),
        ),
        "1 rows of 'edge' are not read",
    ),
    "ply: an empty face": (
        faces(2, "3 0 1 2\n0\n"),
        "fewer than 3",
    ),
    "ply: two-cornered face": (
        faces(2, "3 0 1 2\n2 0 1\n"),
        "fewer than 3",
    ),
    "ply: floats as integers": (
        faces(1, "3.0 0 1.0 2\n"),
        QUIET,
    ),
    "ply: texture without coordinates": (
        ply(
            f"comment TextureFile a.png\n{THREE}element face 1\n{FACE}",
            f"{POINTS}3 0 1 2\n".encode(),
        ),
        "texture",
    ),
}
# What an MTL holds, beside a triangle that uses its material 'a', and what is said.
MTL = {
    "nothing": ("", "materials that no MTL defines"),
    "another name": ("newmtl b\nKd 1 0 0\n", "materials that no MTL defines"),
    "twice, differently": (KD + "newmtl a\nKd 0 1 0\n", "is defined twice"),
    "twice, alike": (KD + KD, QUIET),
    "colour of 255": ("newmtl a\nKd 255 0 0\n", "levels from 0 to 255"),
    "colour above 1": ("newmtl a\nKd 1.5 0 0\n", "cut off at 0 and 1"),
    "negative colour": ("newmtl a\nKd -1 0 0\n", "cut off at 0 and 1"),
    "colour in words": ("newmtl a\nKd red\n", "'Kd red' is not followed"),
    "colour that is no number": ("newmtl a\nKd nan nan nan\n", QUIET),
    "opacity in words": (KD + "d opaque\n", "'d opaque' is not followed"),
    "opacity above 1": (KD + "d 7\n", QUIET),
    "texture without a name": (KD + "map_Kd\n", "without a file"),
    "texture of options only": (KD + "map_Kd -s 1 1 1\n", "without a file"),
    "texture that is not there": (KD + "map_Kd gone.png\n", "'gone.png' is missing"),
    "texture that is text": (KD + "map_Kd a.mtl\n", "cannot be read as an image"),
    "texture that is a folder": (KD + "map_Kd .\n", "'.' is missing"),
    "texture of no size": (KD + "map_Kd empty.png\n", "cannot be read as an image"),
    "mask that is not there": (KD + "map_d gone.png\n", "'gone.png' is missing"),
    "endless scale": (KD + "map_Kd -s 1e400 1 1 a.png\n", "NaN or infinite"),
    "binary": ("newmtl a\n\0\1\2\xff\n", QUIET),
}
REFUSED = {
    "obj: nothing but comments": ("# nothing\n", "holds no faces"),
    "obj: zero bytes": (b"v 0 0 0\0\0", "bytes of zero"),
    "obj: hexadecimal": ("v 0x1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "'0x1' in .* is no number"),
    "obj: numbers with underscores": ("v 1_0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "'1_0'|no number"),
    "obj: numbers beyond all": ("v 1e999 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "NaN or infinite"),
    "obj: Windows' not a number": ("v -1.#IND 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "numbers"),
    "obj: enormous index": (V + "f 1 2 99999999999999999999\n", "cannot be read"),
    "obj: negative beyond the start": (V + "f -1 -2 -9\n", "before the first"),
    "obj: index in words": (V + "f a b c\n", "cannot be read"),
    "obj: slashes alone": (V + "f / / /\n", "no face has 3 corners"),
    "obj: a glTF": ('{"asset": {"version": "2.0"}}', "holds no faces"),
    "obj: all faces flat": (V + "f 1 1 1\nf 1 2 1\n", "holds no faces"),
    "ply: a list that lies": (
        faces(1, "9 0 1 2\n"),
        "shorter",
    ),
    "ply: half an index": (
        faces(1, "3 0 1.5 2\n"),
        "1.5",
    ),
    "ply: negative length": (
        faces(1, "-3 0 1 2\n"),
        "-3 values",
    ),
    "ply: words": (
        ply(f"{THREE}element face 1\n{FACE}", b"0 0 zero\n1 0 0\n0 1 0\n3 0 1 2\n"),
        "is no number",
    ),
    "ply: no format": (b"ply\nelement vertex 0\nend_header\n", "names no format"),
    "ply: count in words": (
        b"ply\nformat ascii 1.0\nelement vertex many\nend_header\n",
        "element vertex many",
    ),
    "ply: property of nothing": (
        b"ply\nformat ascii 1.0\nproperty int a\nend_header\n",
        "property int a",
    ),
    "ply: unknown type": (ply("element vertex 1\nproperty quad x\n", b"0\n"), "property quad x"),
    "ply: indices that are no list": (
        ply(f"{THREE}element face 1\nproperty int vertex_indices\n", f"{POINTS}0\n".encode()),
        "no list 'vertex_indices'",
    ),
    "ply: uneven texture coordinates": (
        ply(
            PLY_UV.format(1),
            f"{POINTS}3 0 1 2 5 0 0 1 0 0\n".encode(),
        ),
        "two numbers for each corner",
    ),
}


@pytest.fixture
def write(tmp_path):
    Image.new("RGB", (2, 2), (9, 99, 199)).save(tmp_path / "a.png")
    (tmp_path / "empty.png").write_bytes(b"")

    def load(name, content):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode("latin-1"))
        return load_mesh(path)

    return load


@pytest.mark.parametrize("case", READ)
def test_what_can_be_read_is_whole(write, case):
    content, said = READ[case]
    mesh = write(f"scene.{case[:3]}", content)
    assert area_m2(mesh) == pytest.approx(0.5)
    assert said in " ".join(mesh.findings)
    assert bool(mesh.findings) == bool(said)


@pytest.mark.parametrize("case", MTL)
def test_odd_materials_are_named_and_lose_no_surface(write, tmp_path, case):
    content, said = MTL[case]
    (tmp_path / "a.mtl").write_bytes(content.encode("latin-1"))
    mesh = write("scene.obj", PAINTED)
    assert area_m2(mesh) == pytest.approx(0.5)
    assert said in " ".join(mesh.findings)
    assert bool(mesh.findings) == bool(said)


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_is_refused_in_one_line(write, case):
    content, said = REFUSED[case]
    with pytest.raises(InputError, match=said) as caught:
        write(f"scene.{case[:3]}", content)
    assert "scene." in str(caught.value)


def test_there_are_more_than_sixty():
    assert len(READ) + len(MTL) + len(REFUSED) >= 60


def sound_glb():
    gltf = triangle_gltf(textured({"alphaMode": "MASK"}), ["a.png"])
    gltf.add("COLOR_0", np.full((3, 4), 200, "u1"), normalized=True)
    gltf.primitive["mode"] = 5
    gltf.header["samplers"] = [{"wrapS": 33648}]
    gltf.header["textures"][0]["sampler"] = 0
    header = gltf.header
    header["buffers"][0].pop("uri")
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(gltf.binary), b"BIN\0") + gltf.binary
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


SOUND = {
    "scene.obj": (PAINTED + "g b\nf -3 -2 -1\nf 1//1 2//1 3//1 2//1\n").encode(),
    "scene.ply": ply(
        PLY_UV.format(2),
        struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
        + struct.pack("<B3iB6f", 3, 0, 1, 2, 6, 0, 0, 1, 0, 0, 1)
        + struct.pack("<B4iB8f", 4, 0, 1, 2, 0, 8, *range(8)),
        "binary_little_endian",
    ),
    "scene.glb": sound_glb(),
}
EDITS = st.lists(
    st.tuples(st.floats(0, 1, exclude_max=True), st.binary(max_size=4), st.integers(0, 6)),
    min_size=1,
    max_size=4,
)


@pytest.mark.parametrize("name", SOUND)
@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(edits=EDITS)
def test_any_edit_of_the_bytes_is_read_or_refused(write, tmp_path, name, edits):
    (tmp_path / "a.mtl").write_text(KD + "map_Kd -s 2 2 a.png\nd 0.9\n")
    content = SOUND[name]
    for share, new, n_gone in edits:
        at = int(share * len(content))
        content = content[:at] + new + content[at + n_gone :]
    try:
        mesh = write(name, content)
    except InputError:
        return
    assert np.isfinite(area_m2(mesh))
    assert all(part.faces.max() < len(part.vertices_m) for part in mesh.parts)
