"""Cost of normals, masks, overlaps and flow, and agreement of their pixels with Open3D's rays.

Writes a CSV, a row for each mesh and size of image::

    python -m benchmarks.layers results/mini/scenes/large_room/mesh.glb scan.glb

Frames are drawn from random places, which may be nearer to a surface than the camera's near plane:
rays begin there, too. Times are milliseconds of the processor, all threads together, median over
frames. A pixel is *clear* if Open3D's rays 0.02 pixels to the left, right, above and below of its
centre meet the same triangle as the one through it, and no other surface is within 0.1 mm behind
it: which of two such shows, single precision decides.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from synfeal.camera.projection import cell_centres_px, rays_of_pixels
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset.layer_files import mask_pixels, normal_pixels, normals_of_pixels
from synfeal.errors import exit_status
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.instances import number_instances
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.pairing.correspondence import TOLERANCE, DepthImage, State, points_of_pixels
from synfeal.pairing.flow import flow_between
from synfeal.pairing.overlap import GRID, grid_points, overlaps_with
from synfeal.records.tables import write_frame
from synfeal.render import open_renderer
from synfeal.render.surface import SurfaceTable

N_FRAMES = 6
MARGIN_PX = 0.02
APART_M = 1e-4

Array = NDArray[np.float64]


def free_poses(mesh: TexturedMesh, count: int, rng: np.random.Generator) -> Array:
    """Draw poses that look all round from the middle half of a mesh's bounds.

    Poses come in pairs whose cameras stand 3 % of the diagonal apart and look 15 degrees apart.

    Args:
        mesh: The mesh.
        count: Number of poses; even.
        rng: Source of places and directions.

    Returns:
        ``world_from_cam`` (count, 4, 4), one of a pair after the other.
    """
    lower, upper = mesh.bounds_m
    diagonal_m = float(np.linalg.norm(upper - lower))
    place = rng.uniform(0.25, 0.75, (count // 2, 3)) * (upper - lower) + lower
    rpy = rng.uniform([-0.2, -0.3, 0.0], [0.2, 0.3, 2 * np.pi], (count // 2, 3))
    way = rng.standard_normal((count // 2, 3))
    moved = place + 0.03 * diagonal_m * way / np.linalg.norm(way, axis=1, keepdims=True)
    both = [(rpy, place), (rpy + np.array([0.02, 0.05, 0.25]), moved)]
    poses = [pose_matrix(rotation_from_rpy(angles), position) for angles, position in both]
    return np.stack(poses, axis=1).reshape(-1, 4, 4)


class Open3dRays:
    """First hits by Open3D's ray-casting scene."""

    def __init__(self, mesh: TexturedMesh) -> None:
        """Build the scene; ids of triangles are those of ``mesh.merged()``."""
        import open3d as o3d

        self._tensor = o3d.core.Tensor.from_numpy
        self._centre_m = mesh.bounds_m.mean(axis=0)
        vertices_m, faces = mesh.merged()
        self._scene = o3d.t.geometry.RaycastingScene()
        self._scene.add_triangles(
            self._tensor((vertices_m - self._centre_m).astype(np.float32)),
            self._tensor(faces.astype(np.uint32)),
        )

    def faces(self, camera: CameraConfig, pose: Array, step_px: tuple[float, float]) -> Any:
        """Find the triangle that shows a step from the centre of each pixel.

        Args:
            camera: Camera.
            pose: ``world_from_cam`` (4, 4).
            step_px: Step to the right and down, pixels.

        Returns:
            Triangles (H, W), -1 for none.
        """
        origin_m, rays = self._from_near_plane(camera, pose, step_px)
        return _face_of(self._cast(origin_m, rays))

    def stand_alone(self, camera: CameraConfig, pose: Array) -> Any:
        """Mark pixels (H, W) that have no other surface just behind the one they show.

        From :data:`APART_M` behind it, the way back must meet that surface first.
        """
        origin_m, rays = self._from_near_plane(camera, pose, (0.0, 0.0))
        unit = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
        met = self._cast(origin_m, unit)
        hit_m = met["t_hit"].numpy()[..., None]
        behind_m = origin_m + (np.where(np.isfinite(hit_m), hit_m, 0.0) + APART_M) * unit
        return (_face_of(self._cast(behind_m, -unit)) == _face_of(met)) | np.isinf(hit_m[..., 0])

    def _from_near_plane(
        self, camera: CameraConfig, pose: Array, step_px: tuple[float, float]
    ) -> tuple[Array, Array]:
        """Return origins and rays (H, W, 3) of pixels, from where the camera begins to see."""
        pixel = cell_centres_px(camera, camera.width, camera.height) + step_px
        rays = rays_of_pixels(camera, pixel) @ pose[:3, :3].T
        return pose[:3, 3] + camera.near_m * rays, rays

    def reached(self, camera: CameraConfig, pose: Array, point_m: Array) -> Any:
        """Measure how much of the way from a camera to each of some points is free.

        Args:
            camera: Camera; rays begin at its near plane.
            pose: ``world_from_cam`` (4, 4).
            point_m: Points (N, 3), world, metres.

        Returns:
            The free share (N,) of each way, 1 where all of it is; above 1 where what it meets lies
            beyond.
        """
        way = point_m - pose[:3, 3]
        begin = camera.near_m / (way @ pose[:3, 2])
        origin_m = pose[:3, 3] + begin[:, None] * way
        return begin + self._cast(origin_m, way)["t_hit"].numpy()

    def _cast(self, origin_m: Array, rays: Array) -> Any:
        origin = np.broadcast_to(origin_m - self._centre_m, rays.shape)
        both = np.concatenate([origin, rays], axis=-1).astype(np.float32)
        return self._scene.cast_rays(self._tensor(both))


