"""KinectFusion: frame-to-model tracking, which the paper says does not cope with such batches.

Depth images are fused into one truncated signed distance field with Open3D's dense SLAM. Each frame
is registered by point-to-plane odometry to the surface that the field shows from where the camera
is expected: moved on as between the two frames before. No frame is compared with another, no loop
is closed, and colour, although Open3D fuses it, plays no part (Newcombe et al., ISMAR 2011).

A frame is lost when the surfaces in view do not constrain the motion, when too little of its depth
agrees with the model under the pose found, or when that pose is far from the one expected. Lost
frames are unregistered and not fused; the frames after are expected where the last one was found,
and have to agree better. After a few lost frames the rest of the batch is lost.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from baselines.groundtruth.rgbd.agreement import constraint, depth_agreement
from baselines.groundtruth.rgbd.dense import MIN_CONSTRAINT, register
from baselines.groundtruth.rgbd.frames import RgbdFrame, open3d_depth, read_frame
from baselines.groundtruth.trajectory import BatchTrajectory
from synfeal.camera.intrinsics import intrinsics_of
from synfeal.config.models import CameraConfig, KinectFusionConfig
from synfeal.dataset.archive import FrameFile
from synfeal.geometry.poses import relative

Array = NDArray[np.float64]
Depth = NDArray[np.float32]

# Voxels per block edge, blocks to begin with (more are added), truncation distance in voxels.
_BLOCK_VOXELS, _BLOCKS, _TRUNCATION = 16, 2000, 8.0
# Depth below this is not seen in the model.
_MIN_DEPTH_M = 0.1
# Share of its depth that has to agree with the model before a lost camera counts as found.
_FOUND_FITNESS = 0.7
# After so many lost frames the camera may be anywhere, before another room like this one too.
_MAX_LOST = 5
# Share that has to agree within this part of the accepted residual, or the pose is not believed.
_CLOSE, _CLOSE_FITNESS = 0.2, 0.5


class FusedModel:
    """The surface seen so far; poses are ``first_from_cam``."""

    def __init__(self, camera: CameraConfig, cfg: KinectFusionConfig) -> None:
        self._camera, self._cfg = camera, cfg
        slam, device = o3d.t.pipelines.slam, o3d.core.Device("CPU:0")

        def frame(centre_shift_px: float) -> o3d.t.pipelines.slam.Frame:
            matrix = o3d.core.Tensor.from_numpy(intrinsics_of(camera).matrix(centre_shift_px))
            return slam.Frame(camera.height, camera.width, matrix, device)

        # Fusing cuts projected positions to whole pixels instead of rounding them: with the centre
        # of the first pixel at (0.5, 0.5) that is the nearest pixel (Open3D issue 7580).
        self._fused, self._shown = frame(0.0), frame(-0.5)
        eye = o3d.core.Tensor.from_numpy(np.eye(4))
        self._model = slam.Model(cfg.voxel_m, _BLOCK_VOXELS, _BLOCKS, eye, device)
        self._frames = 0

    def fuse(self, frame: RgbdFrame, first_from_cam: Array) -> None:
        """Add a frame seen from a pose (4, 4); one without depth adds nothing."""
        if not np.isfinite(frame.depth_m).any():
            return
        color = frame.rgbd.color.to(o3d.core.float32, copy=True)
        self._fused.set_data_from_image("depth", frame.rgbd.depth)
        self._fused.set_data_from_image("color", color)  # Open3D does not fuse without
        self._place(first_from_cam)
        self._model.integrate(self._fused, 1.0, self._cfg.max_depth_m, _TRUNCATION)
        self._frames += 1

    def show(self, first_from_cam: Array) -> Depth:
        """Depth (H, W) of the model from a pose (4, 4), inf where there is no surface.

        Open3D shows the surface half a voxel further along each axis than it was fused (measured);
        the camera is moved with it.
        """
        shifted = np.array(first_from_cam)
        shifted[:3, 3] += self._cfg.voxel_m / 2
        self._place(shifted)
        self._model.synthesize_model_frame(
            self._shown, 1.0, _MIN_DEPTH_M, self._cfg.max_depth_m, _TRUNCATION, False
        )
        depth_m = self._shown.get_data("depth").numpy()[..., 0]
        return np.where(depth_m > 0, depth_m, np.float32(np.inf))

    def track(self, frame: RgbdFrame, expected: Array, min_fitness: float) -> Array | None:
        """Pose (4, 4) of a frame near an expected one, or None when it is lost."""
        if not self._frames or constraint(frame.depth_m, self._camera) < MIN_CONSTRAINT:
            return None
        shown_m = self.show(expected)
        shown = o3d.t.geometry.RGBDImage(frame.rgbd.color, open3d_depth(shown_m))
        motion = register(shown, frame.rgbd, np.eye(4), self._camera, self._cfg)
        if motion is None:
            return None
        if self._agreement(frame, shown_m, motion, 1.0) < min_fitness:
            return None
        close = self._agreement(frame, shown_m, motion, _CLOSE)
        return expected @ motion if close >= _CLOSE_FITNESS else None

    def _agreement(self, frame: RgbdFrame, shown_m: Depth, motion: Array, factor: float) -> float:
        """Share of a frame that agrees with the model within ``factor`` times the residual."""
        limit_m = factor * self._cfg.max_rmse_m
        share, rmse_m = depth_agreement(shown_m, frame.depth_m, motion, self._camera, limit_m)
        return share if rmse_m <= limit_m else 0.0

    def _place(self, first_from_cam: Array) -> None:
        """Set the pose that Open3D fuses or shows the model from."""
        pose = np.ascontiguousarray(first_from_cam)
        self._model.update_frame_pose(self._frames, o3d.core.Tensor.from_numpy(pose))


def kinect_fusion_batch(
    color_paths: Sequence[FrameFile],
    depth_paths: Sequence[FrameFile],
    camera: CameraConfig,
    cfg: KinectFusionConfig,
    seed: int = 0,
) -> BatchTrajectory:
    """Track one batch.

    Args:
        color_paths: colour images in order; depth alone is tracked.
        depth_paths: 16-bit depth images in millimetres, 65535 where nothing was hit.
        camera: camera of both.
        cfg: sensor, model, and when tracking is lost.
        seed: of the sensor's noise; unused by the ideal one.

    Returns:
        Poses relative to the first frame; lost frames are unregistered.

    Raises:
        InputError: an image cannot be read or has another size than the camera.
        ValueError: colour and depth images differ in number.
    """
    o3d.utility.set_max_threads(1)
    o3d.utility.set_verbosity_level(o3d.utility.VerbosityLevel.Error)
    model = FusedModel(camera, cfg)
    poses = np.tile(np.eye(4), (len(depth_paths), 1, 1))
    registered = np.zeros(len(depth_paths), dtype=bool)
    last, motion, lost = np.eye(4), np.eye(4), 0
    for index, paths in enumerate(zip(color_paths, depth_paths, strict=True)):
        frame = read_frame(*paths, camera, cfg, seed)
        least = _FOUND_FITNESS if lost else cfg.min_fitness
        pose = np.eye(4) if index == 0 else None
        if index and lost < _MAX_LOST:
            pose = model.track(frame, last @ motion, least)
        if pose is None:
            motion, lost = np.eye(4), lost + 1
            continue
        motion = np.eye(4) if lost else relative(last, pose)
        model.fuse(frame, pose)
        last, lost = pose, 0
        poses[index], registered[index] = pose, True
    return BatchTrajectory(poses, registered)
