"""Poses refined on a rendering: the mesh is drawn from the pose found and compared once more.

The frames of a map were taken from other places, so that features look different in them or are
hidden. What is drawn from the pose found shows what the photograph shows, but for the error of that
pose. So optical flow (DIS: Kroeger et al., ECCV 2016) finds everywhere what belongs together, not
only where there are features, and depth puts it into space. Reference poses were refined on
renderings by Zhang, Sattler and Scaramuzza ("Reference Pose Generation for Long-term Visual
Localization via Learned Features and View Synthesis", IJCV 2021), by features.

That a photograph is of the place at all is settled before.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Self

import cv2
import numpy as np
from numpy.typing import NDArray

from baselines.references.map_frames import depth_along
from baselines.references.mapped import StructureMap
from baselines.references.photographs import Answer, Photograph
from baselines.references.repeats import MAX_ERROR_PX
from baselines.references.structure import pinhole, supported_pose
from synfeal.camera.projection import normalised_of_pixels
from synfeal.config.dataset import RenderConfig
from synfeal.dataset.world import read_scan_record
from synfeal.errors import Argument, InputError
from synfeal.geometry.poses import inverse
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.render.choose import open_renderer

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

# Frames that tell whether a mesh is what the map shows, and the share of their features that must
# lie on it, give or take a share of the distance.
CHECKED = 8
DEPTH_TOLERANCE = 0.05
LEAST_ON_MESH = 0.5
# Pixels between the places that are compared, and how far flow there and back may end from where it
# began.
STEP_PX = 6
CIRCLE_PX = 1.0
# Of the places that show the mesh, the share that must agree with a pose.
LEAST_SHARE = 0.2
# Light of a photograph is not that of a scan: grey values are compared as deviations from their
# mean near by, in units of their spread there. Spreads of few grey levels are noise.
NEAR_PX = 8.0
NOISE_LEVELS = 4.0
LEVELS_PER_SPREAD = 40.0


class Redrawn:
    """Refines poses of photographs on the mesh that a map shows.

    Args:
        place: The map.
        mesh: The mesh.
        mesh_from_map: Rigid motion (4, 4) from the world of the map to that of the mesh.
        seed: Seed of RANSAC's samples.
    """

    def __init__(
        self, place: StructureMap, mesh: TexturedMesh, mesh_from_map: Array, seed: int = 0
    ) -> None:
        self._place = place
        self._renderer = open_renderer(mesh, place.camera, RenderConfig())
        self._mesh_from_map = mesh_from_map
        self._seed = seed
        # OpenCV declares that flow must be given, which it may not be.
        self._flow: Any = cv2.DISOpticalFlow.create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM)
        self._pinhole = pinhole(place.camera)
        self._focal_px = np.array(place.camera.intrinsics[:2])
        x, y = (np.arange(STEP_PX // 2, side, STEP_PX) for side in self._size)
        self._grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._renderer.close()

    @property
    def _size(self) -> tuple[int, int]:
        """Return width and height of what is drawn, pixels."""
        return self._place.camera.width, self._place.camera.height

    def refine(self, photograph: Photograph, answer: Answer) -> Answer:
        """Find the pose of a photograph again, from the one it has.

        Args:
            photograph: The photograph.
            answer: Its pose, which must be one.

        Returns:
            The answer with the pose that most of what is drawn agrees with; as it is where too
            little does. The support stays that of the match with the map.
        """
        pose = answer.world_from_cam
        rgb, depth_m = self._renderer.render_rgbd(self._mesh_from_map @ pose)
        shows = (
            np.isfinite(depth_m[self._grid[:, 1], self._grid[:, 0]])
            & (photograph.shown[self._grid[:, 1], self._grid[:, 0]])
        )
        drawn = np.asarray(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), dtype=np.uint8)
        place, seen = self._followed(drawn, photograph.grey, self._grid[shows])
        slope = normalised_of_pixels(self._place.camera, place.astype(np.float64) + 0.5)
        along_m = depth_m[place[:, 1], place[:, 0]].astype(np.float64)
        in_cam_m = np.column_stack([slope, np.ones(len(slope))]) * along_m[:, None]
        pixel = normalised_of_pixels(self._place.camera, seen + 0.5) * self._focal_px
        known = np.isfinite(in_cam_m).all(axis=1) & np.isfinite(pixel).all(axis=1)  # a lens folds
        found = supported_pose(
            pixel=pixel[known],
            point_m=in_cam_m[known] @ pose[:3, :3].T + pose[:3, 3],
            camera=self._pinhole,
            seed=self._seed,
            max_error_px=MAX_ERROR_PX,
        )
        if found is None or found.inlier.sum() < LEAST_SHARE * shows.sum():
            return answer
        return answer._replace(world_from_cam=found.world_from_cam)

    def _followed(
        self, drawn: NDArray[np.uint8], grey: NDArray[np.uint8], place: Rows
    ) -> tuple[Rows, Array]:
        """Follow places from one image to another by optical flow.

        Args:
            drawn: Grey values (H, W) of the one.
            grey: Grey values (H, W) of the other.
            place: Columns and rows (n, 2).

        Returns:
            Those (m, 2) that flow back to where they came from, and where they are (m, 2) in the
            other image.
        """
        first, second = without_light(drawn), without_light(grey)
        there = self._flow.calc(first, second, None)
        back = self._flow.calc(second, first, None)
        moved = there[place[:, 1], place[:, 0]]
        arrived = place + moved
        inside = ((arrived >= 0) & (arrived <= np.array(self._size) - 1)).all(axis=1)
        place, moved, arrived = place[inside], moved[inside], arrived[inside]
        column, row = arrived.round().astype(int).T
        missed_px = np.linalg.norm(moved + back[row, column], axis=1)
        good = missed_px < CIRCLE_PX
        return place[good], arrived[good].astype(np.float64)

    def share_on_mesh(self) -> float:
        """Compute the share, 0 to 1, of the features of some frames that lie on the mesh."""
        features = self._place.features
        on_mesh = []
        for frame in np.unique(np.linspace(0, len(self._place) - 1, CHECKED).round().astype(int)):
            pose = self._mesh_from_map @ self._place.world_from_cam[frame]
            own = features.of(int(frame))
            drawn_m = depth_along(
                self._renderer.render_depth(pose), self._place.camera, features.slope[own]
            )
            on_mesh.append(np.abs(drawn_m / features.depth_m[own] - 1) < DEPTH_TOLERANCE)
        return float(np.concatenate(on_mesh).mean())


def without_light(grey: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Divide deviations of grey values (H, W) from their local mean by their local spread."""
    values = grey.astype(np.float32)
    off = values - cv2.GaussianBlur(values, (0, 0), NEAR_PX)
    variance = cv2.GaussianBlur(off**2, (0, 0), NEAR_PX)
    scaled = 128 + LEVELS_PER_SPREAD * off / np.sqrt(variance + NOISE_LEVELS**2)
    return np.asarray(scaled.clip(0, 255), dtype=np.uint8)


def read_redrawn(place: StructureMap, file: Path, folder: Path, seed: int = 0) -> Redrawn:
    """Open the mesh that a map shows, to refine poses on.

    Args:
        place: The map.
        file: The mesh.
        folder: Folder of the map, for messages.
        seed: Seed of RANSAC's samples.

    Raises:
        InputError: The mesh cannot be read, or the map shows something else.
    """
    mesh = load_mesh(file, place.mesh_file.up_axis, place.mesh_file.unit_m)
    opened = Redrawn(place, mesh, mesh_from_map(place, file), seed)
    share = opened.share_on_mesh()
    if share < LEAST_ON_MESH:
        raise InputError(
            Argument("refine"),
            f"{file}: only {share:.0%} of the features of {folder} lie on this mesh",
            "give the one that its frames were rendered of, or that was scanned from its"
            " photographs",
        )
    return opened


def mesh_from_map(place: StructureMap, file: Path) -> Array:
    """Find the rigid motion (4, 4) from the world of a map to that of a scan, by the sequence's."""
    record = read_scan_record(file)
    if record is None or place.sequence_from_world is None:
        return np.eye(4)
    return np.asarray(inverse(record.sequence_from_world) @ place.sequence_from_world)
