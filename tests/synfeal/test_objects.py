"""Objects that stand about: whether they touch anything, by linear programming and by points."""

import numpy as np
import pandas as pd
import pytest
import trimesh
import yaml
from scipy.optimize import linprog

from synfeal.collection.prepare import save_cartons
from synfeal.config.dataset import RenderConfig
from synfeal.config.effects import EffectsConfig
from synfeal.dataset.pose_table import read_pose_table
from synfeal.dataset.sevenscenes import frame_paths, read_split
from synfeal.effects.scene import crowd_of
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.save import save_glb
from synfeal.mesh.standing import PATH_CLEARANCE_M, meets_box
from synfeal.records.files import file_sha256, read_json
from tests.support.collected import collect, save_room

C = "color.png"
ENDS = (("x", "y", "z"), ("size_x", "size_y", "size_z"))


def turn(yaw_rad):
    cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])


def test_a_triangle_meets_a_box_where_a_point_is_in_both():
    rng = np.random.default_rng(0)
    centre, half, yaw = np.array([0.3, -0.2, 1.0]), np.array([0.5, 0.2, 0.4]), 0.7
    corners = centre + rng.normal(0, 0.9, (250, 3, 3))
    found = meets_box(corners, centre, half, yaw)
    for triangle, meets in zip(corners, found, strict=True):
        inside = turn(yaw).T @ (triangle - centre).T  # (3, 3): its corners in columns
        program = linprog(
            np.zeros(3),
            A_ub=np.concatenate([inside, -inside]),
            b_ub=np.concatenate([half, half]),
            A_eq=np.ones((1, 3)),
            b_eq=[1.0],
        )
        assert meets == (program.status == 0)
    assert 50 < found.sum() < 200


def test_objects_touch_neither_each_other_nor_the_room_nor_a_path(tmp_path):
    mesh, layout = save_room(tmp_path / "room.glb"), tmp_path / "clutter.yaml"
    layout.write_text(yaml.safe_dump({"count": 12, "size_m": [0.3, 0.9]}))
    assert collect(mesh, tmp_path / "set", "--clutter", str(layout)) == 0
    places = read_json(tmp_path / "set" / "manifest.json")["clutter"]
    assert len(places) == 12

    keys = ("position_m", "size_m", "yaw_deg")
    boxes = [box_of(*(place[key] for key in keys)) for place in places]
    check_boxes(boxes)
    poses = read_pose_table(tmp_path / "set" / "train.csv")
    assert not any(within(along(poses), *box).any() for box in boxes)


def test_every_path_has_objects_of_its_own_out_of_the_cameras_way(tmp_path):
    mesh, settings = save_room(tmp_path / "room.glb"), tmp_path / "effects.yaml"
    post = save_post(tmp_path / "post.glb", (0.3, 0.3, 2.5))  # as high as cameras are
    clutter = {"count": 12, "files": [str(post)]}
    settings.write_text(yaml.safe_dump({"clutter": clutter}))
    short = ("--spacing", "0.5")  # many paths
    assert collect(mesh, tmp_path / "bare", *short) == 0
    assert collect(mesh, tmp_path / "set", *short, "--effects", str(settings)) == 0
    apart = (*short, "--sequence-frames", "7", "--cores", "2")
    assert collect(mesh, tmp_path / "again", "--effects", str(settings), *apart) == 0
    frames = {
        name: [path.read_bytes() for path in frame_paths(read_split(tmp_path / name, "train"), C)]
        for name in ("bare", "set", "again")
    }
    assert frames["set"] == frames["again"]
    assert frames["set"] != frames["bare"]

    table = pd.read_csv(tmp_path / "set" / "train.objects.csv")
    hashes = read_json(tmp_path / "set" / "manifest.json")["effects_sha256"]
    assert hashes["train.objects.csv"] == file_sha256(tmp_path / "set" / "train.objects.csv")
    poses = read_pose_table(tmp_path / "set" / "train.csv")
    layouts = dict(list(table.groupby("path")))
    assert set(layouts) == set(poses.path.tolist())
    assert table.groupby("path").x_m.first().is_unique
    for path, layout in layouts.items():
        columns = [layout[[f"{axis}_m" for axis in end]].to_numpy() for end in ENDS]
        boxes = [box_of(*row) for row in zip(*columns, layout.yaw_deg, strict=True)]
        check_boxes(boxes)
        passed = along(poses.at(np.flatnonzero(poses.path == path)))
        for centre, half, rotation in boxes:
            assert not within(passed, centre, half + PATH_CLEARANCE_M, rotation).any()


