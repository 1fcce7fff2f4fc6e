"""``synfeal validate`` is right on right sets, however they were collected, and on blank ones."""

import shutil
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from synfeal.cli import main
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.save import save_glb
from synfeal.validation.consistency import MEASURES, Pair, measure_check
from synfeal.validation.listing import Frame
from synfeal.validation.reprojection import Residual
from tests.damaged_sets import (
    copy_of_first_frames,
    depth_in_centimetres,
    depth_in_metres,
    frame_files,
    swapped_colours,
    swapped_frames,
    without_manifest_hashes,
    write_planar_set,
)
from tests.small_room import furnished_room

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning:OpenGL.*")

PAINT_TEXELS = (2.0, 8.0, 24.0)
BOX_M = np.array([0.4, 4.6, 0.4, 3.6, 0.8, 2.0])
FAR_M = np.array([432_100.0, -87_654.0, 321.0])  # as map coordinates


def moved(mesh, offset_m):
    parts = [
        MeshPart(
            *(part.name, part.vertices_m + offset_m, part.faces, part.uv, part.texture),
            *(part.vertex_rgb, part.base_color, part.alpha_cutoff),
        )
        for part in mesh.parts
    ]
    return TexturedMesh(tuple(parts))


def verdicts(folder, capsys):
    """Names of the checks and the lines of the report; exit status is that of the verdicts."""
    capsys.readouterr()
    status = main(["validate", str(folder)])
    lines = capsys.readouterr().out.splitlines()[1:]
    assert bool(status) == any(" FAILED " in line for line in lines)
    return {line.split()[0]: line for line in lines}


@pytest.mark.parametrize(
    ("options", "offset_m"),
    [
        (["--mode", "random"], 0.0 * FAR_M),
        (["--spacing", "1"], 0.0 * FAR_M),
        (["--mode", "random", "--fov", "100"], 0.0 * FAR_M),
        (["--spacing", "0.1"], FAR_M),
    ],
    ids=["random", "1 m apart", "wide", "far from the origin"],
)
def test_a_faultless_set_passes(options, offset_m, tmp_path, capsys):
    save_glb(tmp_path / "room.glb", moved(furnished_room(PAINT_TEXELS), offset_m))
    box = [f"{value:.2f}" for value in BOX_M + np.repeat(offset_m, 2)]
    out = tmp_path / "set"
    arguments = ["collect", "--mesh", str(tmp_path / "room.glb"), "--out", str(out), "--depth"]
    size = ["--frames", "60", "--test-frames", "4", "--width", "96", "--height", "72"]
    assert main([*arguments, *size, "--box", *box, *options]) == 0
    found = verdicts(out, capsys)
    assert not [line for line in found.values() if " FAILED " in line]
    assert " ok " in found["depth"]
    assert " ok " in found["tables"]
    assert " ok " in found["camera"]


@pytest.fixture(scope="module")
def small_random(tmp_path_factory):
    """Independent poses, 64 x 48: few pairs of frames see the same, and few pixels of it."""
    folder = tmp_path_factory.mktemp("random")
    save_glb(folder / "room.glb", furnished_room(PAINT_TEXELS))
    out, box = folder / "set", [f"{value:.2f}" for value in BOX_M]
    arguments = ["collect", "--mesh", str(folder / "room.glb"), "--out", str(out), "--depth"]
    size = ["--frames", "60", "--width", "64", "--height", "48"]
    assert main([*arguments, *size, "--mode", "random", "--box", *box]) == 0
    without_manifest_hashes(out)
    return out


@pytest.mark.parametrize(
    ("change", "failing"),
    [
        (None, set()),
        (depth_in_metres, {"images", "pairs"}),
        (depth_in_centimetres, {"pairs"}),
        (swapped_frames, {"depth", "surfaces"}),
        (swapped_colours, {"colours"}),
    ],
)
def test_independent_poses_are_told_right_from_wrong_in_small_images(
    change, failing, small_random, tmp_path, capsys
):
    copied = Path(shutil.copytree(small_random, tmp_path / "set"))
    if change is not None:
        change(copied)
    found = verdicts(copied, capsys)
    del found["manifest"]  # without its hashes, so that only geometry can tell
    assert {name for name, line in found.items() if " FAILED " in line} == failing


@pytest.fixture
def planar(tmp_path):
    write_planar_set(tmp_path / "whole")
    copied = copy_of_first_frames(tmp_path / "whole", tmp_path / "set", (24, 8))
    shutil.rmtree(tmp_path / "whole")
    return copied


def black(folder, count):
    for path in frame_files(folder, "color.png")[:count]:
        Image.new("RGB", (96, 72)).save(path)


def grey(folder, count):
    for path in frame_files(folder, "color.png")[:count]:
        Image.new("RGB", (96, 72), (102, 102, 102)).save(path)


def two_thirds_without_depth(folder, count):
    for path in frame_files(folder, "depth.png")[:count]:
        depth = np.asarray(Image.open(path)).copy()
        depth[: 2 * len(depth) // 3] = 65535
        Image.fromarray(depth).save(path)


@pytest.mark.parametrize(
    ("change", "count", "words"),
    [
        (black, 24, ["of one colour", "24 of 32", "frame-000000.color.png"]),
        (grey, 24, ["of one colour", "24 of 32"]),
        (grey, 1, []),
        (two_thirds_without_depth, 24, ["more than half empty", "24 of 32"]),
        (two_thirds_without_depth, 8, []),
    ],
)
def test_blank_frames_are_found_where_they_are_many(change, count, words, planar, capsys):
    without_manifest_hashes(planar)
    change(planar, count)
    assert main(["validate", str(planar)]) in (0, 1)
    captured = capsys.readouterr()
    (line,) = [line for line in captured.out.splitlines() if line.startswith("content")]
    assert ("FAILED" in line) == bool(words)
    errors = [text for text in captured.err.splitlines() if text.startswith("error: content: ")]
    assert len(errors) == bool(words)
    assert all(word in errors[0] for word in words)


def test_a_quaternion_of_the_other_sign_is_told(planar, capsys):
    path = planar / "train.csv"
    header, first, *rows = path.read_text().splitlines()
    cells = first.split(",")
    cells[5:] = [repr(-float(cell)) for cell in cells[5:]]
    path.write_text("\n".join([header, ",".join(cells), *rows]) + "\n")
    assert main(["validate", str(planar)]) == 1
    (line,) = [li for li in capsys.readouterr().err.splitlines() if li.startswith("error: ")]
    assert all(word in line for word in ["tables: ", "train.csv: row 2", "qw < 0", "qw >= 0"])


@pytest.mark.parametrize(("wrong", "failed"), [({(3, 4)}, False), ({(2, 3), (3, 4)}, True)])
def test_a_frame_is_wrong_where_it_disagrees_with_most_not_with_one(wrong, failed):
    """Frame 3 has two neighbours; of right frames one can be hidden behind an edge."""
    frames = [Frame(Path("seq-01"), number) for number in range(6)]
    pairs = [
        Pair(a, b, Residual(overlap=0.9, hidden=False, depth=82.0 if (i, i + 1) in wrong else 0.2))
        for i, (a, b) in enumerate(pairwise(frames))
    ]
    check = measure_check(MEASURES[0], pairs)
    assert bool(check.failures) == failed
    assert not failed or "frame-000003.depth.png" in check.failures[0]
