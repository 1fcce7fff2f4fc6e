"""Overlaps and flow against rays at every triangle, and the command that writes them."""

import json

import numpy as np
import pytest

import synfeal
from synfeal.camera.projection import cell_centres_px
from synfeal.cli import main
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.frame_files import encode_png
from synfeal.dataset.sevenscenes import Sequence, pose_text, write_splits
from synfeal.errors import InputError
from synfeal.geometry.poses import inverse, pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.pairing import overlap
from synfeal.pairing.choose import Choice
from synfeal.pairing.correspondence import DepthImage, State
from synfeal.pairing.flow import Flow, flow_between, read_flows, write_flows
from synfeal.pairing.overlap import grid_points, overlaps_with
from synfeal.pairing.run import read_pairs
from synfeal.records.files import write_json
from tests.support.brute_rays import Truth, first_hits
from tests.support.collected import collect, refused, save_room
from tests.support.ray_scenes import SCENES, scene
from tests.support.small_room import camera_of

PINHOLE = {"fx": 40.0, "fy": 42.0, "cx": 23.0, "cy": 19.0}
LENS = {**PINHOLE, "distortion": (-0.25, 0.06, 2e-3, -1e-3, 0.0)}
STEP = pose_matrix(rotation_from_rpy([0.05, -0.1, 0.25]), [0.5, -0.35, 0.1])
SIZE = {"width": 48, "height": 36}


def distorted(camera, place):
    """Brown and Conrady's formulas for points (..., 2), as OpenCV's manual prints them."""
    k1, k2, p1, p2, k3 = camera.distortion
    x, y = place[..., 0], place[..., 1]
    r2 = x**2 + y**2
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    x_seen = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x**2)
    y_seen = y * radial + p1 * (r2 + 2 * y**2) + 2 * p2 * x * y
    return np.stack([x_seen, y_seen], axis=-1)


def rays_through(camera):
    """Rays of pixels by fixed-point iteration."""
    fx, fy, cx, cy = camera.intrinsics

    def rays_of(pixel):
        target = (pixel - [cx, cy]) / [fx, fy]
        place = target
        for _ in range(60):
            place = place + target - distorted(camera, place)
        return np.concatenate([place, np.ones_like(place[..., :1])], axis=-1)

    return rays_of


def project(camera, in_cam):
    fx, fy, cx, cy = camera.intrinsics
    place = in_cam[..., :2] / in_cam[..., 2:]
    return distorted(camera, place) * [fx, fy] + [cx, cy]


class CastPair:
    """Two frames of a scene and, by rays, what becomes of the pixels of the first in the second."""

    def __init__(self, name, camera):
        mesh, self.pose_a = scene(name)
        forward = self.pose_a[:3, :3] @ np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]]).T
        self.pose_b = self.pose_a.copy()
        self.pose_b[:3, :3] = forward @ STEP[:3, :3]
        self.pose_b[:3, 3] += forward @ STEP[:3, 3]
        rays_of = rays_through(camera)
        self.a, self.b = (Truth(mesh, camera, pose, rays_of) for pose in (self.pose_a, self.pose_b))
        pixel = cell_centres_px(camera, camera.width, camera.height)
        with np.errstate(invalid="ignore"):
            self.point = (self.a.depth_m[..., None] * rays_of(pixel)) @ self.pose_a[:3, :3].T
        self.point += self.pose_a[:3, 3]
        known = np.isfinite(self.a.depth_m)
        cam_from_b = inverse(self.pose_b)
        in_b = self.point @ cam_from_b[:3, :3].T + cam_from_b[:3, 3]
        ahead = known & (np.nan_to_num(in_b[..., 2]) > 0.0)
        self.pixel_b = np.full((*known.shape, 2), np.nan)
        self.pixel_b[ahead] = project(camera, in_b[ahead])
        size = [camera.width, camera.height]
        with np.errstate(invalid="ignore"):
            inside = ((self.pixel_b >= 0) & (self.pixel_b <= size)).all(axis=-1)
        vertices, faces = mesh.merged()
        way = self.point[inside] - self.pose_b[:3, 3]
        reached, _ = first_hits(vertices[faces], self.pose_b[:3, 3], way)
        self.state = np.where(known, State.OUTSIDE, State.NO_DEPTH)
        # The tolerance: along a ray of b, distances are as depths.
        self.state[inside] = np.where(reached > 0.99, State.VISIBLE, State.HIDDEN)
        self.flow = self.pixel_b - pixel
        self.plain = ~inside | self._between_one_plane(inside, size)

    def _between_one_plane(self, inside, size):
        """Where the four pixels of b around the point show one plane."""
        place = np.where(inside[..., None], self.pixel_b - 0.5, 0.0)
        column, row = np.clip(np.floor(place).astype(int), 0, np.array(size) - 2).transpose(2, 0, 1)
        normal = np.stack([self.b.normal_cam[row + i, column + j] for i in (0, 1) for j in (0, 1)])
        depth = np.stack([self.b.depth_m[row + i, column + j] for i in (0, 1) for j in (0, 1)])
        alike = (np.abs(normal - normal[0]).max(axis=(0, 3)) < 1e-6) & np.isfinite(depth).all(0)
        return alike & (depth.max(axis=0) < 1.15 * depth.min(axis=0))


