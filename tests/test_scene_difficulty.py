"""Difficulty of a scene: counts known in closed form, COLMAP's own matcher, exact trajectories."""

import json
from pathlib import Path

import numpy as np
import pycolmap
import pytest
import trimesh
import yaml
from PIL import Image, ImageDraw

from baselines.groundtruth.batches import batches_of
from baselines.groundtruth.trajectory import BatchTrajectory, failed_trajectory, read_trajectory
from benchmarks.scene_difficulty import parts
from benchmarks.scene_difficulty.__main__ import main
from benchmarks.scene_difficulty.batches import assistance_summary, batch_rows, published_batches
from benchmarks.scene_difficulty.coverage import coverage_summary, covered_share
from benchmarks.scene_difficulty.features import Features, extract_features
from benchmarks.scene_difficulty.reconstruction import BatchFiles, reconstruct
from benchmarks.scene_difficulty.repetition import (
    best_matches,
    count_matches,
    repetition_rows,
    repetition_summary,
)
from benchmarks.scene_difficulty.survey import Survey, open_survey, read_setting
from synfeal.config.load import load_config
from synfeal.config.models import CameraConfig, GroundTruthConfig, RgbdConfig, SfmConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.errors import InputError
from synfeal.geometry.poses import quat_wxyz_of, relative
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.save import save_glb
from tests.planar_scene import CAMERA, straight_path, write_frames

CONFIG = Path(__file__).parents[1] / "config" / "config.yaml"
QVGA = CameraConfig(width=320, height=240)


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    folder = tmp_path_factory.mktemp("planes")
    write_frames(folder, straight_path(6, 0.08, 2.0))
    return folder


def poses_at(x_m, yaw_deg, path):
    """Frames along world x, turned about the vertical."""
    yaw = np.radians(yaw_deg)
    rotation = rotation_from_rpy(np.column_stack([0 * yaw, 0 * yaw, yaw]))
    position = np.column_stack([x_m, np.zeros((len(x_m), 2))])
    pose = np.tile(np.eye(4), (len(x_m), 1, 1))
    pose[:, :3, :3] = rotation
    return PoseTable(np.arange(len(x_m)), np.array(path), position, quat_wxyz_of(pose))


# Coverage


def test_one_keypoint_covers_the_lattice_points_of_a_disc():
    # 197 lattice points lie within 8 of a lattice point (OEIS A000328), 8 itself included.
    share = covered_share(np.array([[100.5, 60.5]], np.float32), QVGA, 8.0)
    assert share == pytest.approx(197 / (320 * 240))


def test_a_corner_keypoint_covers_a_quarter_of_the_disc():
    # Of the 197 one is the centre and 8 lie on each half axis; the rest divides into quadrants.
    share = covered_share(np.array([[0.5, 0.5]], np.float32), QVGA, 8.0)
    assert share == pytest.approx(((197 - 1 - 4 * 8) / 4 + 2 * 8 + 1) / (320 * 240))


def test_coverage_is_nothing_without_keypoints_and_all_with_a_dense_grid():
    grid = np.stack(np.meshgrid(np.arange(4, 320, 8), np.arange(4, 240, 8)), -1).reshape(-1, 2)
    assert covered_share(np.empty((0, 2), np.float32), QVGA, 8.0) == 0.0
    assert covered_share(grid, QVGA, 8.0) == 1.0


def test_coverage_summary_takes_quantiles_over_frames():
    rows = [{"covered_share": k / 10, "keypoints": 10 * k} for k in range(11)]
    summary = coverage_summary("room", rows)
    assert summary["covered_share_mean"] == pytest.approx(0.5)
    assert summary["covered_share_q10"] == pytest.approx(0.1)
    assert summary["keypoints_q90"] == pytest.approx(90)


# Features and matching


