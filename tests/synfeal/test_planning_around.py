"""Cameras around photographs, in a corridor round a corner whose walls are known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError
from scipy.spatial import cKDTree

from synfeal.collection.settings import collect_config
from synfeal.config.collection import CollectionConfig, SceneConfig
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.rays import RayCaster
from synfeal.planning.around import LOOK_ANYWHERE
from synfeal.planning.plan import plan_split
from synfeal.records.files import write_json
from tests.support.empty_room import mesh_of

Array = NDArray[np.float64]

# An L of two corridors, 1.2 m wide and 10 m long, from which a block of the house is left.
HOUSE = np.array([[0.0, 0.0, 0.0], [10.0, 10.0, 2.5]])
BLOCK = np.array([[1.2, 1.2, 0.0], [10.0, 10.0, 2.5]])
ENDS = 1.0, 9.4
RADIUS_M, TURN_DEG = 0.9, 15.0  # wider than half a corridor, so that walls are in the way


def in_corridors(points: Array) -> NDArray[np.bool_]:
    house = ((points > HOUSE[0]) & (points < HOUSE[1])).all(axis=1)
    return house & ~((points > BLOCK[0]) & (points < BLOCK[1])).all(axis=1)


def photographs() -> Array:
    """Poses of someone who walks through both corridors, and stands still for half of the time."""
    along = np.linspace(*ENDS, 40)
    first = np.stack([along[::-1], np.full(40, 0.6), np.full(40, 1.5)], axis=1)
    second = first[::-1, [1, 0, 2]]
    position = np.concatenate([first, np.tile(first[-1], (80, 1)), second])
    yaw = np.repeat([np.pi, 0.75 * np.pi, 0.5 * np.pi], [40, 80, 40])
    return pose_matrix(rotation_from_rpy(np.outer(yaw, [0.0, 0.0, 1.0])), position)


def write_photographs(folder: Path, world_from_cam: Array) -> None:
    folder.mkdir()
    for number, pose in enumerate(world_from_cam):
        np.savetxt(folder / f"frame-{number:06d}.pose.txt", pose)
        (folder / f"frame-{number:06d}.color.png").write_bytes(b"")


@pytest.fixture(scope="module")
def corridors() -> RayCaster:
    return RayCaster(*mesh_of(HOUSE, BLOCK))


@pytest.fixture(scope="module")
def sequence(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("around") / "walk"
    write_photographs(folder, photographs())
    return folder


def planned(
    caster: RayCaster, sequence: Path, n_frames: int, mesh: Path = Path("house.glb"), seed: int = 0
) -> Array:
    """Plan poses (N, 4, 4) around photographs."""
    scene = SceneConfig.model_validate({"source": "mesh", "path": mesh, "min_view_distance_m": 0.5})
    collection = CollectionConfig(
        mode="around", repeat=sequence, around_m=RADIUS_M, around_turn_deg=TURN_DEG, max_tries=20
    )
    rng = np.random.default_rng(seed)
    return plan_split(caster, HOUSE, scene, collection, n_frames, rng).world_from_cam


def test_cameras_are_near_photographs_and_never_behind_a_wall(
    corridors: RayCaster, sequence: Path
) -> None:
    poses = planned(corridors, sequence, 1000)
    position, walked = poses[:, :3, 3], photographs()[:, :3, 3]
    distance_m, _ = cKDTree(walked).query(position)
    assert distance_m.max() <= RADIUS_M
    # A fifth of the space within reach lies behind walls, and none of the cameras.
    assert in_corridors(position).all()
    # Four fifths of the box around the photographs are the house's block, where nobody walks.
    assert not ((position > BLOCK[0]) & (position < BLOCK[1])).all(axis=1).any()
    # All of the walk has cameras, wherever people stood still.
    assert cKDTree(position).query(walked)[0].max() < 0.5
    in_corner = (position[:, :2] < 1.2).all(axis=1).mean()
    assert in_corner < 0.15


def test_cameras_fill_what_is_within_reach_evenly(sequence: Path) -> None:
    """Where nothing is in the way: of a straight walk they fill a round tube."""
    house = RayCaster(*mesh_of([[-5.0, -5.0, -5.0], [15.0, 15.0, 8.0]]))
    position = planned(house, sequence, 4000)[:, :3, 3]
    tube = position[(position[:, 0] > 3.0) & (position[:, 0] < 8.0)]
    radius_m = np.hypot(tube[:, 1] - 0.6, tube[:, 2] - 1.5)
    # Of a disc, half of the area lies within 0.707 of the radius.
    assert np.mean(radius_m < RADIUS_M * np.sqrt(0.5)) == pytest.approx(0.5, abs=0.04)
    along = np.histogram(tube[:, 0], bins=5, range=(3.0, 8.0))[0] / len(tube)
    np.testing.assert_allclose(along, 0.2, atol=0.04)


def test_most_cameras_look_where_a_near_photograph_did(sequence: Path) -> None:
    house = RayCaster(*mesh_of([[-5.0, -5.0, -5.0], [15.0, 15.0, 8.0]]))
    poses, shot = planned(house, sequence, 2000), photographs()
    near = np.linalg.norm(poses[:, None, :3, 3] - shot[:, :3, 3], axis=2) <= RADIUS_M
    # Angle between rotations: their matrices' product has the trace 1 + 2 cos.
    trace = np.einsum("nij,pij->np", poses[:, :3, :3], shot[:, :3, :3])
    angle_deg = np.degrees(np.arccos(np.clip((trace - 1.0) / 2.0, -1.0, 1.0)))
    turn_deg = np.where(near, angle_deg, np.inf).min(axis=1)
    # Headings of the rest are drawn from a whole turn, of which some fall within the bound too.
    assert np.mean(turn_deg <= TURN_DEG + 1e-3) == pytest.approx(1 - LOOK_ANYWHERE, abs=0.06)
    assert np.percentile(turn_deg, 95) > 90.0


def test_a_shorter_plan_is_the_beginning_of_a_longer_one(
    corridors: RayCaster, sequence: Path
) -> None:
    long = planned(corridors, sequence, 700)
    np.testing.assert_array_equal(planned(corridors, sequence, 30), long[:30])
    assert not np.array_equal(planned(corridors, sequence, 30, seed=1), long[:30])


def test_photographs_of_a_scan_are_moved_into_its_world(
    corridors: RayCaster, tmp_path: Path
) -> None:
    sequence_from_world = pose_matrix(rotation_from_rpy([0.3, -0.8, 2.0]), np.array([7.0, -3, 2]))
    write_photographs(tmp_path / "walk", sequence_from_world @ photographs())
    record = {"sequence_from_world": sequence_from_world.tolist()}
    write_json(tmp_path / "house.json", record)
    poses = planned(corridors, tmp_path / "walk", 50, tmp_path / "house.glb")
    assert in_corridors(poses[:, :3, 3]).all()


def test_photographs_elsewhere_are_refused(corridors: RayCaster, tmp_path: Path) -> None:
    away = photographs()
    away[:, :3, 3] += 30.0
    write_photographs(tmp_path / "walk", away)
    with pytest.raises(InputError, match=r"no pose within 0\.9 m of the photographs"):
        planned(corridors, tmp_path / "walk", 5)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"mode": "around"}, "mode `around` needs posed photographs"),
        ({"mode": "random", "around_m": 0.5}, "around_m: goes with mode `around`"),
    ],
)
def test_settings_that_do_not_go_together(settings: dict[str, object], said: str) -> None:
    with pytest.raises(ValidationError, match=said):
        CollectionConfig.model_validate(settings)


@pytest.mark.parametrize(
    "option", [{"margin_m": 0.3}, {"like_range": (0, 5)}], ids=["margin", "range"]
)
def test_options_of_the_box_are_refused(
    option: dict[str, object], sequence: Path, tmp_path: Path
) -> None:
    mesh = tmp_path / "house.glb"
    mesh.write_bytes(b"")
    asked = {"mesh": mesh, "frames": 5, "like": sequence, "mode": "around", **option}
    with pytest.raises(InputError, match='does not go with `mode="around"`'):
        collect_config(asked)
