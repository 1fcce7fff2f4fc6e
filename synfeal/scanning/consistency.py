"""Do photographs agree on what colour each point of the surface has?

Points of the surface are looked up in every photograph that sees them. With the right calibration
a point looks alike in all of them; with a wrong one each photograph shows another place. The number
is the share of the photographs' variance that lies within points: 0 for photographs that agree to
the last bit, 1 for photographs that have nothing to do with the surface. It needs no truth and no
bound: it is lowest at the calibration that the photographs were taken with, so the best focal
length and principal point can be found, and the given ones be compared with them.

On a real sequence (Kinect, 640x480) it is 0.13 at 525 px, the driver's value, 0.26 at 585 px, the
depth camera's, and lowest with 0.11 at 521 px.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from synfeal.camera.projection import Intrinsics
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.depth_agreement import spread
from synfeal.dataset.posed_sequence import PosedFrames
from synfeal.geometry.poses import inverse
from synfeal.scanning.camera import RgbdCamera
from synfeal.scanning.fusion import FusedSurface
from synfeal.scanning.seen import Floats, project, sampled, seen_points, within

N_POINTS, N_FRAMES = 40_000, 60
SHRINK = 2  # sides of photographs: averages noise and compression, and widens the valley
MIN_SIGHTINGS = 3  # frames that must see a point for it to count
LUMA = np.array([0.299, 0.587, 0.114], np.float32)
# The fit: steps it begins with and how far it may go; beyond, what is given is not nearly right.
STEP_FOCAL, STEP_CENTRE, MOST_FOCAL = 0.01, 0.005, 0.25
MIN_GAIN = 0.02  # a fitted calibration replaces the given one if it agrees better by this share


@dataclass(frozen=True)
class Sightings:
    """Points of a surface as photographs see them, whatever their colour calibration.

    Attributes:
        vertex: (S,) which point, over all photographs one after the other.
        in_color_cam_m: For each photograph the points in its camera (M, 3), metres.
        photographs: Their brightness (H, W, 1), shrunk.
        n_points: Points in all.
    """

    vertex: NDArray[np.int64]
    in_color_cam_m: tuple[Floats, ...]
    photographs: tuple[Floats, ...]
    n_points: int

    def disagreement(self, camera: CameraConfig) -> float:
        """Return the share of variance within points, 0 to about 1; NaN where too few are seen.

        Args:
            camera: Camera of the photographs at their full size.
        """
        small = shrunk(camera, SHRINK)
        values = np.zeros(len(self.vertex), np.float32)
        inside = np.zeros(len(self.vertex), bool)
        start = 0
        for local, photograph in zip(self.in_color_cam_m, self.photographs, strict=True):
            pixel = project(local, small)
            good = within(pixel, small.width, small.height, 1.0)
            here = slice(start, start + len(local))
            inside[here] = good
            values[here][good] = sampled(photograph, pixel[good])[:, 0]
            start = here.stop
        vertex, value = self.vertex[inside], values[inside].astype(np.float64)
        count = np.bincount(vertex, minlength=self.n_points)
        first = np.bincount(vertex, value, self.n_points)
        second = np.bincount(vertex, value**2, self.n_points)
        often = count >= MIN_SIGHTINGS
        if not often.any() or not value.var() > 0:
            return float("nan")
        squares = (second[often] - first[often] ** 2 / count[often]).sum()
        return float(squares / (count[often] - 1).sum() / value.var())


def shrunk(camera: CameraConfig, factor: int) -> CameraConfig:
    """Return the camera of images whose sides are one ``factor``-th as long."""
    pinhole = {name: value / factor for name, value in camera.intrinsics._asdict().items()}
    size = {"width": camera.width // factor, "height": camera.height // factor}
    return camera.model_copy(update={**pinhole, **size})


def sightings_of(
    surface: FusedSurface,
    frames: PosedFrames,
    camera: RgbdCamera,
    on_frame: Callable[[], object] = lambda: None,
) -> Sightings:
    """Look up a sample of points in some of the photographs, evenly spread over the sequence.

    Args:
        surface: Points of the scan, with normals.
        frames: Photographs with depth images and poses.
        camera: Cameras of both.
        on_frame: Called after each photograph.
    """
    rng = np.random.default_rng(0)
    count = min(N_POINTS, len(surface.vertices_m))
    chosen = np.sort(rng.choice(len(surface.vertices_m), count, replace=False))
    points = surface.vertices_m[chosen].astype(np.float32)
    normals = surface.normals[chosen].astype(np.float32)
    color_from_depth = inverse(camera.depth_from_color)
    vertex, local, photographs = [], [], []
    for index in spread(len(frames), N_FRAMES):
        file = frames.depth[index]
        assert file is not None
        depth_m = camera.read_depth_m(file)
        pose = frames.world_from_cam[index] @ color_from_depth
        seen = seen_points(points, normals, depth_m, camera.depth, pose)
        moved = seen.in_depth_cam_m @ color_from_depth[:3, :3].T + color_from_depth[:3, 3]
        vertex.append(seen.index)
        local.append(moved.astype(np.float32))
        rgb = camera.read_color(frames.color[index], SHRINK).astype(np.float32)
        photographs.append((rgb @ LUMA)[..., None])
        on_frame()
    return Sightings(np.concatenate(vertex), tuple(local), tuple(photographs), count)


@dataclass(frozen=True)
class ColorFit:
    """The colour calibration that photographs agree with best, beside the given one.

    Attributes:
        given: What was given.
        fitted: The best, the same where nothing better was found.
        given_disagreement: Disagreement with the given calibration, see :class:`Sightings`.
        fitted_disagreement: Disagreement with the best.
    """

    given: CameraConfig
    fitted: CameraConfig
    given_disagreement: float
    fitted_disagreement: float

    @property
    def is_better(self) -> bool:
        """True where the fitted calibration is worth using."""
        return self.fitted_disagreement < (1.0 - MIN_GAIN) * self.given_disagreement

    @property
    def focal_change(self) -> float:
        """Relative change from the given focal length to the fitted one."""
        return self.fitted.intrinsics.fx / self.given.intrinsics.fx - 1.0

    @property
    def record(self) -> dict[str, float]:
        """Numbers, ready for JSON."""
        return {
            "given": self.given_disagreement,
            "best": self.fitted_disagreement,
            "best_focal_px": self.fitted.intrinsics.fx,
            "best_cx_px": self.fitted.intrinsics.cx,
            "best_cy_px": self.fitted.intrinsics.cy,
        }


def fit_color(sightings: Sightings, given: CameraConfig) -> ColorFit:
    """Find the focal length and principal point that photographs agree with best.

    Both focal lengths change by one factor; the lens stays as it is given.
    """
    before = sightings.disagreement(given)
    if not np.isfinite(before):
        return ColorFit(given, given, before, before)
    scale = np.array([1.0, given.width, given.width])

    def cost(change: NDArray[np.float64]) -> float:
        if np.abs(change).max() > MOST_FOCAL:
            return 1.0
        value = sightings.disagreement(changed(given, change * scale))
        return value if np.isfinite(value) else 1.0

    # The valley is narrow: its bottom is looked for on a line first.
    factors = np.linspace(-MOST_FOCAL, MOST_FOCAL, 41)[1:-1]
    along = [cost(np.array([factor, 0.0, 0.0])) for factor in factors]
    start = np.array([factors[int(np.argmin(along))], 0.0, 0.0])
    if cost(np.zeros(3)) <= min(along):
        start = np.zeros(3)
    steps = np.diag([STEP_FOCAL, STEP_CENTRE, STEP_CENTRE])
    found = minimize(
        cost,
        start,
        method="Nelder-Mead",
        options={
            "initial_simplex": np.vstack([start, start + steps]),
            "xatol": 3e-4,
            "fatol": 1e-5,
            "maxfev": 150,
        },
    )
    if not found.fun < before:
        return ColorFit(given, given, before, before)
    return ColorFit(given, changed(given, found.x * scale), before, float(found.fun))


def changed(camera: CameraConfig, change: NDArray[np.float64]) -> CameraConfig:
    """Change the intrinsics of a camera.

    Args:
        camera: Camera to begin with.
        change: Relative change of both focal lengths, and shifts of cx and cy in pixels: (3,).

    Returns:
        The camera with focal lengths multiplied by ``1 + change[0]`` and its principal point moved.
    """
    fx, fy, cx, cy = camera.intrinsics
    factor = 1.0 + float(change[0])
    moved = Intrinsics(fx * factor, fy * factor, cx + float(change[1]), cy + float(change[2]))
    return camera.model_copy(update=moved._asdict())


def with_color(camera: RgbdCamera, fit: ColorFit) -> RgbdCamera:
    """Return the sensor with the fitted calibration of its photographs."""
    return replace(camera, color=fit.fitted, source=f"{camera.source}, fitted to the photographs")