def test_built_in_objects_are_cartons(tmp_path):
    mesh = save_room(tmp_path / "room.glb")
    save_cartons(mesh)
    crowd = crowd_of(mesh, RenderConfig(effects=EffectsConfig.model_validate({"clutter": {}})))
    assert crowd is not None
    path = np.array([[-1.0, 0, 0], [1, 0, 0]])
    found = crowd.along(path, np.random.default_rng(0))
    assert [place["name"] for _, place in found] == [f"carton_{n}" for n in range(8)]
    feet_m = {p.name: p.vertices_m[:, 2].min() for parts, _ in found for p in parts}
    lowest = [feet_m[f"object-{number}"] for number in (0, 7)]
    assert lowest == pytest.approx([-1.5, -1.5], abs=0.003)  # on the floor


def box_of(foot_m, size_m, yaw_deg):
    half = np.array(size_m, float) / 2
    return np.array(foot_m, float) + [0, 0, half[2]], half, turn(np.radians(yaw_deg))  # noqa: RUF005


def check_boxes(boxes):
    """All lie in the room, and none in another."""
    axes = np.linspace(-1, 1, 15)
    filled = np.stack(np.meshgrid(axes, axes, axes), axis=-1).reshape(-1, 3)
    for index, (centre, half, rotation) in enumerate(boxes):
        points = filled * half @ rotation.T + centre
        assert (np.abs(points) <= [3.0, 2.5, 1.5 + 1e-6]).all()  # the room is about the origin
        for other in boxes[:index]:
            assert not within(points, *other).any()


def along(poses):
    """Points (M, 3) of the way between frames of a path."""
    steps = np.diff(poses.position_m, axis=0)[:, None] * np.linspace(0, 1, 50)[:, None]
    return (poses.position_m[:-1, None] + steps)[np.diff(poses.path) == 0].reshape(-1, 3)


def within(points, centre, half, rotation):
    return (np.abs((points - centre) @ rotation) < half - 1e-3).all(axis=1)


@pytest.mark.parametrize(
    ("option", "layout", "message"),
    [
        ("--clutter", {"size_m": [20, 30]}, "larger than the scene"),
        ("--clutter", {"count": 200, "size_m": [1.5, 1.6]}, "no place left"),
        ("--clutter", {"files": ["mug.glb"]}, "mug.glb"),
        ("--clutter", {"size_m": [2, 1]}, "--clutter: size_m"),
        ("--effects", {"clutter": {"files": ["mug.glb"]}}, "mug.glb"),
        ("--effects", {"clutter": {"files": ["{mast}"]}}, "mast is 0.1 x 0.1 x 40 m, larger than"),
    ],
)
def test_a_layout_that_cannot_be_is_one_line(option, layout, message, tmp_path, capsys):
    mesh, file = save_room(tmp_path / "room.glb"), tmp_path / "settings.yaml"
    mast = save_post(tmp_path / "mast.glb", (0.1, 0.1, 40))
    file.write_text(yaml.safe_dump(layout).replace("{mast}", str(mast)))
    assert collect(mesh, tmp_path / "set", option, str(file)) == 1
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert message in line
    assert not (tmp_path / "set").exists()


def save_post(path, size_m):
    post = trimesh.creation.box(size_m)
    grey = np.full((8, 3), 128, np.uint8)
    part = MeshPart("post", np.asarray(post.vertices), np.asarray(post.faces), vertex_rgb=grey)
    save_glb(path, TexturedMesh((part,)))
    return path
