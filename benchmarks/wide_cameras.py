"""Cost and exactness of a frame through each kind of camera.

    python -m benchmarks.wide_cameras results/benchmarks/wide_cameras.csv room.glb scan.glb

draws the same independent poses of each mesh through a perspective camera, a fisheye and a panorama
of as many pixels, and compares depth with rays. Times are processor time; what is opened once for
all frames is a column of its own. ``--picture FILE`` puts one frame of each beside the others.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from PIL import Image

from synfeal.api import load_mesh, plan
from synfeal.camera.projection import cell_directions
from synfeal.config.dataset import CameraConfig
from synfeal.mesh.rays import RayCaster
from synfeal.records.tables import write_frame
from synfeal.render import open_renderer

Array = NDArray[np.float64]

CAMERAS = {
    "perspective 60": CameraConfig(width=640, height=480),
    "perspective 90": CameraConfig(width=640, height=480, horizontal_fov_deg=90.0),
    "fisheye 120": CameraConfig(
        width=640, height=480, projection="fisheye", horizontal_fov_deg=120.0
    ),
    "fisheye 190": CameraConfig(
        width=554, height=554, projection="fisheye", horizontal_fov_deg=190.0
    ),
    "panorama": CameraConfig(width=784, height=392, projection="equirectangular"),
}
PICTURED = ("perspective 90", "fisheye 190", "panorama")
PICTURE_HEIGHT_PX = 240


def seconds_per_frame(draw: Callable[[Array], object], poses: Array) -> float:
    """Return the mean processor time of a frame, the first left out."""
    draw(poses[0])
    began = time.process_time()
    for pose in poses:
        draw(pose)
    return (time.process_time() - began) / len(poses)


def depth_errors_m(
    caster: RayCaster, camera: CameraConfig, poses: Array, depths_m: list[NDArray[np.float32]]
) -> Array:
    """Compare the depth of frames with that of rays through the same pixels.

    Args:
        caster: Rays into the mesh.
        camera: Camera of the frames.
        poses: ``world_from_cam`` (P, 4, 4).
        depths_m: Depth (H, W) of each frame, metres.

    Returns:
        Absolute differences (N,) of the pixels that the frame shows a surface in, metres.
    """
    rays = cell_directions(camera, camera.width, camera.height).reshape(-1, 3)
    errors = []
    for pose, depth_m in zip(poses, depths_m, strict=True):
        found = depth_m.reshape(-1)
        known = np.isfinite(found) & np.isfinite(rays).all(axis=1)
        direction = rays[known] @ pose[:3, :3].T
        start = np.broadcast_to(pose[:3, 3], direction.shape)
        cast = caster.first_hit_m(start, direction) / np.linalg.norm(rays[known], axis=1)
        errors.append(np.abs(cast - found[known]))
    return np.concatenate(errors)


def main() -> None:
    """Measure every camera on every mesh and write a row for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("meshes", type=Path, nargs="+")
    parser.add_argument("--frames", type=int, default=6)
    parser.add_argument("--picture", type=Path)
    args = parser.parse_args()
    rows, strips = [], []
    for path in args.meshes:
        mesh = load_mesh(path)
        caster = RayCaster(*mesh.merged())
        table = plan(path, args.frames, mode="random", min_clearance_m=0.3)
        poses, strip = table.world_from_cam, []
        for name, camera in CAMERAS.items():
            began = time.process_time()
            with open_renderer(mesh, camera) as renderer:
                opened_s = time.process_time() - began
                color_s = seconds_per_frame(renderer.render, poses)
                rgbd_s = seconds_per_frame(renderer.render_rgbd, poses)
                depths_m = [renderer.render_depth(pose) for pose in poses]
                if name in PICTURED:
                    strip.append(Image.fromarray(renderer.render(poses[0])))
            error_m = depth_errors_m(caster, camera, poses, depths_m)
            rows.append(
                {
                    "mesh": path.parent.name if path.stem in ("mesh", "scene") else path.stem,
                    "faces": mesh.n_faces,
                    "camera": name,
                    "width": camera.width,
                    "height": camera.height,
                    "open_s": opened_s,
                    "color_ms": 1000.0 * color_s,
                    "color_and_depth_ms": 1000.0 * rgbd_s,
                    "depth_error_median_mm": 1000.0 * np.median(error_m),
                    "depth_within_1mm": np.mean(error_m <= 1e-3),
                }
            )
            write_frame(args.table, pd.DataFrame(rows), "%.4g")
            print(rows[-1], flush=True)
        strips.append(strip)
    if args.picture is not None:
        beside(strips).save(args.picture, quality=85)


def beside(strips: list[list[Image.Image]]) -> Image.Image:
    """Put images of one height beside each other, a row for each mesh."""
    height = PICTURE_HEIGHT_PX
    scaled = [
        [image.resize((round(image.width * height / image.height), height)) for image in strip]
        for strip in strips
    ]
    width = max(sum(image.width for image in strip) for strip in scaled)
    page = Image.new("RGB", (width, height * len(scaled)))
    for row, strip in enumerate(scaled):
        left = 0
        for image in strip:
            page.paste(image, (left, row * height))
            left += image.width
    return page


if __name__ == "__main__":
    main()