@pytest.fixture(scope="module", params=[(name, lens) for name in SCENES for lens in (False, True)])
def cast(request):
    name, lens = request.param
    camera = camera_of(**SIZE, **(LENS if lens else PINHOLE))
    return camera, CastPair(name, camera)


def in_millimetres(depth_m):
    return np.round(1000.0 * depth_m) / 1000.0


def test_flow_and_what_is_hidden_are_those_of_rays(cast):
    """Everywhere but where b shows more than one plane around the point, in depth as stored."""
    camera, pair = cast
    exact = flow_between(camera, pair.a.depth_m, pair.pose_a, pair.b.depth_m, pair.pose_b)
    depth_a, depth_b = (in_millimetres(each.depth_m) for each in (pair.a, pair.b))
    found = flow_between(camera, depth_a, pair.pose_a, depth_b, pair.pose_b)
    known = np.isfinite(pair.flow).all(axis=-1)
    np.testing.assert_array_equal(np.isfinite(exact.flow_px).all(axis=-1), known)
    near = known & (np.abs(pair.flow) < 500.0).all(axis=-1)
    assert np.abs(exact.flow_px - pair.flow)[near].max() < 1e-3
    assert np.median(np.abs(found.flow_px - pair.flow)[near]) < 0.01
    assert pair.plain.mean() > 0.5
    for each in (exact, found):
        assert (each.state == pair.state)[pair.plain].mean() > 0.995
        assert (each.state == pair.state).mean() > 0.96
    assert len(np.unique(pair.state)) >= 3


@pytest.mark.parametrize("at_once", [1, 10**6])
def test_overlap_is_the_share_that_rays_reach(cast, monkeypatch, at_once):
    monkeypatch.setattr(overlap, "POINTS_AT_ONCE", at_once)
    camera, pair = cast
    depths = [in_millimetres(each.depth_m).astype(np.float32) for each in (pair.a, pair.b)]
    poses = np.stack([pair.pose_a, pair.pose_b])
    every_pixel = (camera.width, camera.height)
    points = grid_points(camera, depths.__getitem__, poses, every_pixel, lambda: None)
    found = overlaps_with(points, [0, 1], camera, DepthImage(depths[1]), pair.pose_b, 0.01)
    known = pair.state != State.NO_DEPTH
    expected = np.mean(pair.state[known] == State.VISIBLE)
    assert found[0] == pytest.approx(expected, abs=0.05)
    assert found[1] == 1.0  # with itself
    coarse = grid_points(camera, depths.__getitem__, poses, (16, 12), lambda: None)
    few = overlaps_with(coarse, [0], camera, DepthImage(depths[1]), pair.pose_b, 0.01)
    assert few[0] == pytest.approx(expected, abs=0.1)


def shown(depth_m, place, expected_m):
    """Whether an image has these depths there, up to a millimetre."""
    expected_m = np.asarray(expected_m, float)
    return DepthImage(depth_m).shows(np.asarray(place, float), expected_m, 0.001 + 0 * expected_m)