def _face_of(hits: Any) -> Any:
    """Return the triangles of hits, -1 for none."""
    face = hits["primitive_ids"].numpy()
    return np.where(face == 2**32 - 1, -1, face.astype(np.int64))


def measure(path: Path, camera: CameraConfig) -> dict[str, object]:
    """Measure one mesh at one size, as a row of the table."""
    mesh = load_mesh(path)
    poses = free_poses(mesh, N_FRAMES, np.random.default_rng(0))
    rays = Open3dRays(mesh)
    table = SurfaceTable(mesh, camera, number_instances(mesh))
    times: dict[str, list[float]] = {}
    clear, agree, angles, stored_angles, depths = [], [], [], [], []
    with open_renderer(mesh, camera, RenderConfig(backend="opengl")) as renderer:
        renderer.render_faces(poses[0])
        for pose in poses:
            timed(times, "colour", partial(renderer.render, pose))
            depths.append(timed(times, "depth", partial(renderer.render_depth, pose)))
            found = timed(times, "faces", partial(renderer.render_faces, pose))
            seen = timed(times, "look_up", partial(table.look_up, found, pose))
            true = rays.faces(camera, pose, (0.0, 0.0))
            around = [(-MARGIN_PX, 0), (MARGIN_PX, 0), (0, -MARGIN_PX), (0, MARGIN_PX)]
            is_clear = np.all([rays.faces(camera, pose, s) == true for s in around], axis=0)
            is_clear &= rays.stand_alone(camera, pose)
            clear.append(is_clear)
            agree.append(found == true)
            expected = table.look_up(true.astype(np.int32), pose).normals_cam
            angles.append(angle_deg(seen.normals_cam, expected)[is_clear])
            pixels = normal_pixels(seen.normals_cam)
            mask_pixels(seen.ids)
            stored_angles.append(angle_deg(normals_of_pixels(pixels), expected)[is_clear])
    medians = {f"{name}_ms": float(np.median(each)) for name, each in times.items()}
    return {
        "mesh": path.parent.name if path.stem == "mesh" else path.stem,
        "faces": mesh.n_faces,
        "parts": len(mesh.parts),
        "width": camera.width,
        "height": camera.height,
        **medians,
        "clear_share": np.mean(clear),
        "agree_share": np.mean(agree),
        "agree_share_clear": np.mean(np.array(agree)[np.array(clear)]),
        "normal_error_deg": float(np.median(np.concatenate(angles))),
        "normal_error_deg_p999": float(np.quantile(np.concatenate(angles), 0.999)),
        "stored_error_deg": float(np.quantile(np.concatenate(stored_angles), 0.99)),
        **pair_values(camera, depths, poses, rays),
    }


