"""Overlaps and flow against rays at every triangle, and the command that writes them."""

import json

import numpy as np
import pytest

import synfeal
from synfeal.camera.projection import cell_pixels
from synfeal.cli import main
from synfeal.errors import InputError
from synfeal.geometry.poses import inverse, pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.pairs.choose import Choice
from synfeal.pairs.correspondence import DepthImage, State
from synfeal.pairs.flow import flow_between, read_flows
from synfeal.pairs.overlap import grid_points, overlaps_with
from synfeal.pairs.run import read_pairs
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
        pixel = cell_pixels(camera, camera.width, camera.height)
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


def test_overlap_is_the_share_that_rays_reach(cast):
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
    table = synfeal.find_pairs(
        data_set, tmp_path / "out", among=among, every=2, min_overlap=0.0, grid=(8, 6)
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
        (["--every", "0"], "--every: must be at least 1"),
        (["--tolerance", "0"], "--tolerance: must be above 0"),
        (["--grid", "1", "5"], "--grid: each side"),
        (["--every", "100", "--among", "test"], "no two frames to compare"),
    ],
)
def test_wrong_options_are_named(data_set, tmp_path, capfd, options, message):
    assert message in refused(capfd, "pairs", data_set, "--out", tmp_path / "out", *options)
    assert not (tmp_path / "out").exists()


def test_a_set_without_depth_and_a_directory_that_is_not_empty_are_refused(
    data_set, tmp_path, capfd
):
    room = save_room(tmp_path / "room.glb")
    synfeal.collect(room, tmp_path / "set", 2, width=40, height=33, spacing=0.2)
    assert "collect it with --depth" in refused(capfd, "pairs", tmp_path / "set")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine.txt").write_text("mine")
    assert "is not empty" in refused(capfd, "pairs", data_set, "--out", tmp_path / "full")
    with pytest.raises(InputError, match=r"pairs.csv"):
        read_pairs(tmp_path / "full")
    with pytest.raises(InputError, match="run synfeal pairs --flow again"):
        read_flows(tmp_path / "full" / "mine.txt")
