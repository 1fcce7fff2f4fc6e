"""KinectFusion: frame-to-model tracking (Newcombe et al., ISMAR 2011).

Depth images are fused into one truncated signed distance field. Each frame is registered, coarse to
fine, to the surface that the field shows from where the frame before was found. The motion is not
extrapolated, no frame is compared with another, no loop is closed, and colour plays no part.

A frame is lost, as in the paper, when the matched surfaces do not constrain the motion or when it
is too large; here also when too little of its depth agrees with the model. Lost frames are
unregistered and not fused; the frames after are looked for where the last one was found, and have
to agree better. After a few lost frames the rest of the batch is lost: nobody is there to bring the
camera back.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from baselines.config.labels import KinectFusionConfig
from baselines.labels.batches import BatchTrajectory
from baselines.labels.projective_icp import pyramid_of, register
from baselines.labels.rgbd.dense import matched_depths
from baselines.labels.rgbd.frames import RgbdFrame, near, open3d_depth, read_frame
from baselines.registry.kinds import LabelMethod
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.frame_files import FrameFile
from synfeal.geometry.poses import inverse
from synfeal.scanning.fusion import fuse_depth

Array = NDArray[np.float64]
Depth = NDArray[np.float32]

# Voxels per block edge, blocks to begin with (more are added), truncation distance in voxels.
_BLOCK_VOXELS, _BLOCKS, _TRUNCATION = 8, 8000, 4.0
# Parts of the image that a block covers, at the most, in the mean over all of them.
_PARTS = 4
# A surface is shown once so many frames have seen it: at once, for narrow ones are soon gone.
_MIN_WEIGHT = 1.0
# Depth below this is not seen in the model.
_MIN_DEPTH_M = 0.1
# Where matched surfaces constrain a motion less, it may slide along them.
MIN_CONSTRAINT = 0.001
# Share of its depth that has to agree with the model before a lost camera counts as found.
_FOUND_FITNESS = 0.7
# After so many lost frames the camera may be anywhere, in front of another room like this one too.
_MAX_LOST = 5
# Depth agrees with the model within a voxel and this share of it, and has to for this share of the
# points that fall on the model.
_DEPTH_SHARE, _AGREEING = 0.005, 0.78


class FusedModel:
    """The surface seen so far; poses are ``first_from_cam``."""

    def __init__(self, camera: CameraConfig, cfg: KinectFusionConfig) -> None:
        self._camera, self._cfg = camera, cfg
        # Fusing cuts projected positions to whole pixels instead of rounding them: with the centre
        # of the first pixel at (0.5, 0.5) that is the nearest pixel (Open3D issue 7580).
        self._fused = o3d.core.Tensor.from_numpy(camera.intrinsics.matrix())
        kind, scalar = o3d.core.float32, o3d.core.SizeVector([1])
        self._grid = o3d.t.geometry.VoxelBlockGrid(
            ("tsdf", "weight"), (kind, kind), (scalar, scalar), cfg.voxel_m, _BLOCK_VOXELS, _BLOCKS
        )
        self._reserved = 0

    def fuse(self, frame: RgbdFrame, first_from_cam: Array) -> None:
        """Add a frame seen from a pose (4, 4); one without depth adds nothing."""
        if not np.isfinite(frame.depth_m).any():
            return
        seen = fuse_depth(
            self._grid,
            open3d_depth(frame.depth_m),
            self._fused,
            _cam_from_first(first_from_cam),
            self._cfg.max_depth_m,
            _TRUNCATION,
        )
        self._reserve(seen, first_from_cam)

    def show(self, first_from_cam: Array) -> Depth:
        """Render the depth (H, W) of the model from a pose (4, 4), inf where there is no surface.

        Open3D shows the surface half a voxel further along each axis than it was fused (measured);
        the camera is moved with it.
        """
        shifted = np.array(first_from_cam)
        shifted[:3, 3] += self._cfg.voxel_m / 2
        known = self._grid.hashmap()
        blocks = known.key_tensor()[known.active_buf_indices().to(o3d.core.int64)]
        matrix = self._camera.intrinsics.matrix(centre_shift_px=-0.5)
        size_px = self._camera.width, self._camera.height
        # Open3D first finds the range of depth in square tiles, and reads beyond them where they
        # do not divide the image.
        tile_px = next(side for side in (8, 4, 2, 1) if not any(s % side for s in size_px))
        depth_m = self._cast(blocks, matrix, shifted, size_px, tile_px)
        return np.where(depth_m > 0, depth_m, np.float32(np.inf))

    def _cast(
        self,
        blocks: o3d.core.Tensor,
        matrix: Array,
        first_from_cam: Array,
        size_px: tuple[int, int],
        tile_px: int,
    ) -> Depth:
        """Cast rays at blocks of the model to render a depth image.

        Args:
            blocks: Keys (n, 3) of the blocks.
            matrix: Intrinsics (3, 3) of the image.
            first_from_cam: Pose (4, 4).
            size_px: Width and height of the image.
            tile_px: Side of the tiles in which Open3D first finds the range of depth.

        Returns:
            Depth (h, w), metres; 0 where nothing is hit.
        """
        shown: Depth = self._grid.ray_cast(
            blocks,
            o3d.core.Tensor.from_numpy(matrix),
            _cam_from_first(first_from_cam),
            *size_px,
            ["depth"],
            1.0,
            _MIN_DEPTH_M,
            self._cfg.max_depth_m,
            _MIN_WEIGHT,
            _TRUNCATION,
            tile_px,
        )["depth"].numpy()[..., 0]
        return shown

    def _reserve(self, seen: o3d.core.Tensor, first_from_cam: Array) -> None:
        """Make room for the parts of the image that blocks cover, when there are many more blocks.

        Open3D estimates that room once and leaves out what has none; only then it makes more. So
        it is shown the blocks in view (n, 3) many times over, in a tiny image.
        """
        if self._grid.hashmap().size() <= self._reserved:
            return
        self._reserved = 2 * self._grid.hashmap().size()
        repeated = np.tile(seen.numpy(), (-(-_PARTS * self._reserved // len(seen)), 1))
        tiny = np.diag([16 / self._camera.width, 16 / self._camera.height, 1.0])
        matrix = tiny @ self._camera.intrinsics.matrix()
        self._cast(o3d.core.Tensor.from_numpy(repeated), matrix, first_from_cam, (16, 16), 1)

    def track(self, frame: RgbdFrame, last: Array, min_fitness: float) -> Array | None:
        """Register a frame to the surface that the model shows from the last known pose.

        Args:
            frame: Frame to track; its depth alone is used.
            last: Pose ``first_from_cam`` (4, 4) of the last frame that was found.
            min_fitness: Least share of the frame's depth that must agree with the model, 0 to 1.

        Returns:
            Pose ``first_from_cam`` (4, 4); None where the frame is lost or nothing was fused yet.
        """
        if not self._grid.hashmap().size():
            return None
        shown_m = self.show(last)
        shown, seen = (pyramid_of(depth_m, self._camera) for depth_m in (shown_m, frame.depth_m))
        motion, constraint = register(shown, seen, self._camera)
        if constraint < MIN_CONSTRAINT or not near(np.eye(4), motion):
            return None
        return last @ motion if self._agrees(frame, shown_m, motion, min_fitness) else None

    def _agrees(self, frame: RgbdFrame, shown_m: Depth, motion: Array, min_fitness: float) -> bool:
        """Check that enough of a frame falls on the model and nearly all of that agrees with it."""
        model_m, frame_m, n_points = matched_depths(shown_m, frame.depth_m, motion, self._camera)
        known = np.isfinite(model_m)
        limit_m = self._cfg.voxel_m + _DEPTH_SHARE * frame_m[known]
        n_agreeing = np.count_nonzero(np.abs(model_m[known] - frame_m[known]) <= limit_m)
        enough = max(min_fitness * n_points, _AGREEING * np.count_nonzero(known))
        return bool(n_agreeing >= enough)


def _cam_from_first(first_from_cam: Array) -> o3d.core.Tensor:
    """Invert a pose (4, 4), as Open3D takes it."""
    return o3d.core.Tensor.from_numpy(np.ascontiguousarray(inverse(first_from_cam)))


@LabelMethod(
    name="kinect-fusion",
    title="KinectFusion",
    rank=6,
    works_on="frames",
    settings="kinect_fusion",
)
def kinect_fusion_batch(
    color_paths: Sequence[FrameFile],
    depth_paths: Sequence[FrameFile],
    camera: CameraConfig,
    cfg: KinectFusionConfig,
    seed: int = 0,
) -> BatchTrajectory:
    """Track one batch.

    Args:
        color_paths: Colour images in order; depth alone is tracked.
        depth_paths: 16-bit depth images in millimetres, 65535 where nothing was hit.
        camera: Camera of colour and depth.
        cfg: Sensor, model, and when tracking is lost.
        seed: Seed of the sensor's noise; unused by the ideal one.

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
    last, lost = np.eye(4), 0
    for index, (color, depth) in enumerate(zip(color_paths, depth_paths, strict=True)):
        frame = read_frame(color, depth, camera, cfg, seed)
        least = _FOUND_FITNESS if lost else cfg.min_fitness
        pose = np.eye(4) if index == 0 else None
        if index and lost < _MAX_LOST:
            pose = model.track(frame, last, least)
        if pose is None:
            lost += 1
            continue
        model.fuse(frame, pose)
        last, lost = pose, 0
        poses[index], registered[index] = pose, True
    return BatchTrajectory(poses, registered)
