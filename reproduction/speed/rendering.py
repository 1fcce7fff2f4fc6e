"""Speed and error of rendering by backend, samples, and detail of the mesh."""

from __future__ import annotations

import importlib.util
import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from reproduction.config.profile import RenderSpeedConfig
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset.pose_table import read_pose_table
from synfeal.dataset.render_sequence import resolved
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.triangles import with_fewer_faces, with_smaller_textures
from synfeal.records.files import read_json
from synfeal.records.tables import COUNT, LIMITLESS, NUMBER, TEXT, frame_of, write_frame
from synfeal.records.timing import seconds_of
from synfeal.render import choose, open_renderer
from synfeal.render.base import SAMPLES_PER_AXIS, Depth, Renderer, Rgb, reference_images

LARGEST_PX = 8192 // SAMPLES_PER_AXIS  # so that the reference fits an image in OpenGL
SUPERSAMPLING = {"opengl": (1, 2, 3), "pyrender": (1, 2, 3), "raycast": (1, 2)}
FACTORS = (2, 4)  # that textures are made smaller by, and triangles fewer
ROUNDS = 2
DEPTH_OFF_MM = 10.0

# A row of ``render_speed.csv``: one way to draw the frames of one camera. ``texture_scale`` is the
# side of the textures over that of the scene's own; errors of colour are from 64 samples per pixel,
# in levels of 0 to 255 and as peak signal-to-noise ratio; those of depth from the full mesh's at
# the same pixel centres, where both hit, and the share of these pixels off by more than 10 mm.
SCHEMA = {
    "backend": TEXT,
    "width": COUNT,
    "height": COUNT,
    "supersampling": COUNT,
    "texture_scale": NUMBER,
    "faces": COUNT,
    "ms_per_frame": NUMBER,
    "mean_abs_error": NUMBER,
    "psnr_db": LIMITLESS,
    "depth_error_mm": NUMBER,
    "depth_off_share": NUMBER,
    "chosen": COUNT,
}

log = logging.getLogger("synfeal")
Poses = NDArray[np.float64]
# What P views should show: colours (P, H, W, 3) in 0 to 255, and depth (P, H, W), metres.
Truth = tuple[NDArray[np.float32], Depth]


@dataclass(frozen=True)
class Variant:
    """A way to draw: the mesh, perhaps with less detail, and how."""

    mesh: TexturedMesh
    render: RenderConfig
    texture_scale: float = 1.0

    def opened(self, camera: CameraConfig) -> Renderer:
        """Open a renderer through ``camera``."""
        return open_renderer(self.mesh, camera, self.render)


@dataclass(frozen=True)
class MeasuredCamera:
    """A camera in use, and what its colours are drawn of.

    Attributes:
        camera: Camera of the profile.
        detail: Mesh with less detail that the level of detail chose; None for the full mesh.
        texture_scale: Side of its textures over that of the scene's own.
    """

    camera: CameraConfig
    detail: TexturedMesh | None = None
    texture_scale: float = 1.0


def write_render_speed(
    mesh: Path,
    plan: Path,
    cameras: Sequence[CameraConfig],
    details: Sequence[Path],
    records: Sequence[Path],
    render_speed: RenderSpeedConfig,
    render: RenderConfig,
    out_speed: Path,
) -> None:
    """Measure on poses spread evenly over a plan, and write the rows; times differ between runs.

    Args:
        mesh: Full mesh of the scene, world frame.
        plan: Pose table.
        cameras: Cameras that frames of the scene are rendered through.
        details: Meshes that the colours of each camera are drawn of; none where all draw the full
            mesh.
        records: Records of these levels of detail.
        render_speed: Number of sizes, and of views through the smallest.
        render: What the profile renders with.
        out_speed: One row per camera and variant, columns :data:`SCHEMA`.
    """
    every = read_pose_table(plan).world_from_cam
    count = min(render_speed.poses, len(every))
    poses = every[np.linspace(0, len(every) - 1, count).astype(int)]
    measured = [MeasuredCamera(camera) for camera in cameras]
    if details:
        measured = [
            MeasuredCamera(
                camera=camera,
                detail=load_mesh(detail),
                texture_scale=read_json(record)["texture_scale"],
            )
            for camera, detail, record in zip(cameras, details, records, strict=True)
        ]
    smallest = smallest_first(measured)[: render_speed.sizes]
    rows = measure_speed(load_mesh(mesh), smallest, poses, resolved(render))
    write_frame(out_speed, rows, float_format=None)


