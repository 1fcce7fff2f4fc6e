"""Cost and worth of rendering: errors in closed form, which variants, files, rows, figure."""

import importlib.util

import numpy as np
import pytest

from reproduction.config.profile import RenderSpeedConfig
from reproduction.figures import speed_vs_error as figures
from reproduction.figures.sources import Results
from reproduction.speed import rendering as speed
from reproduction.speed.rendering import SCHEMA, MeasuredCamera
from reproduction.tables.speed_vs_error import speeds_of
from synfeal.config.dataset import RenderConfig
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.geometry.rotations import quat_wxyz_from_matrix
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.save import save_glb
from synfeal.mesh.triangles import with_smaller_textures
from synfeal.records.files import write_json
from synfeal.records.tables import frame_of, read_frame, rows_of, write_frame
from synfeal.render import choose
from tests.support.report_results import design_of, read
from tests.support.small_room import BACKENDS, PYOPENGL_WARNS, camera_of, furnished_room, room_poses

pytestmark = pytest.mark.filterwarnings(PYOPENGL_WARNS)
SMALL, LARGE = camera_of(width=48, height=36), camera_of(width=80, height=60)
SIMPLIFIES = importlib.util.find_spec("meshoptimizer") is not None
LINE = dict(
    zip(SCHEMA, ("opengl", 128, 96, 2, 1.0, 1000, 8.0, 2.0, 35.0, 0.0, 0.0, 1), strict=True)
)


def room():
    """Six painted walls, and a ball that has nearly all of the triangles."""
    parts = furnished_room((2.0, 8.0)).parts
    return TexturedMesh((*parts[:6], *(part for part in parts if part.name == "ball")))


def test_sizes_in_use_are_measured_smallest_first_and_once():
    def sizes(*cameras):
        found = speed.smallest_first([MeasuredCamera(camera) for camera in cameras])
        return [(used.camera.width, used.camera.height) for used in found]

    small = camera_of(width=128, height=96)
    assert sizes(small, LARGE) == [(80, 60), (128, 96)]
    assert sizes(small, small) == [(128, 96)]
    assert sizes(small, camera_of(width=1025, height=16)) == [(128, 96)]


def test_errors_of_colour_and_of_depth_where_both_hit_in_closed_form():
    expected = np.full((2, 4, 4, 3), 100.0, np.float32)
    rgb = np.full(expected.shape, 100, np.uint8)
    rgb[0, :2], rgb[1, :2] = 104, 96  # half the pixels are 4 levels off
    found = speed.color_errors(rgb, expected)
    assert found["mean_abs_error"] == pytest.approx(2.0)
    assert found["psnr_db"] == pytest.approx(20 * np.log10(255) - 10 * np.log10(8.0), abs=1e-3)
    same = speed.color_errors(rgb, rgb.astype(np.float32))
    assert same == {"mean_abs_error": 0.0, "psnr_db": np.inf}
    expected = np.array([[1.0, 1.0, 1.0, 1.0, np.inf, 2.0]], np.float32)
    depth = np.array([[1.001, 0.998, 1.003, 1.05, 1.0, np.inf]], np.float32)
    found = speed.depth_errors(depth, expected)
    assert found["depth_error_mm"] == pytest.approx(2.5, abs=1e-3)  # of 1, 2, 3 and 50 mm
    assert found["depth_off_share"] == 0.25


@pytest.fixture(scope="module")
def lines():
    render = RenderConfig.model_validate({"backend": BACKENDS[0], "supersampling": 2})
    cameras = [MeasuredCamera(SMALL, with_smaller_textures(room(), 2), 0.5), MeasuredCamera(LARGE)]
    return rows_of(speed.measure_speed(room(), cameras, room_poses(3, seed=1), render))


def drawn_by(lines, camera, name):
    """The full mesh through one camera by one backend, by number of samples."""
    full = max(line.faces for line in lines)
    found = [
        line
        for line in lines
        if (line.backend, line.width, line.faces, line.texture_scale)
        == (name, camera.width, full, 1.0)
    ]
    return sorted(found, key=lambda line: line.supersampling)


def test_every_working_backend_is_measured_and_one_variant_is_chosen(lines):
    for camera in (SMALL, LARGE):
        (used,) = (row for row in lines if row.chosen and row.width == camera.width)
        scale = 0.5 if camera is SMALL else 1.0  # what the level of detail left
        assert (used.backend, used.supersampling, used.texture_scale) == (BACKENDS[0], 2, scale)
        for name in BACKENDS:
            counts = [line.supersampling for line in drawn_by(lines, camera, name)]
            slow = name == "raycast" and name != BACKENDS[0]
            assert counts == ([] if slow and camera is LARGE else list(speed.SUPERSAMPLING[name]))


def test_speeds_are_told_in_turns_with_the_chosen(monkeypatch):
    """A machine that grows slower while it measures changes no ratio."""

    class Drawing:
        def __init__(self, cost):
            self.cost = cost

        def render(self, _):
            nonlocal now, load
            load *= 1.0001
            now += self.cost * load

    now, load = 0.0, 1.0
    monkeypatch.setattr("time.perf_counter", lambda: now)
    seconds = speed.seconds_in_turns([Drawing(1.0), Drawing(3.0)], np.zeros((5, 4, 4)))
    assert seconds.shape == (5 * speed.ROUNDS, 2)
    np.testing.assert_allclose(seconds[:, 1] / seconds[:, 0], 3.0, rtol=1e-3)


