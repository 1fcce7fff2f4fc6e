"""Figures of scenes, label sets and frames, and the files all figures are written to."""

import re

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from reproduction.figures import error_by_method, label_sets, scenes
from reproduction.figures.label_sets import read_labelled_set
from reproduction.figures.registry import CAPTIONS, FIGURES, write_figures
from reproduction.figures.scenes import floor_m, plan_of
from reproduction.figures.sources import Results
from reproduction.figures.style import METHOD_STYLES, RC
from reproduction.tables.label_ranking import SCHEMA as RANKING
from reproduction.tables.layouts import SOURCES
from reproduction.tables.references import SCHEMA as REFERENCE
from reproduction.tables.speed_vs_error import SCHEMA as SPEED
from synfeal.errors import InputError
from synfeal.mesh.triangles import Triangles
from tests.support.figure_results import (
    LOOKS_ALONG_X,
    METHODS,
    N_FRAMES,
    design,
    fill_figures,
    pixels,
    room,
    true_poses,
    wrong_poses,
)
from tests.support.property_support import table_of
from tests.support.report_results import TABLE4, design_of, fill, make, write_rows

SPEED_KEYS = ("stage", "scene", "variant", "faces", "items_per_s", "error", "chosen")
SPEEDS = (
    ("collision", "large_room", "full", 90, 10, 0, 0),
    ("collision", "large_room", "decimated", 9, 20, 0.1, 1),
    ("labels", "large_room", "SfM", None, 2, 0.02, 0),
    ("labels", "large_room", "KinectFusion", None, 9, 0.1, 0),
    ("training", "large_room", "PoseNet2", None, 400, 0.3, 0),
    ("render", "large_room", "64x48, opengl 2x2", 90, 100, 1.5, 1),
)
RENDERED = {"backend": "opengl", "supersampling": 2, "texture_scale": 1.0}


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    root = fill_figures(tmp_path_factory.mktemp("results") / "toy")
    fill(root, design())
    make(TABLE4, design(), root)
    seconds = {"seconds_per_item": 0.01}
    speeds = [seconds | dict(zip(SPEED_KEYS, row, strict=True)) for row in SPEEDS]
    speeds[-1] |= RENDERED | {"width": 64, "height": 48}
    write_rows(root / "tables" / "speed_vs_error.csv", [*SPEED], speeds)
    nearest = dict.fromkeys(REFERENCE, 0.5) | {"scene": "large_room", "size": "6k"}
    nearest |= dict.fromkeys(("n_train", "n_test", "n_seeds", "failed"), 1)
    nearest |= {"labels": "synfeal", "method": "nearest-vlad", "title": "Nearest image"}
    write_rows(root / "tables" / "references.csv", [*REFERENCE], [nearest])
    ranked = dict.fromkeys(RANKING, 1) | {"scene": "large_room", "size": "6k", "labels": "sfm"}
    ranked |= {"trained_on": "labels", "score": "position_m"}
    write_rows(root / "tables" / "label_ranking.csv", [*RANKING], [ranked])
    return Results(root, design_of(design()))


@pytest.fixture(autouse=True)
def style():
    with matplotlib.rc_context(rc=RC):
        yield


def test_label_error_draws_known_errors_borders_and_assisted_batches(results):
    panels = np.reshape(label_sets.draw_label_error(results).axes, (3, 2))
    for place, count in enumerate((9, 5)):
        for line, step in enumerate((0.01, 1.0)):
            curves = {c.get_label(): c for c in panels[line, place].lines}
            for k, method in enumerate(METHODS, start=1):
                # The test labels are also 0.2 m off the true line.
                offset = (0.01 * k * np.arange(count) - 0.2 * place, k * np.arange(count))[line]
                curve = curves[SOURCES[method]]
                np.testing.assert_array_equal(curve.get_xdata(), np.arange(count))
                np.testing.assert_allclose(curve.get_ydata(), np.abs(offset), atol=1e-6 * step)
    borders = [c.get_xdata()[0] for c in panels[0, 0].lines if len(set(c.get_xdata())) == 1]
    assert borders == [4]
    bars = [
        (box.x0, box.x1, to_hex(bar.get_facecolor()[0]))
        for bar in panels[2, 0].collections
        for box in [bar.get_paths()[0].get_extents()]
    ]
    colors = [METHOD_STYLES[method]["color"].lower() for method in METHODS]
    assert bars == [(0, 4, "#ffffff"), (4, 8, colors[0]), (0, 4, "#ffffff"), (4, 8, colors[1])]


