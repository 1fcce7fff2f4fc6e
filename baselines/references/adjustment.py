"""Bundle adjustment of a map (COLMAP with Ceres): poses and points that fit the images best."""

from __future__ import annotations

import numpy as np
import pycolmap
from numpy.typing import NDArray

from baselines.labels.sfm.mapping import adjustment_of
from baselines.references.correspondences import Tracks
from baselines.references.evidence import Evidence
from baselines.references.structure import on_points, pinhole, triangulate
from baselines.registry.kinds import ReferenceMethod
from synfeal.geometry.poses import inverse, pose_matrix, umeyama_sim3

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

# A tenth of the points does for the poses: the longest tracks, this many per training frame.
POINTS_PER_FRAME = 4
# Scale in pixels of the robust loss. Before, where labels are further off, the median of their own
# errors, within bounds: a coarser loss than that lets wrong tracks move good poses.
LOSS_PX, COARSEST_PX = 2.0, 30.0
ITERATIONS, FITS = 10, 5
# Labels hold the positions of their frames as if they were off by this much: next to nothing beside
# some hundred observations, but it settles what images do not say.
PRIOR_M = 0.1


@ReferenceMethod(
    name="structure-adjusted",
    title="Structure, bundle-adjusted",
    rank=6,
    group="adjusted",
    query=("vlad", "features", "matches"),
)
def adjusted(evidence: Evidence) -> Array:
    """Find poses (N, 4, 4) against points triangulated from bundle-adjusted training poses.

    Images say nothing of where the world is: the adjusted model is put where its camera centres fit
    the labels best (Umeyama), so that errors of single labels average out.
    """
    with evidence.preparing():
        labels, tracks = evidence.train.world_from_cam, evidence.tracks
        found = adjust(tracks, labels, triangulate(tracks, labels), pinhole(evidence.camera))
        placed = placed_on(found, labels, evidence.train.usable_rows)
        point_m = triangulate(tracks, placed)
    return on_points(evidence, point_m)


def placed_on(poses: Array, labels: Array, usable: Rows | None = None) -> Array:
    """Move, turn and scale poses as one so that their centres fit those of labels.

    Frames whose centres stay off by more than three times the median have no say: estimated labels
    can be wrong by metres where a batch was lost.

    Args:
        poses: ``model_from_cam`` (N, 4, 4) in a world of any place and scale.
        labels: ``world_from_cam`` (N, 4, 4) of the same frames.
        usable: Rows of the frames that are fitted; None for all. The others are moved along.

    Returns:
        The poses (N, 4, 4) in the world of the labels.
    """
    centre, wanted = poses[:, :3, 3], labels[:, :3, 3]
    every = np.arange(len(poses))
    known = np.isin(every, every if usable is None else usable)
    position_m, rotation, kept = centre, np.eye(3), known
    for _ in range(FITS):
        scale, rotation, offset = umeyama_sim3(centre[kept], wanted[kept])
        position_m = scale * centre @ rotation.T + offset
        off_m = np.linalg.norm(position_m - wanted, axis=1)
        kept = known & (off_m <= 3 * np.median(off_m[known]))
    return pose_matrix(rotation @ poses[:, :3, :3], position_m)


def adjust(tracks: Tracks, world_from_cam: Array, point_m: Array, camera: pycolmap.Camera) -> Array:
    """Adjust poses and points so that they fit the images best.

    Args:
        tracks: Observations of the points.
        world_from_cam: Poses (N, 4, 4) to start from.
        point_m: Points (T, 3) to start from, world, metres; NaN for those that are not used.
        camera: Camera without distortion, which is kept.

    Returns:
        Adjusted poses (N, 4, 4); those of frames that see no used point stay.
    """
    usable = np.asarray(np.isfinite(point_m).all(axis=1))
    chosen = longest(tracks, usable, len(world_from_cam))
    if len(chosen) == 0:
        return world_from_cam
    model = _model(tracks, world_from_cam, point_m, chosen, camera)
    seen = np.isin(tracks.track, chosen)
    off_px = float(np.median(errors_px(tracks, world_from_cam, point_m, camera)[seen]))
    coarse = [min(off_px, COARSEST_PX)] if off_px > LOSS_PX else []
    for loss_px in (*coarse, LOSS_PX):
        _solve(model, world_from_cam, loss_px)
    poses = world_from_cam.copy()
    for image_id in model.reg_image_ids():
        cam_from_world = model.image(image_id).cam_from_world().matrix()
        poses[image_id - 1] = inverse(pose_matrix(cam_from_world[:, :3], cam_from_world[:, 3]))
    return poses