def test_features_of_the_largest_scale_come_first(tmp_path):
    image = Image.new("L", (160, 120), 128)
    draw = ImageDraw.Draw(image)
    for x in range(10, 80, 10):
        draw.ellipse((x - 2, 18, x + 2, 22), fill=255)
    draw.ellipse((98, 58, 122, 82), fill=255)
    image.save(tmp_path / "blobs.png")
    (found,) = extract_features([tmp_path / "blobs.png"], 400)
    assert len(found) > 7
    np.testing.assert_allclose(found.first(1).pixel[0], [110.5, 70.5], atol=1.0)


def test_an_image_without_texture_has_no_features(tmp_path):
    Image.new("L", (64, 48), 90).save(tmp_path / "flat.png")
    (found,) = extract_features([tmp_path / "flat.png"], 400)
    assert found.pixel.shape == (0, 2)
    assert count_matches([found, found], 1).tolist() == [[0, 0], [0, 0]]


def test_matches_are_those_of_colmap(frames):
    images = sorted(frames.glob("*.color.png"))
    features = [found.first(300) for found in extract_features(images, 1000)]
    count = count_matches(features, 1)
    assert count.max() > 50
    np.testing.assert_array_equal(count, count.T)
    for i in range(len(features)):
        for j in range(i + 1, len(features)):
            assert abs(count[i, j] - colmap_matches(features[i], features[j])) <= 1


def colmap_matches(a: Features, b: Features) -> int:
    """Matches of COLMAP's brute-force matcher; a tie after its rounding may fall the other way."""
    options = pycolmap.FeatureMatchingOptions(num_threads=1, use_gpu=False)
    options.sift.cpu_brute_force_matcher = True
    options.sift.max_ratio = 0.8
    options.sift.max_distance = np.pi
    matcher = pycolmap.FeatureMatcher.create(options, pycolmap.Device.cpu)
    sift = pycolmap.FeatureExtractorType.SIFT
    described = [pycolmap.FeatureDescriptors(sift, found.descriptor) for found in (a, b)]
    nowhere = pycolmap.FeatureKeypoints()
    return len(matcher.match(nowhere, described[0], nowhere, described[1]))


def test_frames_of_different_sizes_are_padded_without_matching_the_padding():
    rng = np.random.default_rng(0)
    descriptor = rng.integers(0, 60, (20, 128)).astype(np.uint8)
    pixel = np.zeros((20, 2), np.float32)
    whole = Features(pixel, descriptor)
    part, none = Features(pixel[:5], descriptor[:5]), Features(pixel[:0], descriptor[:0])
    count = count_matches([whole, part, none, whole], 1)
    assert count.tolist() == [[0, 5, 0, 20], [5, 0, 0, 5], [0, 0, 0, 0], [20, 5, 0, 0]]


# Repetition


def test_best_match_is_of_another_path_and_far_ones_are_counted():
    poses = poses_at([0.0, 0.1, 0.5, 5.0, 9.0], [0, 0, 20, 0, 0], [0, 0, 1, 1, 2])
    count = np.zeros((5, 5), np.int64)
    for i, j, matches in ((0, 1, 90), (0, 2, 10), (0, 3, 30), (1, 2, 20), (2, 3, 80)):
        count[i, j] = count[j, i] = matches
    best = best_matches(count, poses)
    # 0 looks most like 3, 5 m away, though 2 is near; 1 like 2; 2 like 1, not 3 of its own path;
    # 3 like 0; 4 like none.
    assert best.index[:4].tolist() == [3, 2, 1, 0]
    assert best.matches.tolist() == [30, 20, 20, 30, 0]
    np.testing.assert_allclose(best.distance_m[:4], [5.0, 0.4, 0.4, 5.0])
    np.testing.assert_allclose(best.angle_deg[:4], [0, 20, 20, 0], atol=1e-5)
    assert best.has_near.tolist() == [True, True, True, False, False]
    summary = repetition_summary("room", best)
    assert summary["frames_without_match"] == 1
    assert summary["far_share"] == pytest.approx(2 / 4)
    assert summary["far_share_with_near"] == pytest.approx(1 / 3)
    rows = repetition_rows(poses, best)
    assert [row["best_frame"] for row in rows] == [3, 2, 1, 0, None]


