"""Frames of paths with effects, identical however the paths are divided into shards.

What depends on time is worked out along whole paths: a shard that begins in the middle of one looks
at the frames before it, and with auto-exposure draws them.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.projection import cell_directions
from synfeal.config.dataset import CameraConfig
from synfeal.config.effects import EffectsConfig, MotionBlurConfig
from synfeal.effects.light import (
    AutoExposure,
    Light,
    LightState,
    channel_gains,
    compressed,
    drawn_light,
    light_of,
    rgb_of,
    with_noise,
)
from synfeal.effects.scene import Crowd, SceneRenderer
from synfeal.geometry.poses import interpolate
from synfeal.records.provenance import generator_of
from synfeal.render.base import Depth, Rgb
from synfeal.render.surface import Ids, Layers, Normals

if TYPE_CHECKING:
    import pandas as pd

EFFECTS = (
    "light",
    "motion_blur",
    "exposure",
    "noise",
    "white_balance_k",
    "jpeg_quality",
    "clutter",  # last: what was drawn before there was it stays the same
)
# The middle of an object's bottom in the world, and its size before it is turned, metres.
PLACE = ("x_m", "y_m", "z_m", "size_x_m", "size_y_m", "size_z_m")


class Frame(NamedTuple):
    """A frame, and the layers of it that were asked for.

    Attributes:
        rgb: Colours (H, W, 3).
        depth_m: Depth (H, W), metres along the optical axis, inf for nothing.
        normals_cam: Unit normals (H, W, 3) in the frame of the camera, 0 0 0 for nothing.
        ids: Numbers (H, W) of instances, 0 for nothing.
    """

    rgb: Rgb
    depth_m: Depth | None = None
    normals_cam: Normals | None = None
    ids: Ids | None = None

    def with_surface(
        self, layers: Layers, renderer: SceneRenderer, world_from_cam: NDArray[np.float64]
    ) -> Frame:
        """Add the layers that show the surface; it is rendered only if one of them is asked for.

        Args:
            layers: Which of normals and masks to add.
            renderer: Renderer of the scene.
            world_from_cam: Pose (4, 4) of the frame.
        """
        if not layers.of_surface:
            return self
        seen = renderer.surface(world_from_cam)
        return self._replace(
            normals_cam=seen.normals_cam if layers.normals else None,
            ids=seen.ids if layers.masks else None,
        )


class Poses(Protocol):
    """Poses of consecutive frames, as :class:`synfeal.dataset.pose_table.PoseTable` holds them."""

    @property
    def frame(self) -> NDArray[np.int64]:
        """(N,) index within the split."""

    @property
    def path(self) -> NDArray[np.int64]:
        """(N,) index of the straight path."""

    @property
    def position_m(self) -> NDArray[np.float64]:
        """(N, 3) camera centres."""

    @property
    def world_from_cam(self) -> NDArray[np.float64]:
        """(N, 4, 4) poses."""


def path_effects(config: EffectsConfig, poses: Poses, first: int) -> EffectsConfig:
    """Draw which effects act on the path that begins at row ``first``; those that do not are None.

    Each acts with the probability ``config.share``. The draw depends only on the configured seed
    and on the number and place of the path's first frame.
    """
    rng = _generator("path", config, poses, first)
    acts = dict(zip(EFFECTS, rng.random(len(EFFECTS)) < config.share, strict=True))
    return config.model_copy(update={name: None for name in EFFECTS if not acts[name]})


def path_light(config: EffectsConfig, poses: Poses, first: int) -> LightState | None:
    """Draw the light of the path that begins at row ``first``; None where light is not varied."""
    if config.light is None:
        return None
    return drawn_light(config.light, _generator("light", config, poses, first))


def paths_of(poses: Poses) -> list[tuple[int, int]]:
    """List the first row of every path and the row after its last."""
    edges = (np.flatnonzero(np.diff(poses.path)) + 1).tolist()
    return list(zip([0, *edges], [*edges, len(poses.path)], strict=True))


def _generator(what: str, config: EffectsConfig, poses: Poses, row: int) -> np.random.Generator:
    """Seed by the frame's number and place, so that splits and scenes get different numbers."""
    return generator_of(what, config.seed, poses.frame[row], *poses.position_m[row].tolist())