def smallest_first(cameras: Sequence[MeasuredCamera]) -> list[MeasuredCamera]:
    """Order cameras by size, each size once.

    Images with more than 1024 pixels along a side are too large for the reference and left out.
    """
    by_size = {(c.camera.width, c.camera.height): c for c in reversed(cameras)}
    fitting = [size for size in by_size if max(size) <= LARGEST_PX]
    return [by_size[size] for size in sorted(fitting, key=np.prod)]


def measure_speed(
    mesh: TexturedMesh, cameras: Sequence[MeasuredCamera], poses: Poses, render: RenderConfig
) -> pd.DataFrame:
    """Measure every variant through every camera.

    Backends that take seconds per frame draw through the first camera, the smallest, alone; the
    larger ones take every other pose.

    Args:
        mesh: The full mesh, world frame.
        cameras: Cameras in use, smallest first.
        poses: ``world_from_cam`` (P, 4, 4).
        render: Settings in use, which name their backend.

    Returns:
        Rows with the columns of :data:`SCHEMA`. The first of each camera is the full mesh with the
        settings in use; the chosen one is what the pipeline draws.
    """
    full = Variant(mesh, render)
    details = less_detailed(full)
    rows = []
    for index, used in enumerate(cameras):
        chosen = full
        others = [*other_settings(full, with_slow=index == 0), *details]
        if used.detail is not None:
            chosen = Variant(used.detail, render, used.texture_scale)
            others.insert(0, chosen)
        camera = used.camera
        seen = poses if index == 0 else poses[::2]
        rows += measure_camera(full, others, camera, seen, chosen)
        log.info("%dx%d: %d variants measured", camera.width, camera.height, len(others) + 1)
    return frame_of(rows, SCHEMA)


def other_settings(full: Variant, with_slow: bool) -> list[Variant]:
    """List the full mesh with all backends that work here and all numbers of samples not in use."""
    names = [
        name
        for name in choose.BACKENDS
        if (with_slow or name in ("opengl", "pyrender", full.render.backend))
        and choose.why_not(name) is None
    ]
    settings = [RenderConfig(backend=n, supersampling=k) for n in names for k in SUPERSAMPLING[n]]
    return [Variant(full.mesh, render) for render in settings if render != full.render]


