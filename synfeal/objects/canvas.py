"""Canvas of a texture painter: a size in pixels, a scale and a random generator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import Concatenate, ParamSpec

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw

Color = tuple[float, float, float]
Pixels = NDArray[np.float32]  # (H, W, 3) display-referred albedo in [0, 1], row 0 on top
VIVID: tuple[Color, ...] = (
    (0.85, 0.15, 0.12), (0.95, 0.55, 0.08), (0.95, 0.85, 0.15), (0.15, 0.55, 0.25),
    (0.1, 0.35, 0.75), (0.45, 0.15, 0.6), (0.9, 0.35, 0.55), (0.1, 0.65, 0.7), (0.1, 0.1, 0.12),
)  # fmt: skip
INK: tuple[Color, ...] = ((0.1, 0.1, 0.12), (0.1, 0.2, 0.75), (0.8, 0.1, 0.1), (0.05, 0.5, 0.2))


@dataclass(frozen=True)
class Canvas:
    """The rectangle a painter fills."""

    rng: np.random.Generator
    height_px: int
    width_px: int
    px_per_m: float

    @property
    def size_m(self) -> tuple[float, float]:
        """Width and height in metres."""
        return self.width_px / self.px_per_m, self.height_px / self.px_per_m

    def plain(self, color: Color) -> Pixels:
        """Return one colour everywhere."""
        return np.full((self.height_px, self.width_px, 3), color, np.float32)

    def coordinates_m(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return metres from the top-left corner: x as (1, W), y as (H, 1)."""
        x = (np.arange(self.width_px, dtype=np.float32) + 0.5) / self.px_per_m
        y = (np.arange(self.height_px, dtype=np.float32) + 0.5) / self.px_per_m
        return x[None, :], y[:, None]

    def noise(
        self, cell_m: float | tuple[float, float], octaves: int = 4, persistence: float = 0.6
    ) -> NDArray[np.float32]:
        """Draw fractal value noise (H, W), zero mean and roughly unit deviation.

        Args:
            cell_m: Size of the coarsest cells, metres; along x and y if a pair.
            octaves: Number of layers that are added; the cells of each are half as large as in the
                one before.
            persistence: Deviation of each layer relative to the one before.
        """
        cells_m = cell_m if isinstance(cell_m, tuple) else (cell_m, cell_m)
        total = np.zeros((self.height_px, self.width_px), np.float32)
        for octave in range(octaves):
            step_x, step_y = (max(1.0, cell * self.px_per_m / 2**octave) for cell in cells_m)
            total += persistence**octave * self._lattice_noise(step_x, step_y)
        power = sum((persistence**octave) ** 2 for octave in range(octaves))
        return total / np.float32(np.sqrt(power))

    def _lattice_noise(self, step_x: float, step_y: float) -> NDArray[np.float32]:
        columns = int(np.ceil(self.width_px / step_x)) + 2
        rows = int(np.ceil(self.height_px / step_y)) + 2
        lattice = self.rng.standard_normal((rows, columns), dtype=np.float32)
        box = (0.5, 0.5, 0.5 + self.width_px / step_x, 0.5 + self.height_px / step_y)
        size = (self.width_px, self.height_px)
        smooth = Image.fromarray(lattice).resize(size, Image.Resampling.BILINEAR, box=box)
        # Interpolation lowers the deviation.
        return np.asarray(smooth, np.float32) * np.float32(1.4)


Painter = Callable[[Canvas], Pixels]
Settings = ParamSpec("Settings")


def painter(paint: Callable[Concatenate[Canvas, Settings], Pixels]) -> Callable[Settings, Painter]:
    """Turn a function that paints a canvas with settings into one that returns a painter."""

    @wraps(paint)
    def chosen(*values: Settings.args, **named: Settings.kwargs) -> Painter:
        return lambda canvas: paint(canvas, *values, **named)

    return chosen


