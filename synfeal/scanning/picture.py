"""Renderings of a scan beside photographs from the same poses: seen, and in numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset.images import read_rgb
from synfeal.dataset.posed_sequence import PosedFrames
from synfeal.mesh.model import TexturedMesh
from synfeal.records.files import atomic_path
from synfeal.render.choose import open_renderer
from synfeal.scanning.consistency import LUMA, shrunk

Rgb = NDArray[np.uint8]
SHRINK = 2
ROWS = 4  # frames in the picture
TITLES = ("photograph", "rendering of the scan", "overlaid, red and cyan", "difference x 2")
# Height of text as a share of a tile's width: pictures of phones are shown much smaller.
TEXT_SHARE, LEAST_TEXT_PX = 0.045, 10


@dataclass(frozen=True)
class Comparison:
    """One photograph and the scan from its pose.

    Attributes:
        name: Name of the frame.
        photograph: (H, W, 3), shrunk.
        rendering: (H, W, 3).
        covered: (H, W) where the scan has a surface.
    """

    name: str
    photograph: Rgb
    rendering: Rgb
    covered: NDArray[np.bool_]

    @property
    def difference(self) -> float:
        """Mean absolute difference of colours where the scan has a surface, grey levels."""
        if not self.covered.any():
            return float("nan")
        apart = np.abs(self.photograph.astype(np.int16) - self.rendering.astype(np.int16))
        return float(apart[self.covered].mean())


def compare(
    mesh: TexturedMesh,
    frames: PosedFrames,
    world_from_cam: NDArray[np.float64],
    camera: CameraConfig,
    on_frame: Callable[[], object] = lambda: None,
) -> list[Comparison]:
    """Render a scan from the poses of photographs.

    Args:
        mesh: In a world.
        frames: Photographs.
        world_from_cam: Their poses (N, 4, 4) in that world.
        camera: Camera of the photographs.
        on_frame: Called after every frame.
    """
    small = shrunk(camera, SHRINK)
    found = []
    with open_renderer(mesh, small, RenderConfig()) as renderer:
        for name, file, pose in zip(frames.names, frames.color, world_from_cam, strict=True):
            rgb, depth_m = renderer.render_rgbd(pose)
            size = (camera.width, camera.height)
            photograph = read_rgb(file, size=size, shrink=SHRINK)
            photograph = photograph[: small.height, : small.width]
            found.append(Comparison(name, photograph, rgb, np.isfinite(depth_m)))
            on_frame()
    return found


def write_picture(compared: Sequence[Comparison], title: str, out: Path) -> None:
    """Write a picture: a row for each of some frames, evenly chosen from ``compared``."""
    count = min(ROWS, len(compared))
    chosen = [compared[(2 * row + 1) * len(compared) // (2 * count)] for row in range(count)]
    height, width = chosen[0].photograph.shape[:2]
    text_px = max(LEAST_TEXT_PX, round(TEXT_SHARE * width))
    line_px = round(1.6 * text_px)
    sheet = Image.new("RGB", (len(TITLES) * width, count * height + 2 * line_px), "white")
    pen = ImageDraw.Draw(sheet)
    pen.text((4, 3), title, "black", font_size=text_px)
    for column, text in enumerate(TITLES):
        pen.text((column * width + 4, line_px + 3), text, "black", font_size=text_px)
    for row, one in enumerate(chosen):
        top = 2 * line_px + row * height
        tiles = (one.photograph, one.rendering, overlay(one), _difference(one))
        for column, tile in enumerate(tiles):
            sheet.paste(Image.fromarray(tile), (column * width, top))
        said = f"{one.name}: {one.difference:.1f} grey levels"
        pen.text(
            (4, top + 3), said, "white", font_size=text_px, stroke_width=1, stroke_fill="black"
        )
    with atomic_path(out) as temporary:
        sheet.save(temporary)


def overlay(one: Comparison) -> Rgb:
    """Overlay the photograph in red and the rendering in cyan: grey where both agree."""
    photograph, rendering = one.photograph @ LUMA, one.rendering @ LUMA
    return np.stack([photograph, rendering, rendering], axis=-1).clip(0, 255).astype(np.uint8)


def _difference(one: Comparison) -> Rgb:
    apart = np.abs(one.photograph.astype(np.int16) - one.rendering.astype(np.int16))
    apart[~one.covered] = 0
    return (2 * apart).clip(0, 255).astype(np.uint8)