def less_detailed(full: Variant) -> list[Variant]:
    """List the settings in use with smaller textures, and with fewer triangles."""
    mesh, render = full.mesh, full.render
    variants = [Variant(with_smaller_textures(mesh, k), render, 1.0 / k) for k in FACTORS]
    if importlib.util.find_spec("meshoptimizer") is None:
        log.warning(
            "meshoptimizer is not installed: meshes of fewer triangles are not measured;"
            " pip install meshoptimizer, which needs a C++ compiler"
        )
        return variants
    return variants + [Variant(with_fewer_faces(mesh, mesh.n_faces // k), render) for k in FACTORS]


def measure_camera(
    full: Variant,
    others: Sequence[Variant],
    camera: CameraConfig,
    poses: Poses,
    chosen: Variant,
) -> list[dict[str, object]]:
    """Measure each variant in turns with the full mesh as it is drawn in use.

    What else the machine does slows both: their ratio is free of that, and is applied to the median
    of all times of the full mesh.

    Args:
        full: The full mesh with the settings in use.
        others: Variants to measure.
        camera: Camera of the frames.
        poses: Poses ``world_from_cam`` to draw.
        chosen: Variant that the profile uses.

    Returns:
        A row per variant.
    """
    truth = truth_of(full, camera, poses)
    beside = []
    with full.opened(camera) as yardstick:
        errors = [errors_of(yardstick, poses, truth)]
        for variant in others:
            with variant.opened(camera) as renderer:
                errors.append(errors_of(renderer, poses, truth))
                beside.append(seconds_in_turns([yardstick, renderer], poses))
    full_ms = 1e3 * float(np.median([seconds[:, 0] for seconds in beside]))
    ratios = [1.0, *(float(np.median(seconds[:, 1] / seconds[:, 0])) for seconds in beside)]
    return [
        {
            "backend": variant.render.backend,
            "width": camera.width,
            "height": camera.height,
            "supersampling": variant.render.supersampling,
            "texture_scale": variant.texture_scale,
            "faces": variant.mesh.n_faces,
            "ms_per_frame": round(full_ms * ratio, 4),
            **wrong,
            "chosen": int(variant is chosen),
        }
        for variant, ratio, wrong in zip([full, *others], ratios, errors, strict=True)
    ]


def truth_of(full: Variant, camera: CameraConfig, poses: Poses) -> Truth:
    """Render reference images of a mesh: colours by 64 samples per pixel, depth by ray casting.

    Args:
        full: The full mesh, and the backend to draw its colours with.
        camera: Camera of the images.
        poses: ``world_from_cam`` (P, 4, 4).

    Returns:
        Colours (P, H, W, 3), 0 to 255, and depth (P, H, W), metres.
    """
    mesh = full.mesh
    plain = full.render.model_copy(update={"supersampling": 1})
    views = reference_images(lambda large: open_renderer(mesh, large, plain), camera, poses)
    # Depth needs no texture but those that cut something out.
    bare = [p if p.alpha_cutoff is not None else replace(p, texture=None) for p in mesh.parts]
    rays = RenderConfig(backend="raycast", supersampling=1)
    with open_renderer(replace(mesh, parts=tuple(bare)), camera, rays) as renderer:
        depth_m = np.stack([renderer.render_rgbd(pose)[1] for pose in poses])
    return np.stack(list(views)), depth_m


def errors_of(renderer: Renderer, poses: Poses, truth: Truth) -> dict[str, float]:
    """Measure how far a renderer's views are from the truth.

    Each view is drawn, so that what a first drawing takes longer is not timed afterwards.

    Args:
        renderer: Renderer to judge.
        poses: ``world_from_cam`` (P, 4, 4).
        truth: Colours and depth of the same views, by :func:`truth_of`.

    Returns:
        What :func:`color_errors` and :func:`depth_errors` return, in one mapping.
    """
    views = [renderer.render_rgbd(pose) for pose in poses]
    rgb, depth_m = (np.stack(images) for images in zip(*views, strict=True))
    return color_errors(rgb, truth[0]) | depth_errors(depth_m, truth[1])


def color_errors(rgb: Rgb, expected: NDArray[np.float32]) -> dict[str, float]:
    """Compute the mean absolute difference in levels of 0 to 255, and the PSNR in dB.

    The latter is infinite where there is no difference.
    """
    difference = rgb - expected
    mean_square = float(np.mean(difference**2, dtype=np.float64))
    psnr_db = 10.0 * math.log10(255.0**2 / mean_square) if mean_square else math.inf
    return {
        "mean_abs_error": round(float(np.abs(difference).mean(dtype=np.float64)), 5),
        "psnr_db": round(psnr_db, 4),
    }


def depth_errors(depth_m: Depth, expected_m: Depth) -> dict[str, float]:
    """Compute the median difference in millimetres, and the share above 10 mm, where both hit."""
    hit = np.isfinite(depth_m) & np.isfinite(expected_m)
    off_mm = 1e3 * np.abs(depth_m[hit].astype(np.float64) - expected_m[hit])
    return {
        "depth_error_mm": round(float(np.median(off_mm)), 5),
        "depth_off_share": round(float(np.mean(off_mm > DEPTH_OFF_MM)), 6),
    }


def seconds_in_turns(renderers: Sequence[Renderer], poses: Poses) -> NDArray[np.float64]:
    """Time R renderers (rounds * P, R), which draw each colour image in turns."""
    return np.array(
        [
            seconds_of(partial(renderer.render, pose) for renderer in renderers)
            for _ in range(ROUNDS)
            for pose in poses
        ]
    )