def varied_frames(
    renderer: SceneRenderer,
    camera: CameraConfig,
    config: EffectsConfig,
    poses: Poses,
    begin: int,
    end: int,
    layers: Layers,
) -> Iterator[Frame]:
    """Render the rows ``begin`` to ``end`` (exclusive) of ``poses`` with effects.

    Args:
        renderer: Renderer of the scene through ``camera``.
        camera: Camera of the frames.
        config: Effects to add.
        poses: Poses of whole paths.
        begin: First row to render.
        end: Row after the last to render.
        layers: Layers to render besides colour, as they are at the middle of the exposure.
    """
    for first, last in paths_of(poses):
        if first < end and last > begin:
            own = path_effects(config, poses, first)
            world: AbstractContextManager[SceneRenderer] = nullcontext(renderer)
            if own.clutter is not None:
                rng = _generator("clutter", own, poses, first)
                world = renderer.along(poses.position_m[first:last], rng)
            with world as drawer:
                light = path_light(own, poses, first)
                path = _Path(drawer, camera, own, light, poses, first, last)
                yield from path.frames(max(begin, first), min(end, last), layers)


@dataclass(frozen=True)
class _Path:
    """The rows ``first`` to ``last`` (exclusive) of poses, what draws them, and what acts."""

    renderer: SceneRenderer
    camera: CameraConfig
    config: EffectsConfig
    light: LightState | None
    poses: Poses
    first: int
    last: int

    @cached_property
    def _world_from_cam(self) -> NDArray[np.float64]:
        return self.poses.world_from_cam

    def frames(self, begin: int, end: int, layers: Layers) -> Iterator[Frame]:
        """Yield the frames of some rows; earlier ones are computed only for auto-exposure."""
        exposure = self.config.exposure
        meter = AutoExposure(exposure) if exposure else None
        lags = exposure is not None and exposure.time_constant_s is not None
        for row in range(self.first if lags else begin, end):
            seen, depth_m = self._seen(row, layers.depth)
            if meter is not None:
                seen *= np.float32(2.0 ** meter.next_ev(seen, self._seconds(row)))
            if row >= begin:
                frame = Frame(self._taken(seen, row), depth_m)
                pose = self._world_from_cam[row]
                yield frame.with_surface(layers, self.renderer, pose)

    def _seen(self, row: int, with_depth: bool) -> tuple[Light, Depth | None]:
        """Return the light (H, W, 3) that reaches the sensor, and depth where it is needed."""
        pose, light, depth_m = self._world_from_cam[row], self.light, None
        if with_depth or (light is not None and light.amplitude_ev):
            rgb, depth_m = self.renderer.render_rgbd(pose)
        if self.config.motion_blur is not None and self._seconds(row):
            seen = self._blurred(row, self.config.motion_blur)
        else:
            seen = light_of(rgb if depth_m is not None else self.renderer.render(pose))
        if light is not None:
            seen *= light.gains
            if light.weights is not None:
                seen *= self.renderer.left(pose, light.weights)
            if light.amplitude_ev and depth_m is not None:
                seen *= light.field(self._points_m(pose, depth_m))[..., None]
        return seen, depth_m if with_depth else None

    def _blurred(self, row: int, blur: MotionBlurConfig) -> Light:
        """Average the light of sub-frames at the midpoints of equal parts of the exposure."""
        count = blur.subframes
        share = min(1.0, blur.exposure_s / self._seconds(row))
        before, here = self._world_from_cam[self._neighbour(row)], self._world_from_cam[row]
        at = share * ((np.arange(count) + 0.5) / count - 0.5)
        # From the frame before to this one is 0 to 1; on a path's first frame, 0 to -1.
        moved = interpolate(before, here, 1 + at)
        total: Light = light_of(self.renderer.render(moved[0]))
        for pose in moved[1:]:
            total += light_of(self.renderer.render(pose))
        total *= np.float32(1 / count)
        return total

    def _neighbour(self, row: int) -> int:
        """Return the row of the path that movement is measured from."""
        return row - 1 if row > self.first else min(row + 1, self.last - 1)

    def _seconds(self, row: int) -> float:
        """Return the time between a frame and its neighbour; 0 where the camera does not move."""
        position_m = self.poses.position_m
        step_m = np.linalg.norm(position_m[row] - position_m[self._neighbour(row)])
        return float(step_m) / self.config.speed_m_s

    def _points_m(self, pose: NDArray[np.float64], depth_m: Depth) -> NDArray[np.float32]:
        """Return the points (H, W, 3) that pixels see; beyond the far plane nothing is."""
        ray = self._rays_cam @ pose[:3, :3].T.astype(np.float32)
        near = np.minimum(depth_m, np.float32(self.camera.far_m))[..., None]
        return np.asarray(pose[:3, 3].astype(np.float32) + near * ray)

    @cached_property
    def _rays_cam(self) -> NDArray[np.float32]:
        """Points (H, W, 3) of all pixels at depth 1 m; 0 where a lens shows nothing."""
        directions = cell_directions(self.camera, self.camera.width, self.camera.height)
        return np.nan_to_num(directions).astype(np.float32)

    def _taken(self, light: Light, row: int) -> Rgb:
        """Take a picture of light (H, W, 3) that reaches the sensor."""
        config = self.config
        if config.noise is not None:
            rng = _generator("noise", config, self.poses, row)
            light = with_noise(light, config.noise, rng)
        if config.white_balance_k is not None:
            light /= channel_gains(config.white_balance_k)
        rgb = rgb_of(light)
        return rgb if config.jpeg_quality is None else compressed(rgb, config.jpeg_quality)


