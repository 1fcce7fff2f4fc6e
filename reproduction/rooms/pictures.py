"""Painters of what hangs on walls: posters, whiteboards, windows, stained glass, frescoes.

Each function is called with its settings alone and returns a painter, which is given the canvas.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from synfeal.objects.canvas import (
    INK,
    VIVID,
    Canvas,
    Color,
    Pixels,
    Sketch,
    bordered,
    mix,
    painter,
    pick,
    ramp,
    shade,
    tinted,
)
from synfeal.objects.materials import plaster

FACADES: tuple[Color, ...] = ((0.7, 0.5, 0.4), (0.75, 0.72, 0.65), (0.5, 0.55, 0.6))


@painter
def poster(canvas: Canvas, ground: Color | None = None) -> Pixels:
    """Paint a poster nobody else has: ramp, coloured shapes, rows of type, a white border."""
    rng = canvas.rng
    base = ground or pick(rng, VIVID)
    sketch = Sketch(ramp(canvas, base, shade(pick(rng, VIVID), 1.3), rng.uniform(0, 2 * np.pi)))
    for _ in range(int(rng.integers(10, 18))):
        x, y = rng.uniform(0.1, 0.9), rng.uniform(0.1, 0.7)
        color = shade(pick(rng, VIVID), rng.uniform(0.7, 1.5))
        if rng.random() < 0.4:
            radius = rng.uniform(0.03, 0.15)
            sketch.ellipse(x, y, radius, radius * canvas.width_px / canvas.height_px, color)
        else:
            radius, n = rng.uniform(0.08, 0.25), int(rng.integers(3, 9))
            angle = np.sort(rng.uniform(0, 2 * np.pi, n))
            reach = radius * rng.uniform(0.5, 1.0, n)
            blob = x + reach * np.cos(angle), y + reach * np.sin(angle)
            sketch.polygon(np.stack(blob, axis=1), color)
    sketch.rectangle(0.08, 0.74, 0.92, 0.95, (0.95, 0.95, 0.92))
    sketch.text_lines(rng, (0.1, 0.76, 0.9, 0.82), 1, pick(rng, INK))
    sketch.text_lines(rng, (0.1, 0.84, 0.9, 0.94), 4, (0.2, 0.2, 0.2))
    return bordered(sketch.pixels(), 0.02, (0.93, 0.93, 0.9))


@painter
def painting(
    canvas: Canvas, palette: tuple[Color, ...] = VIVID, frame: Color = (0.45, 0.3, 0.1)
) -> Pixels:
    """Paint an abstract landscape in a frame: noise layers as sky and hills, dabs of paint.

    Args:
        canvas: Canvas to paint.
        palette: Colours to pick from at random.
        frame: Colour of the frame.
    """
    rng = canvas.rng
    image = ramp(canvas, shade(pick(rng, palette), 1.4), (0.95, 0.9, 0.8), np.pi / 2)
    y = (np.arange(canvas.height_px, dtype=np.float32) / canvas.height_px)[:, None]
    for level in np.linspace(0.35, 0.85, 4):
        ridge = level + 0.07 * canvas.noise((canvas.size_m[0] / 3, 1e3), 4)
        strokes = 0.15 * canvas.noise(0.05, 4, 0.8)
        hill = tinted(pick(rng, palette), strokes)
        image = np.where((y > ridge)[..., None], hill, image).astype(np.float32)
    sketch = Sketch(image)
    for _ in range(60):
        (x, at), (wide, high) = rng.uniform(0.05, 0.95, 2), rng.uniform(0.004, 0.03, 2)
        sketch.ellipse(x, at, wide, high, shade(pick(rng, palette), rng.uniform(0.5, 1.5)))
    return bordered(bordered(sketch.pixels(), 0.07, frame), 0.025, shade(frame, 1.7))


@painter
def whiteboard(canvas: Canvas) -> Pixels:
    """Paint a whiteboard with formulas, diagrams and half-wiped smudges in an aluminium frame."""
    rng = canvas.rng
    sketch = Sketch(plaster((0.93, 0.94, 0.95), 0.03)(canvas))
    for _ in range(13):
        x, y = rng.uniform((0.04, 0.06), (0.7, 0.75))
        ink = pick(rng, INK)
        if rng.random() < 0.55:
            box = (x, y, x + rng.uniform(0.15, 0.28), y + rng.uniform(0.1, 0.2))
            sketch.text_lines(rng, box, int(rng.integers(2, 4)), ink)
        else:
            nodes = rng.uniform((x, y), (x + 0.25, y + 0.22), (6, 2))
            sketch.line(nodes, ink, 0.008)
            high = 0.012 * canvas.width_px / canvas.height_px
            for node_x, node_y in nodes:
                sketch.ellipse(node_x, node_y, 0.012, high, ink)
    return bordered(sketch.pixels(), 0.02, (0.6, 0.62, 0.65))


@painter
def noticeboard(canvas: Canvas, ground: Color = (0.62, 0.45, 0.27)) -> Pixels:
    """Paint cork with overlapping sheets of paper."""
    rng = canvas.rng
    sketch = Sketch(plaster(ground, 0.1, 0.12)(canvas))
    for _ in range(22):
        x, y = rng.uniform((0.03, 0.03), (0.85, 0.75))
        width, height = rng.uniform((0.07, 0.12), (0.14, 0.26))
        paper = shade(pick(rng, VIVID), 1.3) if rng.random() < 0.35 else (0.93, 0.92, 0.88)
        sketch.rectangle(x, y, x + width, y + height, paper)
        box = (x + 0.01, y + 0.02, x + width - 0.01, y + height - 0.02)
        sketch.text_lines(rng, box, 6, pick(rng, INK))
    return bordered(sketch.pixels(), 0.025, (0.35, 0.22, 0.12))


@painter
def window_view(canvas: Canvas, panes: tuple[int, int] = (2, 2), blind: float = 0.0) -> Pixels:
    """Paint sky, houses and trees behind glazing bars.

    Args:
        canvas: Canvas to paint.
        panes: Number of panes across and down.
        blind: Share of the height that slats cover, from above.
    """
    rng = canvas.rng
    sky = ramp(canvas, (0.62, 0.8, 1.0), (0.97, 0.98, 1.0), np.pi / 2)
    clouds = np.clip(canvas.noise((0.7, 0.3), 4), 0, 1)
    sketch = Sketch(mix(sky, 1, clouds))
    _skyline(sketch, rng)
    for y in np.arange(0, blind, 0.03):
        sketch.rectangle(0, y, 1, y + 0.024, (0.85, 0.82, 0.74))
    bar: Color = (0.9, 0.9, 0.9)
    for x in np.linspace(0, 1, panes[0] + 1):
        sketch.rectangle(x - 0.02, 0, x + 0.02, 1, bar)
    for y in np.linspace(0, 1, panes[1] + 1):
        sketch.rectangle(0, y - 0.02, 1, y + 0.02, bar)
    return sketch.pixels()


def _skyline(sketch: Sketch, rng: np.random.Generator) -> None:
    for _ in range(5):
        x, top = rng.uniform((0, 0.4), (0.9, 0.75))
        wide = rng.uniform(0.12, 0.3)
        color = shade(pick(rng, FACADES), rng.uniform(0.7, 1.2))
        sketch.rectangle(x, top, x + wide, 1, color)
        for cx in np.arange(x + 0.02, x + wide - 0.02, 0.05):
            for cy in np.arange(top + 0.03, 0.95, 0.07):
                sketch.rectangle(cx, cy, cx + 0.02, cy + 0.035, shade(color, 0.45))
    for _ in range(26):
        x, y = rng.uniform((0, 0.78), (1, 1))
        sketch.ellipse(x, y, 0.07, 0.07, shade((0.25, 0.45, 0.18), rng.uniform(0.5, 1.3)))


@painter
def stained_glass(canvas: Canvas, palette: tuple[Color, ...] = VIVID, cells: int = 160) -> Pixels:
    """Paint glass cells in lead: a Voronoi diagram of random points.

    Args:
        canvas: Canvas to paint.
        palette: Colours to pick from at random.
        cells: Number of cells.
    """
    rng = canvas.rng
    seeds = rng.uniform(0, 1, (cells, 2)) * canvas.size_m
    x, y = canvas.coordinates_m()
    grid = np.stack(np.broadcast_arrays(x, y), axis=-1)
    distance, nearest = cKDTree(seeds).query(grid, k=2)
    brightness = rng.uniform(0.8, 1.5, (cells, 1))
    colors = np.asarray(palette)[rng.integers(len(palette), size=cells)] * brightness
    image: Pixels = np.clip(colors, 0, 1)[nearest[..., 0]].astype(np.float32)
    image[distance[..., 1] - distance[..., 0] < 0.012] = 0.05
    return image


ROBES: tuple[Color, ...] = (
    (0.7, 0.15, 0.12), (0.15, 0.25, 0.6), (0.2, 0.45, 0.25), (0.75, 0.5, 0.15),
    (0.5, 0.2, 0.4), (0.85, 0.8, 0.7), (0.35, 0.2, 0.12),
)  # fmt: skip
GOLD: Color = (0.9, 0.72, 0.3)
SKIN: Color = (0.85, 0.65, 0.5)


@painter
def mural(canvas: Canvas, ground: Color, sky: Color, figures: int = 5) -> Pixels:
    """Paint saints before a landscape, framed by a painted border.

    Args:
        canvas: Canvas to paint.
        ground: Colour of the landscape; the border is a darker shade of it.
        sky: Colour of the sky.
        figures: Number of saints.
    """
    rng = canvas.rng
    y = (np.arange(canvas.height_px, dtype=np.float32) / canvas.height_px)[:, None]
    horizon = 0.55 + 0.06 * canvas.noise((canvas.size_m[0] / 3, 1e3), 3)
    share = np.clip((y - horizon) * 12 + 0.5, 0, 1).astype(np.float32)
    clouds = 0.12 * canvas.noise((0.6, 0.25), 4)
    sketch = Sketch(mix(tinted(sky, clouds), tinted(ground, clouds), share))
    for x in np.linspace(0.16, 0.84, figures) + rng.uniform(-0.04, 0.04, figures):
        _saint(sketch, rng, x, rng.uniform(0.3, 0.45), canvas)
    _border(sketch, rng, shade(ground, 0.55), canvas)
    aged = 0.1 * canvas.noise(0.25, 5, 0.75)
    return tinted(sketch.pixels(), aged)


def _saint(sketch: Sketch, rng: np.random.Generator, x: float, top: float, canvas: Canvas) -> None:
    aspect = canvas.height_px / canvas.width_px
    robe, head = pick(rng, ROBES), 0.055 * (1.0 - top)
    wide, foot = 2.2 * head * aspect, rng.uniform(0.86, 0.92)
    sketch.ellipse(x, top, 1.9 * head * aspect, 1.9 * head, GOLD)
    shoulder = top + 2 * head
    hem = [(x + 1.5 * wide, foot), (x - 1.5 * wide, foot)]
    sketch.polygon([(x - wide, shoulder), (x + wide, shoulder), *hem], robe)
    for _ in range(6):
        fold = rng.uniform(-1.2, 1.2) * wide
        line = [(x + 0.6 * fold, top + 2.5 * head), (x + fold, foot)]
        sketch.line(line, shade(robe, rng.uniform(0.5, 1.5)), 0.008)
    mantle = shade(pick(rng, ROBES), 1.2)
    side = rng.choice((-1, 1)) * wide
    edge = [(x + side, shoulder), (x - 0.3 * side, top + 3 * head), (x + 1.4 * side, 0.75)]
    sketch.polygon(edge, mantle)
    hair = shade((0.3, 0.2, 0.1), rng.uniform(0.5, 2.5))
    sketch.ellipse(x, top - 0.15 * head, 1.1 * head * aspect, 1.2 * head, hair)
    sketch.ellipse(x, top + 0.25 * head, 0.8 * head * aspect, 0.95 * head, SKIN)
    staff = x + 1.6 * side
    sketch.line([(staff, top), (staff, foot)], GOLD, 0.008)


def _border(sketch: Sketch, rng: np.random.Generator, color: Color, canvas: Canvas) -> None:
    edge_x, edge_y = (0.1 / side for side in canvas.size_m)
    for x0, y0, x1, y1 in (
        (0, 0, 1, edge_y),
        (0, 1 - edge_y, 1, 1),
        (0, 0, edge_x, 1),
        (1 - edge_x, 0, 1, 1),
    ):
        sketch.rectangle(x0, y0, x1, y1, color)
    for x in np.arange(edge_x, 1 - edge_x, 1.5 * edge_x):
        for y in (edge_y / 2, 1 - edge_y / 2):
            sketch.ellipse(x, y, 0.4 * edge_x, 0.4 * edge_y, shade(pick(rng, ROBES), 1.3))
    for y in np.arange(edge_y, 1 - edge_y, 1.5 * edge_y):
        for x in (edge_x / 2, 1 - edge_x / 2):
            sketch.ellipse(x, y, 0.4 * edge_x, 0.4 * edge_y, GOLD)


@painter
def starry_vault(canvas: Canvas, first: Color, second: Color) -> Pixels:
    """Paint a vault from ``first`` to ``second`` along x, with golden stars and medallions."""
    rng = canvas.rng
    x, _ = canvas.coordinates_m()
    blend = mix(first, second, (x / canvas.size_m[0]).astype(np.float32))
    sketch = Sketch(tinted(blend, 0.12 * canvas.noise(0.7, 5, 0.7)))
    aspect = canvas.width_px / canvas.height_px
    angle = np.arange(10) * np.pi / 5
    for _ in range(260):
        at_x, at_y = rng.uniform(0.01, 0.99, 2)
        reach = rng.uniform(0.006, 0.014) * np.where(np.arange(10) % 2, 0.4, 1.0)
        star = at_x + reach * np.cos(angle) / aspect, at_y + reach * np.sin(angle)
        sketch.polygon(np.stack(star, axis=1), GOLD)
    for at_x in np.linspace(0.12, 0.88, 5):
        for at_y in (0.22, 0.5, 0.78):
            _medallion(sketch, rng, at_x + rng.uniform(-0.02, 0.02), at_y, aspect)
    return tinted(sketch.pixels(), 0.06 * canvas.noise(0.12, 4, 0.8))


def _medallion(sketch: Sketch, rng: np.random.Generator, x: float, y: float, aspect: float) -> None:
    radius = rng.uniform(0.045, 0.075)
    inner, middle = pick(rng, ROBES), shade(pick(rng, ROBES), 1.4)
    for scale, color in ((1.0, GOLD), (0.85, inner), (0.7, middle)):
        sketch.ellipse(x, y, scale * radius / aspect, scale * radius, color)
    for _ in range(7):
        (dx, dy), wide = rng.uniform(-0.4, 0.4, 2) * radius, 0.18 * radius / aspect
        color = shade(pick(rng, ROBES), 1.2)
        sketch.ellipse(x + dx / aspect, y + dy, wide, 0.2 * radius, color)