class Sketch:
    """Vector drawing on a canvas in relative coordinates: x, y in [0, 1], y down."""

    def __init__(self, background: Pixels) -> None:
        self.height_px, self.width_px = background.shape[:2]
        self._image = Image.fromarray(np.round(np.clip(background, 0, 1) * 255).astype(np.uint8))
        self._draw = ImageDraw.Draw(self._image)

    def _at(self, points: ArrayLike) -> list[tuple[float, float]]:
        scaled = np.asarray(points, float) * (self.width_px, self.height_px)
        return [(x, y) for x, y in scaled.tolist()]

    def polygon(self, points: ArrayLike, color: Color) -> None:
        """Fill a polygon (N, 2)."""
        self._draw.polygon(self._at(points), fill=_bytes(color))

    def line(self, points: ArrayLike, color: Color, width: float = 0.01) -> None:
        """Draw a polyline (N, 2); ``width`` is relative to the canvas' height."""
        width_px = max(1, round(width * self.height_px))
        self._draw.line(self._at(points), fill=_bytes(color), width=width_px, joint="curve")

    def rectangle(self, x0: float, y0: float, x1: float, y1: float, color: Color) -> None:
        """Fill an axis-aligned rectangle."""
        self.polygon([(x0, y0), (x1, y0), (x1, y1), (x0, y1)], color)

    def ellipse(self, x: float, y: float, radius_x: float, radius_y: float, color: Color) -> None:
        """Fill an ellipse, radii relative to width and height."""
        angle = np.linspace(0, 2 * np.pi, 32, endpoint=False)
        ring = np.stack([x + radius_x * np.cos(angle), y + radius_y * np.sin(angle)], axis=1)
        self.polygon(ring, color)

    def text_lines(
        self,
        rng: np.random.Generator,
        box: tuple[float, float, float, float],
        rows: int,
        color: Color,
    ) -> None:
        """Draw rows of letter-like strokes.

        Args:
            rng: Source of the strokes.
            box: Where they stand: x0, y0, x1, y1, 0 to 1 across the canvas.
            rows: Number of rows.
            color: Colour of the strokes.
        """
        x0, y0, x1, y1 = box
        pitch = (y1 - y0) / rows
        for row in range(rows):
            y, x = y0 + row * pitch, x0
            end = x1 - rng.uniform(0, 0.35) * (x1 - x0)
            letter = 0.5 * pitch * self.height_px / self.width_px
            while x < end:
                if rng.random() < 0.82:
                    strokes = rng.uniform((x, y), (x + letter, y + 0.62 * pitch), (3, 2))
                    self.line(strokes, color, width=0.12 * pitch)
                x += 1.3 * letter

    def pixels(self) -> Pixels:
        """Return the drawing as float pixels."""
        return np.asarray(self._image, np.float32) / np.float32(255)


def _bytes(color: Color) -> tuple[int, ...]:
    return tuple(np.round(255 * np.clip(color, 0, 1)).astype(int).tolist())


def pick(rng: np.random.Generator, palette: tuple[Color, ...]) -> Color:
    """Draw one colour of a palette."""
    return palette[int(rng.integers(len(palette)))]


def shade(color: Color, factor: float) -> Color:
    """Make a colour lighter or darker."""
    red, green, blue = (min(1.0, channel * factor) for channel in color)
    return red, green, blue


def mix(first: ArrayLike, second: ArrayLike, share: NDArray[np.float32]) -> Pixels:
    """Blend images or colours: ``first·(1 − share) + second·share`` with ``share`` (H, W)."""
    first, second = np.asarray(first, np.float32), np.asarray(second, np.float32)
    return np.asarray(first + (second - first) * share[..., None], np.float32)


def tinted(image: ArrayLike, relief: NDArray[np.float32]) -> Pixels:
    """Lighten an image or a colour where the relief (H, W) is above 0 and darken it below."""
    return np.asarray(np.asarray(image, np.float32) * (1 + relief[..., None]), np.float32)


def ramp(canvas: Canvas, first: Color, second: Color, angle_rad: float) -> Pixels:
    """Blend from one colour to another across a canvas.

    Args:
        canvas: What is painted on.
        first: Colour where the blend begins.
        second: Colour where it ends.
        angle_rad: Direction of the blend, radians: 0 is right, π/2 is down.
    """
    x, y = canvas.coordinates_m()
    width, height = canvas.size_m
    along = np.cos(angle_rad) * (x / width - 0.5) + np.sin(angle_rad) * (y / height - 0.5) + 0.5
    share = np.clip(along, 0, 1).astype(np.float32)
    return mix(first, second, share)


def bordered(image: Pixels, share: float, color: Color) -> Pixels:
    """Paint a frame as wide as ``share`` of the shorter side over the image's border, in place."""
    margin = max(1, round(share * min(image.shape[:2])))
    for edge in (image[:margin], image[-margin:], image[:, :margin], image[:, -margin:]):
        edge[:] = color
    return image