def test_a_scene_is_measured_from_its_files(tmp_path):
    save_glb(tmp_path / "mesh.glb", room())
    poses = room_poses(4, seed=2)
    index = np.arange(len(poses))
    plan = PoseTable(index, index, poses[:, :3, 3], quat_wxyz_from_matrix(poses[:, :3, :3]))
    write_pose_table(tmp_path / "test.csv", plan)
    out = tmp_path / "render_speed.csv"
    measured = RenderSpeedConfig(poses=2, sizes=1)
    save_glb(tmp_path / "detail.glb", with_smaller_textures(room(), 4))
    write_json(tmp_path / "detail.json", {"texture_scale": 0.25})
    speed.write_render_speed(
        mesh=tmp_path / "mesh.glb",
        plan=tmp_path / "test.csv",
        cameras=[SMALL],
        details=[tmp_path / "detail.glb"],
        records=[tmp_path / "detail.json"],
        render_speed=measured,
        render=RenderConfig(),
        out_speed=out,
    )
    found = read_frame(out, SCHEMA)
    assert found.backend[0] == choose.fastest_working()
    assert list(found.chosen) == [0, 1] + [0] * (len(found) - 2)
    assert list(found.texture_scale[:2]) == [1.0, 0.25]
    write_frame(tmp_path / "again.csv", found, float_format=None)
    assert (tmp_path / "again.csv").read_bytes() == out.read_bytes()


FLAWED = {"depth_error_mm": 0.5, "chosen": 0}
MADE_UP = [
    LINE,
    LINE | {"supersampling": 1, "ms_per_frame": 4.0, "mean_abs_error": 5.0, "chosen": 0},
    LINE | {"backend": "raycast", "ms_per_frame": 32.0, "chosen": 0},
    LINE | {"texture_scale": 0.25, "ms_per_frame": 7.0, "mean_abs_error": 3.0, "chosen": 0},
    LINE | {"faces": 250, "ms_per_frame": 6.0, "mean_abs_error": 2.5} | FLAWED,
    LINE | {"width": 640, "height": 480, "ms_per_frame": 40.0, "mean_abs_error": 0.5},
]


@pytest.fixture
def made_up(tmp_path):
    path = tmp_path / "scenes" / "large_room" / "render_speed.csv"
    write_frame(path, frame_of(MADE_UP, SCHEMA), float_format=None)
    speeds = speeds_of("render", ["large_room"], tmp_path)
    write_frame(tmp_path / "tables" / "speed_vs_error.csv", speeds)
    return tmp_path


def test_rows_and_figure_say_what_each_variant_is(made_up):
    rows = read(made_up / "tables" / "speed_vs_error.csv")
    assert [row["variant"] for row in rows] == [
        "128x96, opengl 2x2",
        "128x96, opengl 1x1",
        "128x96, raycast 2x2",
        "128x96, opengl 2x2, textures 1/4",
        "128x96, opengl 2x2, 25% of faces",
        "640x480, opengl 2x2",
    ]
    assert {(row["stage"], row["scene"]) for row in rows} == {("render", "large_room")}
    assert [float(row["seconds_per_item"]) for row in rows[:3]] == [0.008, 0.004, 0.032]
    assert [float(row["items_per_s"]) for row in rows[:3]] == [125.0, 250.0, 31.25]
    assert [float(row["error"]) for row in rows[:2]] == [2.0, 5.0]
    assert rows[4]["depth_error_mm"] == "0.5"
    assert [row["chosen"] for row in rows] == ["1", "0", "0", "0", "0", "1"]
    figure = figures.render_figure(Results(made_up, design_of(())).speeds("render"))
    small, large = figure.axes
    assert (small.get_xscale(), small.get_yscale()) == ("log", "log")
    assert small.get_title() == "Large Room, 128 × 96"
    assert large.get_title() == "Large Room, 640 × 480"
    for axes, point in ((small, (8.0, 2.0)), (large, (40.0, 0.5))):
        (ring,) = (line for line in axes.lines if line.get_markersize() > 10)
        np.testing.assert_allclose(ring.get_xydata(), [point])
    curves = {line.get_color(): line for line in small.lines if line.get_linestyle() != "None"}
    opengl, textures = curves[figures.COLORS["opengl"]], curves[figures.ORANGE]
    np.testing.assert_allclose(opengl.get_xydata(), [[4.0, 5.0], [8.0, 2.0]])
    np.testing.assert_allclose(textures.get_xydata(), [[8.0, 2.0], [7.0, 3.0]])
    assert {text.get_text() for text in small.texts} == {"1/4", "25%"}


def test_the_level_of_detail_in_use_is_ringed_and_ladders_begin_at_the_full_mesh(tmp_path):
    used = {"texture_scale": 0.25, "faces": 130, "ms_per_frame": 3.0, "mean_abs_error": 2.2}
    lines = [line | {"chosen": 0} for line in MADE_UP[:5]]
    path = tmp_path / "scenes" / "large_room" / "render_speed.csv"
    write_frame(path, frame_of([*lines, LINE | used], SCHEMA), float_format=None)
    rows = speeds_of("render", ["large_room"], tmp_path)
    assert list(rows.variant[rows.chosen == 1]) == [
        "128x96, opengl 2x2, textures 1/4, 13% of faces"
    ]
    (axes,) = figures.render_figure(rows).axes
    (ring,) = (line for line in axes.lines if line.get_markersize() > 10)
    np.testing.assert_allclose(ring.get_xydata(), [(3.0, 2.2)])
    ladders = [line.get_xydata() for line in axes.lines if line.get_linestyle() == ":"]
    np.testing.assert_allclose(ladders[0], [[8.0, 2.0], [7.0, 3.0]])
    np.testing.assert_allclose(ladders[1], [[8.0, 2.0], [6.0, 2.5]])