def effects_table(config: EffectsConfig, poses: Poses) -> pd.DataFrame:
    """Tabulate the effects and the light of each path, one row per path."""
    import pandas as pd  # takes time to load

    rows = []
    for first, last in paths_of(poses):
        own = path_effects(config, poses, first)
        light = path_light(own, poses, first)
        acts = {name: int(getattr(own, name) is not None) for name in EFFECTS}
        state = {}
        if light is not None:
            state = {"lights": light.state, "ev": light.ev, "temperature_k": light.temperature_k}
        rows.append({"path": poses.path[first], "frames": last - first, **acts, **state})
    return pd.DataFrame(rows)


def objects_table(config: EffectsConfig, poses: Poses, crowd: Crowd) -> pd.DataFrame:
    """Tabulate the objects that stand along each path, one row per object.

    Args:
        config: Effects, which decide along which paths there are objects.
        poses: Poses of whole paths.
        crowd: The scene and the objects.

    Returns:
        Columns ``path``, ``id`` (the object's value in masks along the path), ``name``, those of
        :data:`PLACE`, and ``yaw_deg``; no rows where there are no objects.
    """
    import pandas as pd

    rows = []
    for first, last in paths_of(poses):
        if path_effects(config, poses, first).clutter is None:
            continue
        rng = _generator("clutter", config, poses, first)
        standing = crowd.along(poses.position_m[first:last], rng)
        for number, (_, place) in enumerate(standing, crowd.first_id):
            corners = dict(zip(PLACE, [*place["position_m"], *place["size_m"]], strict=True))
            about = {"id": number, "name": place["name"], **corners, "yaw_deg": place["yaw_deg"]}
            rows.append({"path": poses.path[first], **about})
    return pd.DataFrame(rows, columns=["path", "id", "name", *PLACE, "yaw_deg"])
