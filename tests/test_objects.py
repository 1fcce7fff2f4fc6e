"""Objects that stand about: whether they touch anything, by linear programming and by points."""

import numpy as np
import pytest
import yaml
from scipy.optimize import linprog

from synfeal.dataset.pose_table import read_pose_table
from synfeal.files import read_json
from synfeal.scenes.objects import meets_box
from tests.collected import collect, save_room


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


@pytest.mark.filterwarnings("ignore::DeprecationWarning:OpenGL.*")
def test_objects_touch_neither_each_other_nor_the_room_nor_a_path(tmp_path):
    mesh, layout = save_room(tmp_path / "room.glb"), tmp_path / "clutter.yaml"
    layout.write_text(yaml.safe_dump({"count": 12, "size_m": [0.3, 0.9]}))
    assert collect(mesh, tmp_path / "set", "--clutter", str(layout)) == 0
    places = read_json(tmp_path / "set" / "manifest.json")["clutter"]
    assert len(places) == 12

    axes = np.linspace(-1, 1, 15)
    filled = np.stack(np.meshgrid(axes, axes, axes), axis=-1).reshape(-1, 3)
    boxes = []
    for place in places:
        half = np.array(place["size_m"]) / 2
        centre = place["position_m"] + np.array([0, 0, half[2]])
        boxes.append((centre, half, turn(np.radians(place["yaw_deg"]))))
    for index, (centre, half, rotation) in enumerate(boxes):
        points = filled * half @ rotation.T + centre
        assert (np.abs(points) <= [3.0, 2.5, 1.5 + 1e-6]).all()  # the room is about the origin
        for other in boxes[:index]:
            assert not within(points, *other).any()
    poses = read_pose_table(tmp_path / "set" / "train.csv")
    steps = np.diff(poses.position_m, axis=0)[:, None] * np.linspace(0, 1, 50)[:, None]
    along = (poses.position_m[:-1, None] + steps)[np.diff(poses.path) == 0].reshape(-1, 3)
    assert not any(within(along, *box).any() for box in boxes)


def within(points, centre, half, rotation):
    return (np.abs((points - centre) @ rotation) < half - 1e-3).all(axis=1)


@pytest.mark.parametrize(
    ("layout", "message"),
    [
        ({"size_m": [20, 30]}, "larger than the scene"),
        ({"count": 200, "size_m": [1.5, 1.6]}, "no place left"),
        ({"files": ["mug.glb"]}, "mug.glb"),
        ({"size_m": [2, 1]}, "--clutter: size_m"),
    ],
)
def test_a_layout_that_cannot_be_is_one_line(layout, message, tmp_path, capsys):
    mesh, file = save_room(tmp_path / "room.glb"), tmp_path / "clutter.yaml"
    file.write_text(yaml.safe_dump(layout))
    assert collect(mesh, tmp_path / "set", "--clutter", str(file)) == 1
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert message in line
    assert not (tmp_path / "set").exists()