def test_trajectories_draw_both_paths_and_ring_what_was_assisted(results):
    panels = np.reshape(label_sets.draw_trajectories(results).axes, (2, 2))
    for column, k in enumerate((1, 2)):
        lines = {line.get_label(): line.get_xydata() for line in panels[0, column].lines}
        labels = wrong_poses(9, 0.01 * k, k)[:, :2, 3]
        np.testing.assert_allclose(lines["true path"], true_poses(9)[:, :2, 3])
        np.testing.assert_allclose(lines["estimated path"], labels)
        np.testing.assert_allclose(lines["first frame of a batch"], labels[[0, 4]])
        assert (
            panels[0, column].get_title() == f"{SOURCES[METHODS[column]]}\n1 of 2 batches assisted"
        )
        np.testing.assert_allclose(lines["assisted: replaced by the true pose"], labels[[8]])
        (wide,) = (c for c in panels[0, column].collections if c.get_label() == "assisted batch")
        np.testing.assert_allclose(wide.get_segments()[0], labels[4:])
    assert [part.get_suptitle() for part in panels[0, 0].figure.figure.subfigs] == [
        "train: 9 frames",
        "test: 5 frames",
    ]


def test_poses_draw_every_camera_with_a_tick_where_it_looks(results):
    small, large = scenes.draw_poses(results).axes
    for axes, size in ((small, "6k"), (large, "20k")):
        dots = {c.get_label(): c for c in axes.collections}
        for split, y in (("train", 1.0), ("test", 1.2)):
            count = N_FRAMES[size, split]
            np.testing.assert_allclose(dots[split].get_offsets(), true_poses(count, y)[:, :2, 3])
        text = f"{N_FRAMES[size, 'train']} train + {N_FRAMES[size, 'test']} test frames"
        assert axes.get_title() == f"Large Room, {size}\n{text}"
    cameras = true_poses(3)
    down = np.diag([1.0, -1.0, -1.0])
    left = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])  # looks along y
    cameras[1, :3, :3], cameras[2, :3, :3] = down, left
    ticks = scenes.view_ticks(table_of(cameras))
    np.testing.assert_allclose(ticks[:, 0], cameras[:, :2, 3])
    expected = scenes.TICK_M * np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]])
    np.testing.assert_allclose(ticks[:, 1] - ticks[:, 0], expected, atol=1e-12)
    np.testing.assert_allclose(LOOKS_ALONG_X @ [0, 0, 1], [1, 0, 0])


def area(corners):
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum() / 2


def test_a_plan_shows_what_is_between_floor_and_cut():
    plan = plan_of(room(), top_m=2.0)
    # From above only the table has an area: its top and its underside.
    assert area(plan.corners_m) == pytest.approx(2.0)
    np.testing.assert_allclose(plan.bounds_m, [[0, 0], [4, 2]])
    walls = plan.corners_m[np.abs(plan.corners_m[:, :, 0] - 4).max(axis=1) < 1e-9]
    # The wall at x = 4, its triangles cut at the top.
    assert (walls[:, :, 1].min(), walls[:, :, 1].max()) == (0, 2)
    assert area(plan_of(room(), top_m=3.5).corners_m) == pytest.approx(2.0 + 8.0)  # and ceiling
    slope = np.array([[0, 0, 0], [3.0, 0, 3.0], [3.0, 1, 3.0], [0, 1, 0]])
    floor = np.array([[0, 0, 0], [9.0, 0, 0], [9.0, 9, 0]])
    mesh = Triangles(np.concatenate([slope, floor]), np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6]]))
    x = plan_of(mesh, top_m=2.0).corners_m[:, :, 0]  # on the slope, height is x
    assert (x.min(), x.max()) == pytest.approx((0.15, 2.0))
    corners = room().vertices_m[room().faces]
    speck = np.array([[[0, 0, -5.0], [0.1, 0, -5.0], [0, 0.1, -5.0]]])
    assert floor_m(np.concatenate([speck, corners])) == pytest.approx(0.0)


