"""Choice of a level of detail: the mesh simplified to what images of one resolution show.

An image of 88x66 pixels shows neither a 16-megapixel texture nor 200,000 triangles, yet pays for
both. Textures are made smaller and triangles fewer, step by step, and the images of each step are
compared with the mean of 64 samples per pixel of the full mesh. The full mesh has an error of its
own, as few samples alias. Smaller textures even lessen it: they are averaged over boxes, and mip
levels of the large ones are not quite. A mesh that has its colours at its vertices loses them with
its triangles; it gets a texture of them instead (:mod:`synfeal.mesh.atlas`).

Among the steps within the error that is granted, the one of least time times error is taken: the
knee of the curve, where a step begins to cost more error than it saves time. Time is that of a
model, fitted to ``results/benchmarks/detail.csv``, so that the choice is the same on every machine
that draws the same images.

Only colour is drawn so. Depth, collisions and everything that is measured keep the full mesh.
"""

from __future__ import annotations

import importlib.util
import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from synfeal.camera.projection import pixels_per_radian
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset.pose_table import read_pose_table
from synfeal.dataset.render_sequence import resolved
from synfeal.mesh.atlas import texel_size_m, with_baked_colors
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.save import save_glb
from synfeal.mesh.triangles import with_fewer_faces, with_smaller_textures
from synfeal.records.files import write_json
from synfeal.render import open_renderer
from synfeal.render.base import reference_images

VIEWS = 8  # that are compared, spread evenly over the poses
# Cameras with more pixels are judged by the middle of their images: references have 64 times as
# many pixels.
LARGEST_VIEW_PX = (320, 240)
TEXTURE_FACTORS = (2, 4, 8)  # that the sides of textures are divided by, each twice the last
FACE_FACTORS = (2, 4, 8, 16, 32, 64)  # that the number of triangles is divided by
BAKED_FACTORS = (8, 16, 32, 64)  # the same of meshes whose vertex colours become a texture
BAKED_TEXEL = 0.75  # side of its texels, in median edges of the full mesh
# An error that is always granted, of 255 levels. Renderings of a scan are ten times as far from the
# photographs it was made of.
GRANTED_LEVELS = 1.5
# Processor time of a frame, microseconds, with Mesa's llvmpipe.
FRAME_US, FACE_US, SAMPLE_US = 1000.0, 0.045, 0.04

log = logging.getLogger("synfeal")
Poses = NDArray[np.float64]


@dataclass(frozen=True)
class Level:
    """A mesh, and how far its images are from the truth."""

    mesh: TexturedMesh
    texture_factor: int  # that the sides of its textures were divided by
    error_levels: float  # mean absolute difference from 64 samples per pixel, 0 to 255
    is_baked: bool = False  # whether its vertex colours became a texture


@dataclass(frozen=True)
class Detail:
    """The level that was chosen for a camera, beside the full mesh."""

    chosen: Level
    full: Level
    tried: tuple[Level, ...]  # all levels, in the order they were measured, the full one first

    @property
    def is_full(self) -> bool:
        """True where nothing is left out."""
        return self.chosen is self.full

    def record(self, render: RenderConfig) -> dict[str, Any]:
        """Return the level of detail as a manifest states it, ready for JSON."""
        return {
            "faces": self.chosen.mesh.n_faces,
            "full_faces": self.full.mesh.n_faces,
            "texture_scale": 1.0 / self.chosen.texture_factor,
            "baked_vertex_colors": self.chosen.is_baked,
            "error_levels": round(self.chosen.error_levels, 3),
            "full_error_levels": round(self.full.error_levels, 3),
            "supersampling": render.supersampling,
        }


def write_detail(
    mesh: Path,
    plans: Sequence[Path],
    camera: CameraConfig,
    render: RenderConfig,
    out_mesh: Path,
    out_record: Path,
) -> None:
    """Choose the level of detail for a camera, and write its mesh and how it was chosen.

    Args:
        mesh: ``mesh.glb`` of a scene, world frame.
        plans: Pose tables of the frames that will be drawn.
        camera: What they will be drawn through.
        render: How they will be drawn.
        out_mesh: The mesh to draw colours of.
        out_record: What :meth:`Detail.record` gives, as JSON.
    """
    poses = np.concatenate([read_pose_table(plan).world_from_cam for plan in plans])
    detail = choose_detail(load_mesh(mesh), camera, poses, render)
    save_glb(out_mesh, detail.chosen.mesh)
    write_json(out_record, detail.record(render))


def choose_detail(
    mesh: TexturedMesh, camera: CameraConfig, poses: Poses, render: RenderConfig
) -> Detail:
    """Choose the mesh to draw frames of: least time times error among those exact enough.

    Textures come first, as triangles do not change which size of them is best.

    Args:
        mesh: The full mesh, world frame.
        camera: The camera of the frames. Its distortion moves pixels and does not change how large
            they are, so it is left out of the comparison, as is that of a fisheye or a panorama.
        poses: ``world_from_cam`` (N, 4, 4) of the frames; :data:`VIEWS` of them are compared.
        render: Backend and samples of the frames.
    """
    log.info(
        "choosing a level of detail for %dx%d: smaller textures and fewer of %d faces, compared"
        " with the full mesh in %d views",
        camera.width,
        camera.height,
        mesh.n_faces,
        min(VIEWS, len(poses)),
    )
    judge = _Judge.of(mesh, camera, poses, resolved(render))
    tried = [judge.level(mesh, 1)]
    full = tried[0]
    granted = max(full.error_levels, GRANTED_LEVELS)
    textured = full
    for level in _smaller_textures(mesh, judge):
        tried.append(level)
        if level.error_levels > textured.error_levels:
            break
        textured = level
    if _simplifies():
        for ladder in (_fewer_faces, _baked):
            for level in ladder(mesh, textured, judge):
                tried.append(level)
                if level.error_levels > granted:
                    break
    n_samples = camera.width * camera.height * render.supersampling**2

    def weighed(level: Level) -> float:
        drawing_us = FRAME_US + FACE_US * level.mesh.n_faces + SAMPLE_US * n_samples
        return drawing_us * level.error_levels

    chosen = min((level for level in tried if level.error_levels <= granted), key=weighed)
    log.info(
        "level of detail at %dx%d: %d of %d faces, textures 1/%d, error %.2f levels (full: %.2f)",
        camera.width,
        camera.height,
        chosen.mesh.n_faces,
        mesh.n_faces,
        chosen.texture_factor,
        chosen.error_levels,
        full.error_levels,
    )
    return Detail(chosen=chosen, full=full, tried=tuple(tried))