def test_depth_between_pixels_is_exact_on_a_plane():
    column, row = np.meshgrid(np.arange(20) + 0.5, np.arange(10) + 0.5)
    plane = 1.0 / (0.2 + 0.01 * column - 0.005 * row)
    at = np.random.default_rng(0).uniform([0.0, 0.0], [20.0, 10.0], (50, 2))
    expected = 1.0 / (0.2 + 0.01 * at[:, 0] - 0.005 * at[:, 1])
    assert shown(plane, at, expected).all()
    assert not shown(plane, at, expected + 0.002).any()
    assert not shown(plane, at, expected - 0.002).any()


def test_at_an_edge_both_sides_are_shown_and_at_a_crease_what_is_between():
    column, _ = np.meshgrid(np.arange(20) + 0.5, np.arange(10) + 0.5)
    step = np.where(column < 10, 1.0, 4.0)
    step[:, 15:] = np.inf
    edge, rim = [10.1, 5.0], [15.1, 5.0]
    assert shown(step, [edge, edge, rim], [1.0, 4.0, 4.0]).all()
    assert not shown(step, [edge, rim, rim, [17.0, 5.0]], [2.5, 1.0, 9.0, 4.0]).any()
    crease = 4.0 - 0.1 * np.abs(column - 10.2)
    assert shown(crease, [[10.2, 5.0], [5.25, 5.0]], [3.97, 3.505]).all()
    assert not shown(crease, [[10.2, 5.0], [5.25, 5.0]], [3.8, 3.45]).any()


@pytest.mark.parametrize("along", ["x", "y"])
def test_planes_stay_exact_up_to_the_four_pixels_that_a_crease_runs_between(along):
    """The crease is at 10.2, between centres of pixels; depth at 9.25 is that of one plane."""
    column, _ = np.meshgrid(np.arange(20) + 0.5, np.arange(20) + 0.5)
    crease = 4.0 - 0.1 * np.abs(column - 10.2)
    beside, between = np.array([[9.25, 5.0]]), np.array([[9.9, 5.0]])
    if along == "y":
        crease, beside, between = crease.T, beside[:, ::-1], between[:, ::-1]
    assert shown(crease, beside, [3.905]).all()
    assert not shown(crease, beside, [3.85]).any()  # as of pixels beside, but not of this place
    assert shown(crease, between, [3.96]).all()


@pytest.mark.parametrize("turn", [1, -1])
def test_what_lies_along_a_slanting_crease_is_shown_wherever_it_runs(turn):
    """However far it cuts off whichever of four pixels: a ramp begins at it, on a wall."""
    column, row = np.meshgrid(np.arange(20) + 0.5, np.arange(20) + 0.5)
    at = np.random.default_rng(1).uniform(1.0, 19.0, (4000, 2))
    for start in np.linspace(15.0, 16.0, 21):
        ramp = 4.0 / (1.0 + 0.08 * np.maximum(0.0, column + row - start))
        expected_m = 4.0 / (1.0 + 0.08 * np.maximum(0.0, at.sum(axis=1) - start))
        place = at if turn == 1 else np.column_stack([20.0 - at[:, 0], at[:, 1]])
        image = DepthImage(ramp[:, ::turn])
        assert image.shows(place, expected_m, 0.01 * expected_m).all()


def test_choice_keeps_the_greatest_overlaps_of_each_frame():
    first, second = np.triu_indices(4, 1)
    ab = np.array([0.9, 0.5, 0.05, 0.6, 0.4, 0.7], np.float32)
    ba = ab + np.float32(0.05)
    assert Choice(0.1, 1.0).rows(first, second, ab, ba).tolist() == [0, 1, 3, 4, 5]
    assert Choice(0.1, 0.8).rows(first, second, ab, ba).tolist() == [1, 3, 4, 5]
    assert Choice(0.1, 1.0, per_frame=1).rows(first, second, ab, ba).tolist() == [0, 5]
    assert Choice(0.1, 1.0, per_frame=2).rows(first, second, ab, ba).tolist() == [0, 3, 5]