def test_frames_show_the_files_in_order_with_their_numbers_in_the_test_set(results):
    (part,) = scenes.draw_frames(results).subfigs
    shown = [axes for axes in part.axes if axes.images]
    assert [axes.texts[0].get_text() for axes in shown] == list("012345")
    for number, axes in enumerate(shown):
        np.testing.assert_array_equal(axes.images[0].get_array(), pixels(number))
    assert part.get_suptitle() == "Large Room: 6 of 6 test frames"


@pytest.mark.parametrize("count", [1, 5, 12, 13, 1000, 20_000])
def test_frames_are_spread_evenly(count):
    chosen = scenes.evenly(count)
    assert len(chosen) == len(set(chosen)) == min(12, count)
    assert (chosen[0], chosen[-1]) == (0, count - 1)
    if count > 1:
        assert np.ptp(np.diff(chosen)) <= 1


def test_cumulative_error_shows_the_largest_size_whatever_the_order_of_the_rows(results):
    position, orientation, both = error_by_method.draw_cumulative_error(results).axes
    assert position.get_title() == "Large Room, 20k\n12 training, 6 test frames"
    for axes, errors in (
        *((position, (0.1, 0.2, 0.4)), (orientation, (10, 20, 30))),
        (both, (10, 20, 40)),  # the same frames: 10 cm and 10°, 20 cm and 20°, 40 cm and 30°
    ):
        (curve,) = [line for line in axes.lines if line.get_label() == "PoseNet"]
        # Of four predictions one failed.
        np.testing.assert_allclose(curve.get_xydata().T, [errors, (25, 50, 75)])


def test_what_the_design_makes_is_written_and_equal_results_give_equal_files(results, tmp_path):
    names = write_figures(results.design, results.root, tmp_path / "a")
    absent = (
        "error_by_noise",
        "references_by_noise",
        "error_by_images",
        "robustness",
    )  # not of this design
    assert names == [name for name in FIGURES if name not in absent]
    write_figures(results.design, results.root, tmp_path / "b")
    files = {path.name: path.read_bytes() for path in (tmp_path / "a").iterdir()}
    assert files == {path.name: path.read_bytes() for path in (tmp_path / "b").iterdir()}
    pictures = {f"{name}.svg" for name in names if name != "frames"}
    assert set(files) == pictures | {f"{name}.png" for name in names}
    for name in pictures:  # text stays text, and there is no date
        assert len(re.findall(b"<text ", files[name])) > 5
        assert b"dc:date" not in files[name]


def test_every_drawing_has_a_caption_and_is_a_figure_or_left_out(results):
    assert list(CAPTIONS) == list(FIGURES)
    for caption in CAPTIONS.values():
        assert re.fullmatch(r"[A-Z][^.]*\.", caption.replace("0.", "0")), caption
    nothing = Results(results.root, design_of(()))
    drawn = {name for name, entry in FIGURES.items() if entry.draw(nothing) is not None}
    stages = ("collision", "labels", "render", "training")
    assert drawn == {f"speed_vs_error_{stage}" for stage in stages}
    assert isinstance(FIGURES["error_by_size"].draw(results), Figure)
    rows = tuple(row for row in results.design.rows if row.table == TABLE4)
    assert read_labelled_set(Results(results.root, design_of(rows))) is None


@pytest.mark.parametrize(
    "missing",
    [
        "labels/large_room/6k/sfm/assistance.json",
        "labels/large_room/6k/sfm/test.csv",
        "scenes/large_room/collision.ply",
        "frames/large_room/test.npy",
        "runs/large_room/20k/synfeal/pretrained/posenet/seed0/errors.csv",
        "tables/table4_size.csv",
        "tables/label_ranking.csv",
    ],
)
def test_a_missing_result_of_the_design_is_one_line_that_names_it(results, tmp_path, missing):
    path = results.root / missing
    kept = path.rename(path.with_suffix(".away"))
    try:
        with pytest.raises(InputError, match=re.escape(str(path))) as refusal:
            write_figures(results.design, results.root, tmp_path)
        assert "\n" not in str(refusal.value)
    finally:
        kept.rename(path)