def test_a_near_candidate_must_look_the_same_way():
    poses = poses_at([0.0, 0.5], [0, 31], [0, 1])
    assert not best_matches(np.ones((2, 2), np.int64), poses).has_near.any()


def test_no_share_of_no_frames():
    poses = poses_at([0.0, 5.0], [0, 0], [0, 1])
    summary = repetition_summary("room", best_matches(np.zeros((2, 2), np.int64), poses))
    assert summary["far_share"] is None
    assert summary["far_share_with_near"] is None


# Batches


def exact(truth, batch):
    pose = truth.between(batch.start, batch.stop).world_from_cam
    return BatchTrajectory(relative(pose[0], pose), np.ones(len(pose), dtype=bool))


def rows_of(truth, batches, estimates):
    cfg = GroundTruthConfig(batch_frames=10)
    return batch_rows("room", "sfm", batches, estimates, truth, cfg, [2.0, 4.0])


def test_exact_batches_have_no_error_and_need_no_assistance():
    truth = straight_path(21, 0.05, 3.0)
    batches = batches_of(21, 10)
    rows = rows_of(truth, batches, [exact(truth, batch) for batch in batches])
    assert [row["assisted"] for row in rows] == [0, 0]
    for name in ("ate_median_m", "ate_max_m", "last_error_m", "last_error_deg"):
        np.testing.assert_allclose([row[name] for row in rows], 0, atol=1e-6)
    assert assistance_summary(rows, 250)["cpu_s_mean"] == 3.0


def test_a_batch_that_ends_30_cm_off_is_assisted_and_the_next_starts_right():
    truth = straight_path(21, 0.05, 3.0)
    batches = batches_of(21, 10)
    estimates = [exact(truth, batch) for batch in batches]
    estimates[0].first_from_cam[:, :3, 3] += np.linspace(0, 0.3, 11)[:, None] * [0, 0, 1]
    rows = rows_of(truth, batches, estimates)
    assert rows[0]["ate_max_m"] == pytest.approx(0.3)
    assert rows[0]["ate_median_m"] == pytest.approx(0.15)
    assert rows[0]["last_error_m"] == pytest.approx(0.3)
    assert [row["assisted"] for row in rows] == [1, 0]
    assert rows[1]["last_error_m"] == pytest.approx(0, abs=1e-9)
    assert assistance_summary(rows, 250)["assisted"] == 1


def test_frames_that_were_not_found_are_counted():
    truth = straight_path(21, 0.05, 3.0)
    batches = batches_of(21, 10)
    estimates = [failed_trajectory(11), exact(truth, batches[1])]
    estimates[1].registered[3:5] = False
    estimates[1].first_from_cam[3:5] = np.eye(4)
    rows = rows_of(truth, batches, estimates)
    assert [(row["registered"], row["filled"]) for row in rows] == [(0, 10), (9, 2)]
    assert rows[0]["ate_max_m"] == pytest.approx(np.linalg.norm(np.ptp(truth.position_m[:11], 0)))
    assert rows[1]["ate_max_m"] < 1e-3  # the path is straight: gaps are filled without error
    assert assistance_summary(rows, 250)["filled"] == 12


@pytest.mark.parametrize("method", ["sfm", "rgbd-toro", "rgbd-g2o"])
def test_the_paper_labels_8500_frames_in_34_batches(method):
    assert published_batches(method, 250) == 34


@pytest.mark.parametrize(
    ("stage", "methods"), [("sfm", ["sfm"]), ("rgbd", ["rgbd-toro", "rgbd-g2o"])]
)
def test_a_stage_leaves_trajectories_and_its_seconds(stage, methods, frames, tmp_path):
    truth = straight_path(6, 0.08, 2.0)
    cfg = GroundTruthConfig(sfm=SfmConfig(max_features=400), rgbd=RgbdConfig())
    files = BatchFiles(tmp_path, 3)
    reconstruct(stage, frames, truth, CAMERA, cfg, 0, files)
    true_pose = relative(truth.world_from_cam[0], truth.world_from_cam)
    for method in methods:
        pose = read_trajectory(files.trajectory(method)).first_from_cam
        np.testing.assert_allclose(pose[:, :3, 3], true_pose[:, :3, 3], atol=0.03)
        assert files.read_seconds(method) > 0


