"""Layers that follow from which triangle a pixel shows: its normal, and what it belongs to.

Normals are those of the triangles, not interpolated between vertices, in the frame of the camera
(x right, y down, z forward), and face the camera from whichever side a triangle is seen.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.projection import cell_directions
from synfeal.config.dataset import CameraConfig
from synfeal.mesh.instances import Instances
from synfeal.mesh.model import TexturedMesh
from synfeal.render.base import Faces

Normals = NDArray[np.float32]
Ids = NDArray[np.int32]


class Layers(NamedTuple):
    """Images that are made of a frame beside its colours."""

    depth: bool = False
    normals: bool = False
    masks: bool = False

    @property
    def of_surface(self) -> bool:
        """True if a layer needs to know which triangle each pixel shows."""
        return self.normals or self.masks


class SurfaceImage(NamedTuple):
    """Surface that the pixels of a frame show.

    Attributes:
        normals_cam: Unit normals (H, W, 3) in the frame of the camera; 0 0 0 for nothing.
        ids: Numbers (H, W) of instances, 0 for nothing.
    """

    normals_cam: Normals
    ids: Ids


class SurfaceTable:
    """Normals and instances of the triangles of a mesh, for frames of one camera."""

    def __init__(self, mesh: TexturedMesh, camera: CameraConfig, instances: Instances) -> None:
        """Compute the normal of each triangle of ``mesh``, and where each pixel looks."""
        vertices_m, faces = mesh.merged()
        corners_m = vertices_m[faces]
        normal = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        length[length == 0.0] = 1.0  # a triangle without area is never seen
        self._normals_world = np.concatenate([normal / length, np.zeros((1, 3))])
        self._ids = instances.of_faces(mesh)
        self._rays_cam = cell_directions(camera, camera.width, camera.height)

    def look_up(self, faces: Faces, world_from_cam: NDArray[np.float64]) -> SurfaceImage:
        """Return what the triangles of a frame are.

        Args:
            faces: Index (H, W) of the triangle that each pixel shows, -1 for nothing.
            world_from_cam: Pose (4, 4) of the frame.
        """
        normals_cam = (self._normals_world @ world_from_cam[:3, :3])[faces]
        away = np.einsum("hwi,hwi->hw", normals_cam, self._rays_cam) > 0.0
        normals_cam[away] *= -1.0
        return SurfaceImage(normals_cam.astype(np.float32) + np.float32(0.0), self._ids[faces])