def pair_values(
    camera: CameraConfig, depths: Sequence[NDArray[np.float32]], poses: Array, rays: Open3dRays
) -> dict[str, float]:
    """Measure overlaps and flow between pairs of neighbouring views, and check them by rays.

    Args:
        camera: Camera of the views.
        depths: Depth (H, W) of each view, metres.
        poses: ``world_from_cam`` (N, 4, 4), one of a pair after the other.
        rays: Rays into the same mesh.

    Returns:
        Processor milliseconds of an overlap and of a flow, the share of visible pixels, and the
        share of pixels whose state is the one that rays find.
    """
    times: dict[str, list[float]] = {}
    points = grid_points(camera, depths.__getitem__, poses, GRID, lambda: None)
    rows = np.arange(len(depths)).repeat(20)
    pixel = cell_centres_px(camera, camera.width, camera.height)
    agree, visible = [], []
    for index, depth_m in enumerate(depths):
        other = index + 1 - 2 * (index % 2)
        image = DepthImage(depth_m)
        compare = partial(overlaps_with, points, rows, camera, image, poses[index], TOLERANCE)
        timed(times, "overlap", compare)
        flow = partial(
            flow_between,
            camera=camera,
            depth_a_m=depth_m,
            world_from_a=poses[index],
            depth_b_m=depths[other],
            world_from_b=poses[other],
        )
        state = timed(times, "flow", flow).state
        inside = (state == State.VISIBLE) | (state == State.HIDDEN)
        point_m = points_of_pixels(camera, pixel, depth_m, poses[index])[inside]
        is_visible = rays.reached(camera, poses[other], point_m) > 1.0 - TOLERANCE
        agree.append((state[inside] == State.VISIBLE) == is_visible)
        visible.append(is_visible)
    return {
        "overlap_ms_per_pair": float(np.median(times["overlap"])) / len(rows),
        "flow_ms_per_pair": float(np.median(times["flow"])),
        "visible_share": float(np.mean(np.concatenate(visible))),
        "state_agree_share": float(np.mean(np.concatenate(agree))),
    }


def timed(times: dict[str, list[float]], name: str, work: Callable[[], Any]) -> Any:
    """Run some work, and note the processor time it took.

    Args:
        times: Milliseconds of each run by name, which is added to.
        name: Name of the work.
        work: Function to run.

    Returns:
        What ``work`` returned.
    """
    began = time.process_time()
    value = work()
    times.setdefault(name, []).append(1e3 * (time.process_time() - began))
    return value


def angle_deg(a: NDArray[np.float32], b: NDArray[np.float32]) -> Array:
    """Compute the angles (H, W) between vectors (H, W, 3), degrees; 0 between zeros."""
    sine = np.linalg.norm(np.cross(a.astype(float), b.astype(float)), axis=-1)
    return np.asarray(np.degrees(np.arctan2(sine, np.einsum("hwi,hwi->hw", a, b))))


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure meshes at sizes."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.layers", description=__doc__)
    parser.add_argument("meshes", nargs="+", type=Path)
    parser.add_argument("--sizes", nargs="+", default=["320x240", "640x480"], metavar="WxH")
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks/layers.csv"))
    options = parser.parse_args(arguments)

    def run() -> None:
        rows = []
        for path in options.meshes:
            for size in options.sizes:
                width, height = map(int, size.split("x"))
                rows.append(measure(path, CameraConfig(width=width, height=height)))
                write_frame(options.out, pd.DataFrame(rows), "%.5g")

    return exit_status(run, "rows that were measured are kept")


if __name__ == "__main__":
    sys.exit(main())