def errors_px(
    tracks: Tracks, world_from_cam: Array, point_m: Array, camera: pycolmap.Camera
) -> Array:
    """Compute the reprojection errors of observed points.

    Args:
        tracks: Observations (M).
        world_from_cam: Poses (N, 4, 4).
        point_m: Points (T, 3), world, metres.
        camera: Camera without distortion.

    Returns:
        Errors (M,), pixels.
    """
    cam_from_world = inverse(world_from_cam)[tracks.frame]
    point = np.einsum("mij,mj->mi", cam_from_world[:, :3, :3], point_m[tracks.track])
    point += cam_from_world[:, :3, 3]
    off = point[:, :2] / point[:, 2:] - tracks.slope
    return np.asarray(np.linalg.norm(off * camera.params[:2], axis=1))


def longest(tracks: Tracks, usable: NDArray[np.bool_], n_frames: int) -> Rows:
    """Select the usable tracks with the most observations, four for each frame.

    Args:
        tracks: Tracks of T points.
        usable: Whether each track (T,) may be selected.
        n_frames: Number of frames, which sets how many tracks are kept at the most.

    Returns:
        Indices of the tracks, ascending.
    """
    length = np.bincount(tracks.track, minlength=tracks.count) * usable
    order = np.argsort(-length, kind="stable")[: POINTS_PER_FRAME * n_frames]
    return np.sort(order[length[order] > 0])


def _model(
    tracks: Tracks, world_from_cam: Array, point_m: Array, chosen: Rows, camera: pycolmap.Camera
) -> pycolmap.Reconstruction:
    """Build a COLMAP model of the chosen tracks and the frames that see them, counted from 1."""
    kept = np.flatnonzero(np.isin(tracks.track, chosen))
    kept = kept[np.argsort(tracks.frame[kept], kind="stable")]
    frame, pixel = tracks.frame[kept], tracks.slope[kept] * camera.params[:2]
    first = np.searchsorted(frame, np.arange(len(world_from_cam) + 1))
    model = pycolmap.Reconstruction()
    camera.camera_id = 1
    model.add_camera_with_trivial_rig(camera)
    cam_from_world = inverse(world_from_cam)
    for index in np.unique(frame):
        seen = pixel[first[index] : first[index + 1]]
        image = pycolmap.Image(
            keypoints=seen, name=f"{index}", camera_id=1, image_id=int(index) + 1
        )
        model.add_image_with_trivial_frame(image, pycolmap.Rigid3d(cam_from_world[index, :3]))
    _add_points(model, point_m[chosen], frame, np.searchsorted(chosen, tracks.track[kept]))
    return model


def _add_points(model: pycolmap.Reconstruction, point_m: Array, frame: Rows, point: Rows) -> None:
    """Add points (C, 3) with their observations: frame (M,), in rising order, and point (M,)."""
    within = np.arange(len(frame)) - np.searchsorted(frame, frame)
    order = np.argsort(point, kind="stable")
    bounds = np.searchsorted(point[order], np.arange(len(point_m) + 1))
    for index, xyz in enumerate(point_m):
        rows = order[bounds[index] : bounds[index + 1]]
        elements = [pycolmap.TrackElement(int(frame[row]) + 1, int(within[row])) for row in rows]
        model.add_point3D(xyz, pycolmap.Track(elements))


def _solve(model: pycolmap.Reconstruction, labels: Array, loss_px: float) -> None:
    """Iterate on one thread, with the positions of ``labels`` as weak priors."""
    config, options = adjustment_of(model, ITERATIONS)
    options.ceres.loss_function_type = pycolmap.LossFunctionType.CAUCHY
    options.ceres.loss_function_scale = loss_px
    priors = pycolmap.PosePriorBundleAdjustmentOptions()
    priors.alignment_ransac.random_seed = 1
    camera = pycolmap.sensor_t(pycolmap.SensorType.CAMERA, 1)
    positions = [
        pycolmap.PosePrior(
            pose_prior_id=image_id,
            corr_data_id=pycolmap.data_t(camera, image_id),
            position=labels[image_id - 1, :3, 3],
            position_covariance=PRIOR_M**2 * np.eye(3),
            coordinate_system=pycolmap.PosePriorCoordinateSystem.CARTESIAN,
        )
        for image_id in model.reg_image_ids()
    ]
    pycolmap.create_pose_prior_bundle_adjuster(options, priors, config, positions, model).solve()
