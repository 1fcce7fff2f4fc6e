"""How fast frames are drawn and how wrong they are: by backend, samples, and detail of the mesh."""

from __future__ import annotations

import importlib.util
import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from reproduction.config.profile import RenderSpeedConfig
from reproduction.speed.collection import PAPER_CAMERA
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset.pose_table import read_pose_table
from synfeal.dataset.render_sequence import resolved
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.triangles import with_fewer_faces, with_smaller_textures
from synfeal.records.tables import COUNT, NUMBER, TEXT, frame_of, write_frame
from synfeal.records.timing import seconds_of
from synfeal.render import choose, open_renderer
from synfeal.render.base import SAMPLES_PER_AXIS, Depth, Renderer, Rgb, reference_images

LARGEST_PX = 8192 // SAMPLES_PER_AXIS  # of a side, so that the reference is an image in OpenGL
SUPERSAMPLING = {"opengl": (1, 2, 3), "pyrender": (1, 2, 3), "raycast": (1, 2)}
FACTORS = (2, 4)  # that textures are made smaller by, and triangles fewer
ROUNDS = 2
DEPTH_OFF_MM = 10.0

# A row of ``render_speed.csv``: one way to draw the frames of one camera. ``texture_scale`` is the
# side of the textures over that of the scene's own; errors of colour are from 64 samples per pixel,
# in levels of 0 to 255 and as peak signal-to-noise ratio; those of depth from the full mesh's at
# the same pixel centres, where both hit, and the share of these pixels off by more than 10 mm.
SCHEMA = {
    **{"backend": TEXT, "width": COUNT, "height": COUNT, "supersampling": COUNT},
    **{"texture_scale": NUMBER, "faces": COUNT, "ms_per_frame": NUMBER},
    **{"mean_abs_error": NUMBER, "psnr_db": NUMBER},
    **{"depth_error_mm": NUMBER, "depth_off_share": NUMBER, "chosen": COUNT},
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
        """A renderer through ``camera``."""
        return open_renderer(self.mesh, camera, self.render)


def write_render_speed(
    mesh: Path,  # in the world frame
    plan: Path,  # table of poses
    network_camera: CameraConfig,  # of the profile; see :func:`measured_cameras`
    groundtruth_camera: CameraConfig,  # likewise
    render_speed: RenderSpeedConfig,  # how many sizes, and views through the smallest
    render: RenderConfig,  # what the profile renders with
    out_speed: Path,  # one row per camera and variant, columns :data:`SCHEMA`
) -> None:
    """Measure on poses spread evenly over a plan, and write the rows; times differ between runs."""
    every = read_pose_table(plan).world_from_cam
    count = min(render_speed.poses, len(every))
    poses = every[np.linspace(0, len(every) - 1, count).astype(int)]
    cameras = measured_cameras(network_camera, groundtruth_camera, render_speed.sizes)
    rows = measure_speed(load_mesh(mesh), cameras, poses, resolved(render))
    write_frame(out_speed, rows, float_format=None)


def measured_cameras(
    network: CameraConfig, groundtruth: CameraConfig, count: int
) -> list[CameraConfig]:
    """The first ``count`` sizes of the profile's two cameras and the paper's, smallest first.

    Images with more than 1024 pixels along a side are too large for the reference and left out.
    """
    by_size = {(c.width, c.height): c for c in (PAPER_CAMERA, groundtruth, network)}
    fitting = [size for size in by_size if max(size) <= LARGEST_PX]
    return [by_size[size] for size in sorted(fitting, key=np.prod)[:count]]


def measure_speed(
    mesh: TexturedMesh, cameras: Sequence[CameraConfig], poses: Poses, render: RenderConfig
) -> pd.DataFrame:
    """Every variant through every camera, the chosen one of each camera first: ``SCHEMA``.

    Backends that take seconds per frame draw through the first camera, the smallest, alone; the
    larger ones take every other pose (P, 4, 4). ``render`` names its backend.
    """
    chosen = Variant(mesh, render)
    details = less_detailed(chosen)
    rows = []
    for index, camera in enumerate(cameras):
        others = [*other_settings(chosen, with_slow=index == 0), *details]
        rows += measure_camera(chosen, others, camera, poses if index == 0 else poses[::2])
        log.info("%dx%d: %d variants measured", camera.width, camera.height, len(others) + 1)
    return frame_of(rows, SCHEMA)


def other_settings(chosen: Variant, with_slow: bool) -> list[Variant]:
    """The full mesh with all backends that work here and numbers of samples but the chosen."""
    names = [
        name
        for name in choose.BACKENDS
        if (with_slow or name in ("opengl", "pyrender", chosen.render.backend))
        and choose.why_not(name) is None
    ]
    settings = [RenderConfig(backend=n, supersampling=k) for n in names for k in SUPERSAMPLING[n]]
    return [Variant(chosen.mesh, render) for render in settings if render != chosen.render]


def less_detailed(chosen: Variant) -> list[Variant]:
    """The chosen settings with smaller textures, and with fewer triangles."""
    mesh, render = chosen.mesh, chosen.render
    variants = [Variant(with_smaller_textures(mesh, k), render, 1.0 / k) for k in FACTORS]
    if importlib.util.find_spec("meshoptimizer") is None:
        log.warning(
            "meshoptimizer is not installed: meshes of fewer triangles are not measured;"
            " pip install meshoptimizer, which needs a C++ compiler"
        )
        return variants
    return variants + [Variant(with_fewer_faces(mesh, mesh.n_faces // k), render) for k in FACTORS]


def measure_camera(
    chosen: Variant, others: Sequence[Variant], camera: CameraConfig, poses: Poses
) -> list[dict[str, object]]:
    """Each variant beside the chosen one, in turns with it.

    What else the machine does slows both: their ratio is free of that, and is applied to the median
    of all times of the chosen one.
    """
    truth = truth_of(chosen, camera, poses)
    beside = []
    with chosen.opened(camera) as yardstick:
        errors = [errors_of(yardstick, poses, truth)]
        for variant in others:
            with variant.opened(camera) as renderer:
                errors.append(errors_of(renderer, poses, truth))
                beside.append(seconds_in_turns([yardstick, renderer], poses))
    chosen_ms = 1e3 * float(np.median([seconds[:, 0] for seconds in beside]))
    ratios = [1.0, *(float(np.median(seconds[:, 1] / seconds[:, 0])) for seconds in beside)]
    return [
        {
            "backend": variant.render.backend,
            **{"width": camera.width, "height": camera.height},
            "supersampling": variant.render.supersampling,
            "texture_scale": variant.texture_scale,
            "faces": variant.mesh.n_faces,
            "ms_per_frame": round(chosen_ms * ratio, 4),
            **wrong,
            "chosen": int(variant is chosen),
        }
        for variant, ratio, wrong in zip([chosen, *others], ratios, errors, strict=True)
    ]


def truth_of(chosen: Variant, camera: CameraConfig, poses: Poses) -> Truth:
    """Colours by 64 samples of the chosen backend, and depth by rays against the full mesh."""
    mesh = chosen.mesh
    plain = chosen.render.model_copy(update={"supersampling": 1})
    views = reference_images(lambda large: open_renderer(mesh, large, plain), camera, poses)
    # Depth needs no texture but those that cut something out.
    bare = [p if p.alpha_cutoff is not None else replace(p, texture=None) for p in mesh.parts]
    rays = RenderConfig(backend="raycast", supersampling=1)
    with open_renderer(replace(mesh, parts=tuple(bare)), camera, rays) as renderer:
        depth_m = np.stack([renderer.render_rgbd(pose)[1] for pose in poses])
    return np.stack(list(views)), depth_m


def errors_of(renderer: Renderer, poses: Poses, truth: Truth) -> dict[str, float]:
    """How far the views of a renderer are from the truth; it has drawn each once afterwards."""
    views = [renderer.render_rgbd(pose) for pose in poses]
    rgb, depth_m = (np.stack(images) for images in zip(*views, strict=True))
    return colour_errors(rgb, truth[0]) | depth_errors(depth_m, truth[1])


def colour_errors(rgb: Rgb, expected: NDArray[np.float32]) -> dict[str, float]:
    """Mean absolute difference in levels of 0 to 255, and peak signal-to-noise ratio in dB."""
    difference = rgb - expected
    mean_square = float(np.mean(difference**2, dtype=np.float64))
    return {
        "mean_abs_error": round(float(np.abs(difference).mean(dtype=np.float64)), 5),
        "psnr_db": round(10.0 * float(np.log10(255.0**2 / mean_square)), 4),
    }


def depth_errors(depth_m: Depth, expected_m: Depth) -> dict[str, float]:
    """Median difference in millimetres, and the share of more than 10 mm, where both hit."""
    hit = np.isfinite(depth_m) & np.isfinite(expected_m)
    off_mm = 1e3 * np.abs(depth_m[hit].astype(np.float64) - expected_m[hit])
    return {
        "depth_error_mm": round(float(np.median(off_mm)), 5),
        "depth_off_share": round(float(np.mean(off_mm > DEPTH_OFF_MM)), 6),
    }


def seconds_in_turns(renderers: Sequence[Renderer], poses: Poses) -> NDArray[np.float64]:
    """Times (rounds * P, R) of R renderers, which draw each colour image in turns."""
    return np.array(
        [
            seconds_of(partial(renderer.render, pose) for renderer in renderers)
            for _ in range(ROUNDS)
            for pose in poses
        ]
    )