@pytest.fixture(scope="module")
def data_set(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pairs")
    room = save_room(folder / "room.glb")
    assert collect(room, folder / "set", "--depth", "--archive", "--backend", "raycast") == 0
    return folder / "set"


def test_the_command_writes_a_table_a_list_and_flow(data_set, tmp_path, capsys):
    out = tmp_path / "pairs"
    options = ["--per-frame", "3", "--min-overlap", "0.3", "--flow", "--out", str(out)]
    assert main(["pairs", str(data_set), *options]) == 0
    table = read_pairs(out)
    said = f"{len(table)} of {24 * 23 // 2 + 8 * 7 // 2} pairs of 32 frames, with flow"
    assert said in capsys.readouterr().out
    assert (table["split_a"] == table["split_b"]).all()
    assert table[["overlap_ab", "overlap_ba"]].min().min() >= 0.3
    counts = np.unique([*table["image_a"], *table["image_b"]], return_counts=True)[1]
    assert counts.max() == 3
    rows = (out / "pairs.txt").read_text().splitlines()
    assert rows[0] == f"{table['image_a'][0]} {table['image_b'][0]}"
    assert len(rows) == len(table)
    data = synfeal.open_dataset(data_set)
    index = {
        str(file)[len(str(data_set)) + 1 :].replace(".zip", ""): i
        for i, file in enumerate(data.train.images)
    }
    row = table[table["split_a"] == "train"].iloc[0]
    a, b = index[row["image_a"]], index[row["image_b"]]
    poses = data.train.world_from_cam[[a, b]]
    assert row["distance_m"] == pytest.approx(
        np.linalg.norm(np.diff(poses[:, :3, 3], axis=0)), 1e-5
    )
    forth, back = read_flows(out / row["flow"])
    assert forth.flow_px.shape == (33, 40, 2)
    share = np.mean(forth.state[forth.state > 0] == State.VISIBLE)
    assert share == pytest.approx(row["overlap_ab"], abs=0.08)
    # Along the flow and back again is where one began, where both see the point.
    lines, columns = np.nonzero(forth.state == State.VISIBLE)
    there = forth.flow_px[lines, columns] + np.stack([columns, lines], axis=-1)
    there = np.clip(np.round(there).astype(int), 0, [39, 32])
    returned = forth.flow_px[lines, columns] + back.flow_px[there[:, 1], there[:, 0]]
    assert np.nanmedian(np.abs(returned)) < 0.6
    record = json.loads((out / "pairs.json").read_text())
    assert record["settings"]["per_frame"] == 3
    assert record["states"] == {"no_depth": 0, "visible": 1, "hidden": 2, "outside": 3}


@pytest.mark.parametrize(
    ("among", "compared"), [("train", 12 * 11 // 2), ("test", 4 * 3 // 2), ("all", 16 * 15 // 2)]
)
def test_which_frames_are_paired(data_set, tmp_path, among, compared):
    table = synfeal.pairs(
        data_set, tmp_path / "out", among=among, stride=2, min_overlap=0.0, grid=(8, 6)
    )
    assert len(table) == compared
    assert (tmp_path / "out" / "pairs.csv").is_file()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--min-overlap", "1.5"], "--min-overlap: must be 0 to 1"),
        (["--max-overlap", "nan"], "--max-overlap: must be 0 to 1"),
        (["--min-overlap", "0.5", "--max-overlap", "0.4"], "--min-overlap: must not be above"),
        (["--per-frame", "0"], "--per-frame: must be at least 1"),
        (["--stride", "0"], "--stride: must be at least 1"),
        (["--tolerance", "0"], "--tolerance: must be above 0"),
        (["--grid", "1", "5"], "--grid: each side"),
        (["--stride", "100", "--among", "test"], "no two frames to compare"),
    ],
)
def test_wrong_options_are_named(data_set, tmp_path, capfd, options, message):
    assert message in refused(capfd, "pairs", data_set, "--out", tmp_path / "out", *options)
    assert not (tmp_path / "out").exists()


def test_a_set_without_depth_and_a_directory_that_is_not_empty_are_refused(
    data_set, tmp_path, capfd
):
    room = save_room(tmp_path / "room.glb")
    synfeal.collect(room, tmp_path / "set", 2, width=40, height=33, spacing_m=0.2)
    assert "collect it with --depth" in refused(capfd, "pairs", tmp_path / "set")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").write_text("mine")
    assert "is not empty" in refused(capfd, "pairs", data_set, "--out", tmp_path / "full")
    with pytest.raises(InputError, match=r"pairs.csv"):
        read_pairs(tmp_path / "full")
    with pytest.raises(InputError, match="run pairs with `flow=True` again"):
        read_flows(tmp_path / "full" / "mine.txt")


def test_flows_are_read_as_they_were_written(tmp_path):
    rng = np.random.default_rng(3)
    flows = [
        Flow(
            rng.normal(size=(4, 5, 2)).astype(np.float32),
            rng.integers(0, 4, (4, 5), dtype=np.uint8),
        )
        for _ in range(2)
    ]
    write_flows(tmp_path / "flow.npz", *flows)
    for written, read in zip(flows, read_flows(tmp_path / "flow.npz"), strict=True):
        np.testing.assert_array_equal(read.flow_px, written.flow_px)
        np.testing.assert_array_equal(read.state, written.state)


def sphere_depth_m(position_m, direction):
    """Lengths (...) of rays of unit length (..., 3) from within a ball of 3 m about the origin."""
    along = direction @ position_m
    return -along + np.sqrt(along**2 + 9.0 - position_m @ position_m)


def panorama_ray(camera, pixel):
    longitude = 2 * np.pi * (pixel[..., 0] / camera.width - 0.5)
    latitude = np.pi * (pixel[..., 1] / camera.height - 0.5)
    across = np.cos(latitude)
    return np.stack(
        [across * np.sin(longitude), np.sin(latitude), across * np.cos(longitude)], axis=-1
    )


def panorama_pixel(camera, direction):
    x, y, z = np.moveaxis(direction / np.linalg.norm(direction, axis=-1, keepdims=True), -1, 0)
    column = (0.5 + np.arctan2(x, z) / (2 * np.pi)) * camera.width
    return np.stack([column, (0.5 + np.arcsin(y) / np.pi) * camera.height], axis=-1)


def fisheye_ray(camera, pixel):
    """Equidistant: the angle from the axis is the distance from the principal point."""
    fx, fy, cx, cy = camera.intrinsics
    place = (pixel - [cx, cy]) / [fx, fy]
    angle = np.linalg.norm(place, axis=-1, keepdims=True)
    return np.concatenate([place * np.sinc(angle / np.pi), np.cos(angle)], axis=-1)


def fisheye_pixel(camera, direction):
    fx, fy, cx, cy = camera.intrinsics
    across = np.linalg.norm(direction[..., :2], axis=-1)
    scale = np.arctan2(across, direction[..., 2]) / across
    return direction[..., :2] * scale[..., None] * [fx, fy] + [cx, cy]


@pytest.mark.parametrize("projection", ["equirectangular", "fisheye"])
def test_flow_of_wide_cameras_within_a_ball_in_closed_form(projection):
    """Nothing is hidden in a ball, and a panorama shows all of it, the short way round."""
    wide = {"fx": 24.0, "fy": 25.0, "cx": 63.0, "cy": 33.0} if projection == "fisheye" else {}
    camera = CameraConfig(width=128, height=64, projection=projection, **wide)
    ray, pixel_of = (fisheye_ray, fisheye_pixel) if wide else (panorama_ray, panorama_pixel)
    pixel = cell_centres_px(camera, camera.width, camera.height)
    poses = [
        pose_matrix(rotation_from_rpy(rpy), np.array(position_m))
        for rpy, position_m in (
            ([0.1, 0.2, 0.3], [0.5, -0.4, 0.2]),
            ([-0.2, 0.1, 1.3], [-0.3, 0.2, 0.6]),
        )
    ]
    directions = [ray(camera, pixel) @ pose[:3, :3].T for pose in poses]
    depths = [
        sphere_depth_m(pose[:3, 3], direction)
        for pose, direction in zip(poses, directions, strict=True)
    ]
    point_m = poses[0][:3, 3] + depths[0][..., None] * directions[0]
    expected = pixel_of(camera, (point_m - poses[1][:3, 3]) @ poses[1][:3, :3])
    offset = expected - pixel
    if not wide:
        offset[..., 0] -= camera.width * np.round(offset[..., 0] / camera.width)
    found = flow_between(camera, depths[0], poses[0], depths[1], poses[1])
    np.testing.assert_allclose(found.flow_px, offset, atol=1e-3)
    inside = ((expected >= 0) & (expected <= [camera.width, camera.height])).all(axis=-1)
    assert 0.2 < inside.mean() <= 1.0
    np.testing.assert_array_equal(found.state[~inside], State.OUTSIDE)
    assert (found.state[inside] == State.VISIBLE).mean() > 0.995


FACING = CameraConfig(width=64, height=48, fx=80.0, fy=80.0, cx=32.0, cy=24.0)
WALL_M = 4.0  # a wall across the z axis, along which cameras look


def before_wall(place_m, roll_deg=0.0):
    """A camera that looks straight at the wall, rolled about its axis."""
    roll = np.radians(roll_deg)
    turn = np.array(
        [[np.cos(roll), -np.sin(roll), 0], [np.sin(roll), np.cos(roll), 0], [0, 0, 1.0]]
    )
    return pose_matrix(turn, np.array(place_m, float))


def wall_mm(pose, camera=FACING):
    """Its depth image in millimetres."""
    depth_mm = round(1000 * (WALL_M - pose[2, 3]))
    return np.full((camera.height, camera.width), depth_mm, np.uint16)


def write_frames_of_wall(folder, sequences, camera=FACING):
    """A data set of (split, [(pose, depth in millimetres)]); None: no camera is told."""
    listed = []
    for number, (split, frames) in enumerate(sequences, 1):
        directory = folder / f"seq-{number:02d}"
        directory.mkdir(parents=True)
        listed.append(Sequence(directory.name, split, 0, len(frames)))
        for index, (pose, depth_mm) in enumerate(frames):
            stem = directory / f"frame-{index:06d}"
            color = np.zeros((*depth_mm.shape, 3), np.uint8)
            stem.with_suffix(".color.png").write_bytes(encode_png(color))
            stem.with_suffix(".depth.png").write_bytes(encode_png(depth_mm))
            stem.with_suffix(".pose.txt").write_text(pose_text(pose))
    write_splits(folder, listed)
    if camera is not None:
        write_json(folder / "manifest.json", {"camera": camera.record})
    return folder


def frames_at(*poses):
    return [(pose, wall_mm(pose)) for pose in poses]


def name(sequence, frame):
    return f"seq-{sequence:02d}/frame-{frame:06d}.color.png"


def test_a_wall_seen_from_half_as_far_in_closed_form(tmp_path):
    """The nearer frame shows the inner quarter of the farther one; others are turned and apart."""
    train = before_wall([0, 0, 0]), before_wall([0, 0, 2])
    test = before_wall([0.3, 0, 1]), before_wall([0, 0.4, 1], roll_deg=10)
    folder = write_frames_of_wall(
        tmp_path / "set", [("train", frames_at(*train)), ("test", frames_at(*test))]
    )
    out = tmp_path / "pairs"
    table = synfeal.pairs(folder, out, min_overlap=0.0, grid=(8, 6), flow=True)
    assert table["split_a"].tolist() == table["split_b"].tolist()
    table = table.set_index("split_a")
    assert sorted(table.index) == ["test", "train"]
    row, other = table.loc["train"], table.loc["test"]
    assert [*row[["image_a", "image_b"]]] == [name(1, 0), name(1, 1)]
    assert [*other[["image_a", "image_b"]]] == [name(2, 0), name(2, 1)]
    assert (row["distance_m"], other["distance_m"]) == (pytest.approx(2.0), pytest.approx(0.5))
    assert row["angle_deg"] == pytest.approx(0.0, abs=1e-6)
    assert other["angle_deg"] == pytest.approx(10.0)
    assert (row["overlap_ab"], row["overlap_ba"]) == (0.25, 1.0)
    for both in ("overlap_ab", "overlap_ba"):  # apart by an eighth and a fifth of the picture
        assert 0.5 < other[both] < 0.9
    forth, back = read_flows(out / row["flow"])
    from_middle = cell_centres_px(FACING, FACING.width, FACING.height) - [32.0, 24.0]
    np.testing.assert_allclose(forth.flow_px, from_middle, atol=1e-4)
    np.testing.assert_allclose(back.flow_px, -from_middle / 2, atol=1e-4)
    inner = (np.abs(from_middle) < [16, 12]).all(axis=-1)
    np.testing.assert_array_equal(forth.state, np.where(inner, State.VISIBLE, State.OUTSIDE))
    assert (back.state == State.VISIBLE).all()


def test_what_is_behind_a_camera_is_outside_and_has_no_flow():
    ahead = before_wall([0, 0, 0])
    away = pose_matrix(np.diag([-1.0, 1.0, -1.0]), np.zeros(3))
    depth_m = wall_mm(ahead) / 1000.0
    found = flow_between(FACING, depth_m, ahead, depth_m, away)
    assert (found.state == State.OUTSIDE).all()
    assert np.isnan(found.flow_px).all()


@pytest.mark.parametrize(("tolerance", "overlap_ab"), [(0.02, 0.0), (0.1, 1.0)])
def test_depths_that_differ_by_five_percent_are_alike_as_far_as_is_told(
    tmp_path, tolerance, overlap_ab
):
    pose = before_wall([0, 0, 0])
    frames = [(pose, wall_mm(pose)), (pose, np.full_like(wall_mm(pose), 4200))]
    folder = write_frames_of_wall(tmp_path / "set", [("train", frames)])
    out = tmp_path / "pairs"
    table = synfeal.pairs(folder, out, min_overlap=0.0, tolerance=tolerance, flow=True)
    assert table[["overlap_ab", "overlap_ba"]].to_numpy().tolist() == [[overlap_ab] * 2]
    for flow in read_flows(out / table["flow"][0]):
        assert (flow.state == (State.VISIBLE if overlap_ab else State.HIDDEN)).all()
        np.testing.assert_allclose(flow.flow_px, 0.0, atol=1e-4)


def test_pixels_without_depth_show_nothing_and_are_not_counted(tmp_path):
    """Cover the left half, in both ways in which a file says so."""
    pose = before_wall([0, 0, 0])
    half = wall_mm(pose)
    half[:24, :32], half[24:, :32] = 0, 65535
    folder = write_frames_of_wall(
        tmp_path / "set", [("train", [(pose, half), (pose, wall_mm(pose))])]
    )
    out = tmp_path / "pairs"
    table = synfeal.pairs(folder, out, grid=(8, 6), flow=True)
    assert table[["overlap_ab", "overlap_ba"]].to_numpy().tolist() == [[1.0, 0.5]]
    forth, back = read_flows(out / table["flow"][0])
    assert (forth.state[:, :32] == State.NO_DEPTH).all()
    assert np.isnan(forth.flow_px[:, :32]).all()
    assert (forth.state[:, 32:] == State.VISIBLE).all()
    assert (back.state[:, :31] == State.HIDDEN).all()  # at the edge itself both sides are shown
    assert np.isfinite(back.flow_px).all()


def test_every_other_frame_is_that_of_each_sequence_from_its_first(tmp_path):
    places = [before_wall([0, 0, 0.1 * step]) for step in range(6)]
    sequences = [("train", frames_at(*places[:3])), ("train", frames_at(*places[3:]))]
    folder = write_frames_of_wall(tmp_path / "set", sequences)
    table = synfeal.pairs(folder, tmp_path / "pairs", stride=2, min_overlap=0.0)
    images = {*table["image_a"], *table["image_b"]}
    assert images == {name(1, 0), name(1, 2), name(2, 0), name(2, 2)}
    assert len(table) == 4 * 3 // 2


def test_frames_of_7_scenes_are_compared_by_their_depth_camera(tmp_path, capfd):
    """Its focal length is 585 pixels; that of colour, of which flow would be, is 525."""
    size = CameraConfig(width=640, height=480, horizontal_fov_deg=60.0)
    aside_m = 320 * WALL_M / 585  # by half the picture
    poses = before_wall([0, 0, 0]), before_wall([aside_m, 0, 0])
    frames = [(pose, wall_mm(pose, size)) for pose in poses]
    folder = write_frames_of_wall(tmp_path / "set", [("train", frames)], camera=None)
    table = synfeal.pairs(folder, tmp_path / "pairs", min_overlap=0.0)
    assert table[["overlap_ab", "overlap_ba"]].to_numpy().tolist() == [[0.5, 0.5]]
    told = refused(capfd, "pairs", folder, "--out", tmp_path / "flow", "--flow")
    assert "of another camera" in told