def _fewer_faces(mesh: TexturedMesh, textured: Level, judge: _Judge) -> Iterator[Level]:
    """Yield the mesh with the textures chosen and fewer and fewer triangles."""
    least = mesh.n_faces
    for factor in FACE_FACTORS:
        reduced = with_fewer_faces(textured.mesh, mesh.n_faces // factor)
        if reduced.n_faces >= least:
            return  # corners of charts never move: nothing is left to take away
        least = reduced.n_faces
        yield judge.level(reduced, textured.texture_factor)


def _baked(mesh: TexturedMesh, textured: Level, judge: _Judge) -> Iterator[Level]:
    """Yield the same with vertex colours baked into textures; nothing without vertex colours."""
    if not any(_has_colors_alone(part) for part in mesh.parts):
        return
    for factor in BAKED_FACTORS:
        reduced = with_fewer_faces(textured.mesh, mesh.n_faces // factor)
        if len(reduced.parts) < len(mesh.parts):
            return  # some part is gone, and which is which is not known
        parts = (
            with_baked_colors(less, part, BAKED_TEXEL * texel_size_m(part))
            if _has_colors_alone(part)
            else less
            for less, part in zip(reduced.parts, mesh.parts, strict=True)
        )
        baked = replace(reduced, parts=tuple(parts))
        yield replace(judge.level(baked, textured.texture_factor), is_baked=True)


def _has_colors_alone(part: MeshPart) -> bool:
    return part.vertex_rgb is not None and part.texture is None


def _smaller_textures(mesh: TexturedMesh, judge: _Judge) -> Iterator[Level]:
    """Yield the mesh with textures of a half, a quarter and so on; nothing without textures."""
    if any(part.texture is not None for part in mesh.parts):
        for factor in TEXTURE_FACTORS:
            mesh = with_smaller_textures(mesh, 2)
            yield judge.level(mesh, factor)


def _simplifies() -> bool:
    """Tell whether the package that simplifies meshes is installed; log where it is not."""
    if importlib.util.find_spec("meshoptimizer") is not None:
        return True
    log.warning(
        "meshoptimizer is not installed: all triangles are drawn, where fewer would do;"
        " pip install meshoptimizer, which needs a C++ compiler"
    )
    return False


@dataclass(frozen=True)
class _Judge:
    """Compares drawings of views with reference images of them."""

    camera: CameraConfig  # a pinhole
    poses: Poses
    render: RenderConfig
    truth: NDArray[np.float32]  # (P, H, W, 3), 0 to 255

    @classmethod
    def of(
        cls, mesh: TexturedMesh, camera: CameraConfig, poses: Poses, render: RenderConfig
    ) -> _Judge:
        """Draw the truth: the full mesh with 64 samples per pixel."""
        window = middle_of(camera)
        seen = poses[np.linspace(0, len(poses) - 1, min(VIEWS, len(poses))).astype(int)]
        plain = render.model_copy(update={"supersampling": 1, "effects": None})
        views = reference_images(lambda finer: open_renderer(mesh, finer, plain), window, seen)
        ideal = render.model_copy(update={"effects": None})
        return cls(camera=window, poses=seen, render=ideal, truth=np.stack(list(views)))

    def level(self, mesh: TexturedMesh, texture_factor: int) -> Level:
        """Measure a mesh."""
        with open_renderer(mesh, self.camera, self.render) as renderer:
            errors = [
                np.abs(renderer.render(pose) - expected).mean(dtype=np.float64)
                for pose, expected in zip(self.poses, self.truth, strict=True)
            ]
        return Level(mesh, texture_factor, float(np.mean(errors)))


def middle_of(camera: CameraConfig) -> CameraConfig:
    """Crop a camera to the centre of its image, at most :data:`LARGEST_VIEW_PX`, as a pinhole."""
    if camera.projection is None:
        fx, fy, cx, cy = camera.intrinsics
    else:
        fx, fy = pixels_per_radian(camera)
        cx, cy = camera.width / 2.0, camera.height / 2.0
    width, height = (
        min(side, most)
        for side, most in zip((camera.width, camera.height), LARGEST_VIEW_PX, strict=True)
    )
    left, top = (camera.width - width) // 2, (camera.height - height) // 2
    window = {"width": width, "height": height, "cx": cx - left, "cy": cy - top}
    plain = {"distortion": (0.0, 0.0, 0.0, 0.0, 0.0), "projection": None, "fisheye_k": None}
    return camera.model_copy(update={**window, "fx": fx, "fy": fy, **plain})