# The whole


@pytest.fixture
def config(tmp_path):
    """A configuration with a box of a room, and the paper's beside it."""
    box = trimesh.creation.box((6.0, 5.0, 3.0))
    colors = np.full((8, 3), 90, np.uint8)
    part = MeshPart("room", np.asarray(box.vertices), np.asarray(box.faces), vertex_rgb=colors)
    save_glb(tmp_path / "room.glb", TexturedMesh((part,)))
    raw = yaml.safe_load(CONFIG.read_text(encoding="utf-8"))
    raw["scenes"]["room"] = {"source": "mesh", "path": str(tmp_path / "room.glb")}
    (tmp_path / "config.yaml").write_text(yaml.safe_dump(raw), encoding="utf-8")
    paper = CONFIG.with_name("paper.yaml").read_text(encoding="utf-8")
    (tmp_path / "paper.yaml").write_text(paper, encoding="utf-8")
    return tmp_path / "config.yaml"


def survey_of(config, **changes) -> Survey:
    options = {"n_batches": 2, "jobs": 1, "work": config.parent / "work"} | changes
    return open_survey("room", read_setting(config), out=config.parent / "out", **options)


def test_batches_and_paths_are_the_papers(config):
    survey = survey_of(config)
    assert [len(batch) for batch in survey.batches] == [251, 251]
    assert len(survey.sample) == 500
    step_m = np.linalg.norm(np.diff(survey.truth.position_m, axis=0), axis=1)
    assert np.median(step_m) == pytest.approx(0.03, rel=0.02)
    paper = load_config(config, config.with_name("paper.yaml"))
    assert survey.cfg.groundtruth == paper.groundtruth
    assert survey.cfg.groundtruth_camera == QVGA


def test_more_batches_extend_the_same_paths(config):
    few, many = survey_of(config), survey_of(config, n_batches=90)
    np.testing.assert_array_equal(many.truth.position_m[:501], few.truth.position_m)
    np.testing.assert_array_equal(many.sample.position_m, few.sample.position_m)
    assert few.work == many.work


def test_results_of_another_setting_are_refused(config):
    survey_of(config)
    raw = yaml.safe_load(config.read_text(encoding="utf-8"))
    raw["scenes"]["room"]["min_view_distance_m"] = 0.5
    config.write_text(yaml.safe_dump(raw), encoding="utf-8")
    with pytest.raises(InputError, match=r"setting\.json: .* another sampling; delete .*out/room"):
        survey_of(config)


def test_only_missing_batches_are_done(config, monkeypatch):
    survey = survey_of(config)
    done = BatchFiles(survey.out / "room" / "batches", 0).seconds("sfm")
    done.parent.mkdir(parents=True)
    done.write_text(json.dumps({"sfm": 1.0}), encoding="utf-8")
    calls = []
    monkeypatch.setattr(parts, "run_tasks", lambda function, tasks, *_: calls.extend(tasks))
    monkeypatch.setattr(parts, "render_missing", lambda survey, blocks: calls.extend(blocks))
    parts.reconstruct_missing(survey)
    assert calls[:2] == [survey.work / "batch-000", survey.work / "batch-001"]
    assert [(task[0], task[-1].index) for task in calls[2:]] == [
        ("rgbd", 0),
        ("sfm", 1),
        ("rgbd", 1),
    ]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--scene", "cellar"], "--scene: 'cellar' is not one of"),
        (["--scene", "room", "--parts", "sift,sound"], "--parts: 'sound' is not one of sift"),
        (["--scene", "room", "--batches", "0"], "--batches: must be at least 1, is 0"),
    ],
)
def test_wrong_options_are_named(options, message, config, capsys):
    status = main([*options, "--config", str(config), "--out", str(config.parent / "out")])
    assert status == 1
    assert f"error: {message}" in capsys.readouterr().err
    assert not (config.parent / "out").exists()
