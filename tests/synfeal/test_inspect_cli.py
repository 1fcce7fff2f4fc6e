"""``synfeal inspect`` as a person uses it."""

import contextlib
import hashlib
import io
import json

import numpy as np
import pytest
import trimesh
import yaml
from PIL import Image

from synfeal.cli import main
from synfeal.config.collection import CollectionConfig, SceneConfig
from synfeal.inspection.run import top_view
from synfeal.inspection.text import snippet
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.save import save_glb
from tests.support.collected import painted

BOX = ("--box", "-2.9", "2.9", "-2.5", "2.5", "-1.5", "1.5")
OUTPUTS = ["inspect.html", "inspect.json", "inspect.png"]


@pytest.fixture(scope="module")
def mesh(tmp_path_factory):
    """A closed room of 6 x 5 x 3 m whose walls face inwards."""
    box = trimesh.creation.box((6.0, 5.0, 3.0)).subdivide().subdivide()
    path = tmp_path_factory.mktemp("mesh") / "My Room.glb"
    save_glb(path, painted(box, inwards=True))
    return path


@pytest.fixture(scope="module")
def inspected(mesh, tmp_path_factory):
    """A directory the command was called in, with its default output, and what it printed."""
    folder = tmp_path_factory.mktemp("called")
    printed = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(printed):
        assert main(["inspect", str(mesh), *BOX]) == 0
    return folder / "My Room-inspect", printed.getvalue()


def test_files_and_numbers_are_those_of_the_room_and_what_is_printed_can_be_pasted(inspected, mesh):
    out, printed = inspected
    assert sorted(path.name for path in out.iterdir()) == OUTPUTS
    assert (out / "inspect.html").stat().st_size < 10e6
    with Image.open(out / "inspect.png") as picture:
        assert picture.width == 1600
        assert 800 <= picture.height <= 1000
    facts = json.loads((out / "inspect.json").read_text())
    assert facts["properties"]["volume_m3"] == pytest.approx(90.0)
    assert facts["topology"]["watertight"] is True
    assert facts["topology"]["enclosed_volume_m3"] == pytest.approx(-90.0)
    assert facts["detail"]["area_m2"]["colored_by_vertex"] == pytest.approx(126.0)
    assert facts["free_space"]["box_m"] == [[-2.9, -2.5, -1.5], [2.9, 2.5, 1.5]]
    assert facts["free_space"]["volume_m3"] == pytest.approx(5.8 * 5.0 * 3.0, rel=0.03)
    assert facts["mesh"]["sha256"] == hashlib.sha256(mesh.read_bytes()).hexdigest()
    assert facts["doubts"] == []
    assert printed.isascii()
    assert "90.00 m^3" in printed
    text = printed[printed.index("  my_room:") :].split("\n\n")[0]
    scene = SceneConfig.model_validate(yaml.safe_load("scenes:\n" + text)["scenes"]["my_room"])
    assert scene.path == mesh
    assert scene.sampling_box is not None
    box = [scene.sampling_box.x, scene.sampling_box.y, scene.sampling_box.z]
    np.testing.assert_allclose(box, [[-2.7, 2.7], [-2.2, 2.2], [-0.7, 0.5]], atol=0.2)


def test_a_scene_to_paste_asks_no_more_of_poses_than_the_command_does(inspected):
    facts = json.loads((inspected[0] / "inspect.json").read_text())
    assert "min_view_distance_m" not in snippet(facts)  # the default
    facts["collect"] |= {"min_view_distance_m": 0.6, "min_path_m": 0.7}
    text = snippet(facts)
    (scene,) = yaml.safe_load("scenes:\n" + text)["scenes"].values()
    assert SceneConfig.model_validate(scene).min_view_distance_m == 0.6
    (beside,) = (line for line in text.splitlines() if "beside scenes: collection" in line)
    collection = yaml.safe_load(beside.partition("scenes: ")[2])["collection"]
    assert CollectionConfig.model_validate(collection).min_path_m == 0.7


def test_the_top_view_shows_the_floor_in_its_place():
    corners = np.array([[0.0, 0, 0], [4, 0, 0], [4, 2, 0], [0, 2, 0]])
    two = np.array([[0, 1, 2], [0, 2, 3]])

    def plate(offset, side, rgb):
        color = np.array([*rgb, 255], np.uint8)
        return MeshPart("plate", corners * side + offset, two, base_color=color)

    floor, ceiling = plate([0, 0, 0], 1.0, (0, 0, 255)), plate([0, 0, 3], 1.0, (9, 9, 9))
    rug = plate([2.8, 1.4, 0.1], 0.2, (255, 0, 0))
    view = top_view(TexturedMesh((floor, ceiling, rug)), 1.5)
    x0, x1, y0, y1 = view.extent_m
    height, width = view.rgb.shape[:2]

    def seen(x, y):
        column, row = (x - x0) / (x1 - x0) * width, (y1 - y) / (y1 - y0) * height
        return view.rgb[int(row), int(column)].tolist()

    assert x0 < 0 < 4 < x1
    assert seen(1.0, 1.0) == [0, 0, 255]
    assert seen(3.2, 1.6) == [255, 0, 0]
    assert seen(2.7, 1.6) == seen(3.2, 1.3) == [0, 0, 255]
    assert seen(-0.05, 1.0) == [255, 255, 255]
