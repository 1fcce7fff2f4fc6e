"""Refinement of a model on a room whose pixels are exact, with mismatches planted by hand."""

from pathlib import Path

import numpy as np
import pycolmap
import pytest

from baselines.labels.batches import link_images
from baselines.labels.chain import fill_gaps
from baselines.labels.sfm.batch import match_features, metric_trajectory
from baselines.labels.sfm.features import extract_features
from baselines.labels.sfm.mapping import camera_poses, map_matches, read_matches, refine_model
from synfeal.geometry.poses import pose_error, relative
from tests.baselines.test_sfm_hard import CAMERA, CFG, sideways, write

N_FRAMES = 9
POSES = sideways(N_FRAMES, turn_deg=2.0)


@pytest.fixture(scope="module")
def mapped(tmp_path_factory):
    """Directory of the model as the mapper leaves it."""
    folder = tmp_path_factory.mktemp("mapped")
    images, database, models = folder / "images", folder / "database.db", folder / "models"
    link_images(write(folder, POSES), CAMERA, images)
    extract_features(images, database, CAMERA, CFG)
    match_features(database, CFG, 0)
    model = map_matches(read_matches(images, database), models, CFG, 0).model
    (folder / "model").mkdir()
    model.write(folder / "model")
    return folder / "model"


def shift(model, offset_px):
    """Move the image points; ``offset_px`` gives two pixels from the point's number and a frame."""
    for image in model.images.values():
        frame = int(Path(image.name).stem)
        for point in image.points2D:
            if point.has_point3D():
                point.xy = point.xy + offset_px(point.point3D_id, frame)
    options = pycolmap.BundleAdjustmentOptions(
        refine_focal_length=False, refine_extra_params=False, print_summary=False
    )
    options.ceres.use_gpu = False
    config = pycolmap.BundleAdjustmentConfig()
    for image_id in model.reg_image_ids():
        config.add_image(image_id)
    config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    pycolmap.create_default_bundle_adjuster(options, config, model).solve()


def worst(model):
    """Largest position (m) and orientation (degrees) errors of the placed model."""
    trajectory = metric_trajectory(*camera_poses(model), POSES, "first_camera")
    error_m, error_rad = pose_error(fill_gaps(trajectory), relative(POSES[0], POSES))
    assert trajectory.registered.all()
    return error_m.max(), np.degrees(error_rad.max())


def test_mismatches_that_move_alike_bend_a_model_until_they_are_left_out(mapped):
    """Every twelfth point runs ahead of its place, by 1.6 px over the batch."""
    model = pycolmap.Reconstruction(mapped)
    ahead_px = np.array([1.6, 0.4]) / (N_FRAMES - 1)
    shift(model, lambda point, frame: frame * ahead_px * (point % 12 == 0))
    bent_m, bent_deg = worst(model)
    refine_model(model)
    straight_m, straight_deg = worst(model)
    assert straight_m < min(0.006, bent_m / 2)
    assert straight_deg < min(0.15, bent_deg)


def test_an_exact_model_keeps_nearly_all_it_has(mapped):
    model = pycolmap.Reconstruction(mapped)
    observations, before = model.compute_num_observations(), worst(model)
    refine_model(model)
    assert model.compute_num_observations() > 0.85 * observations
    assert (np.array(worst(model)) < np.maximum(1.5 * np.array(before), [0.006, 0.15])).all()


def test_images_that_are_not_exact_keep_their_observations(mapped):
    """With noise of 0.7 px the limits would leave but a chance selection."""
    model, rng = pycolmap.Reconstruction(mapped), np.random.default_rng(0)
    shift(model, lambda *_: rng.normal(0, 0.7, 2))
    observations = model.compute_num_observations()
    refine_model(model)
    assert model.compute_num_observations() == observations


def test_a_model_without_points_stays_as_it_is(mapped):
    model = pycolmap.Reconstruction(mapped)
    for point in list(model.points3D):
        model.delete_point3D(point)
    _, before = camera_poses(model)
    refine_model(model)
    np.testing.assert_array_equal(camera_poses(model)[1], before)
