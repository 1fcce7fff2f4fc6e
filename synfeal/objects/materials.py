"""Painters of materials and fronts: doors, shelves, screens, sheets of paper."""

from __future__ import annotations

import numpy as np

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


@painter
def painted(canvas: Canvas, color: Color, wear: float = 0.05) -> Pixels:
    """Paint a smooth surface of paint or plastic: one colour with a little wear.

    Args:
        canvas: What is painted on.
        color: Red, green and blue.
        wear: Standard deviation of the brightness, roughly, in parts of the full range.
    """
    return tinted(color, wear * canvas.noise(0.08, 3))


@painter
def plaster(canvas: Canvas, color: Color, stains: float = 0.03, grain: float = 0.012) -> Pixels:
    """Paint a painted wall: almost no texture, broad stains.

    Args:
        canvas: What is painted on.
        color: Red, green and blue, 0 to 1.
        stains: Standard deviation of the brightness, roughly, over most of a metre.
        grain: The same over a few centimetres.
    """
    return tinted(color, stains * canvas.noise(0.9, 5, 0.65) + grain * canvas.noise(0.025, 2))


@painter
def wainscot(
    canvas: Canvas,
    color: Color,
    lower: Color,
    height_m: float = 0.95,
    grain: float = 0.02,
    stains: float = 0.03,
) -> Pixels:
    """Paint plaster with another colour and a rail in its lower part.

    Args:
        canvas: What is painted on; its lower edge is the floor.
        color: Colour above the rail.
        lower: Colour below the rail, where stains are twice as strong.
        height_m: Height of the rail above the floor, metres.
        grain: See :func:`plaster`.
        stains: See :func:`plaster`.
    """
    image = plaster(color, stains, grain)(canvas)
    _, y = canvas.coordinates_m()
    above_floor = canvas.size_m[1] - y[:, 0]
    band = above_floor < height_m
    image[band] = plaster(lower, 2 * stains, grain)(canvas)[band]
    image[np.abs(above_floor - height_m) < 0.02] *= np.float32(0.55)
    image[above_floor < 0.09] *= np.float32(0.5)
    return image


@painter
def wood(canvas: Canvas, color: Color, contrast: float = 0.12) -> Pixels:
    """Paint wood grain along x."""
    cell = (0.8, 0.035)
    rings = np.sin(6 * canvas.noise((cell[0] * 3, cell[1] * 3), 2)).astype(np.float32)
    relief = contrast * (0.5 * rings + 0.6 * canvas.noise(cell, 4, 0.75))
    return tinted(color, relief.astype(np.float32))


@painter
def masonry(
    canvas: Canvas,
    palette: tuple[Color, ...],
    block_m: tuple[float, float],
    joint_m: float = 0.006,
    joint: Color = (0.45, 0.43, 0.4),
    stagger: float = 0.5,
    spread: float = 0.08,
) -> Pixels:
    """Paint tiles, bricks, planks or ashlar: blocks of random palette colours between joints.

    Args:
        canvas: What is painted on.
        palette: Colours of the blocks.
        block_m: Width and height of a block, half a joint on each side included, metres.
        joint_m: Width of the joints, metres.
        joint: Colour of the joints.
        stagger: Shift of every other row, as a share of a block.
        spread: Standard deviation of the blocks' brightness.
    """
    x, y = canvas.coordinates_m()
    row = np.floor(y / block_m[1]).astype(np.int64)
    shifted = x / block_m[0] + stagger * (row % 2)
    column = np.floor(shifted).astype(np.int64)
    n_rows, n_columns = int(row.max()) + 1, int(column.max()) + 1
    choice = canvas.rng.integers(len(palette), size=(n_rows, n_columns))
    tint = 1 + spread * canvas.rng.standard_normal((n_rows, n_columns))
    blocks = np.asarray(np.asarray(palette)[choice] * tint[..., None], np.float32)
    image = blocks[np.broadcast_to(row, column.shape), column]
    image = tinted(image, 0.05 * canvas.noise(0.06, 4, 0.8))
    edge_x = np.abs((shifted + 0.5) % 1 - 0.5) * block_m[0]
    edge_y = np.abs((y / block_m[1] + 0.5) % 1 - 0.5) * block_m[1]
    image[np.minimum(edge_x, edge_y) < joint_m / 2] = joint
    return image


@painter
def fabric(
    canvas: Canvas, color: Color, stripe: Color | None = None, pitch_m: float = 0.1
) -> Pixels:
    """Paint cloth with a weave and, if wanted, vertical stripes.

    Args:
        canvas: What is painted on.
        color: Colour of the cloth; no channel may be 0 where there are stripes.
        stripe: Colour of the stripes; None for no stripes.
        pitch_m: Distance from one stripe to the next, metres; each takes 0.3 of it.
    """
    image = tinted(color, 0.06 * canvas.noise(0.012, 2) + 0.06 * canvas.noise(0.3, 3))
    if stripe is not None:
        x, _ = canvas.coordinates_m()
        inside = (x[0] / pitch_m) % 1 < 0.3
        image[:, inside] *= np.divide(stripe, color, dtype=np.float32)
    return image


@painter
def marble(canvas: Canvas, color: Color, vein: Color, scale_m: float = 0.35) -> Pixels:
    """Paint polished stone with turbulent veins.

    Args:
        canvas: What is painted on.
        color: Colour of the stone.
        vein: Colour of the veins.
        scale_m: Size of the coarsest cells of the noise that veins follow, metres.
    """
    turbulence = canvas.noise(scale_m, 6, 0.65)
    share = np.exp(-9 * np.abs(turbulence)).astype(np.float32)
    share = np.clip(share + 0.12 * canvas.noise(scale_m / 3, 4), 0, 1)
    return mix(color, vein, share)


@painter
def rug(canvas: Canvas, palette: tuple[Color, ...]) -> Pixels:
    """Paint a woven rug: nested borders around a field of random diamonds."""
    x, y = canvas.coordinates_m()
    width, height = canvas.size_m
    inset = np.minimum(np.minimum(x, width - x), np.minimum(y, height - y))
    ring = np.floor(inset / 0.09).astype(np.int64)
    image = np.asarray(palette, np.float32)[np.minimum(ring, 2) % len(palette)]
    diamond = np.floor(x / 0.3 + y / 0.3) * 7 + np.floor((x - y) / 0.3) * 3
    table = canvas.rng.integers(len(palette), size=64)
    field = np.asarray(palette, np.float32)[table[diamond.astype(np.int64) % 64]]
    image = np.where((ring >= 3)[..., None], field, image)
    zigzag = np.abs((x + 0.5 * y) / 0.06 % 1 - 0.5) < 0.12
    image[zigzag & (ring == 1)] = palette[-1]
    return tinted(image, 0.08 * canvas.noise(0.015, 2))


@painter
def damask(canvas: Canvas, color: Color, motif: Color, pitch_m: float = 0.22) -> Pixels:
    """Paint wallpaper with a repeated flower-like motif; repetition is the point.

    Args:
        canvas: What is painted on.
        color: Colour of the ground.
        motif: Colour of the motif.
        pitch_m: Distance from one motif to the next in a row, metres; rows are 0.8 of it apart.
    """
    x, y = canvas.coordinates_m()
    row = np.floor(y / (0.8 * pitch_m))
    u = ((x / pitch_m + 0.5 * (row % 2)) % 1 - 0.5) * 2
    v = ((y / (0.8 * pitch_m)) % 1 - 0.5) * 2
    radius, angle = np.hypot(u, v), np.arctan2(v, u)
    petal = radius < 0.35 + 0.3 * np.cos(5 * angle)
    image = plaster(color, 0.05)(canvas)
    image[petal] = motif
    return tinted(image, 0.03 * canvas.noise(0.02, 2))


METAL: Color = (0.75, 0.76, 0.78)
PAPER: Color = (0.93, 0.92, 0.88)


@painter
def screen(canvas: Canvas) -> Pixels:
    """Paint a computer screen: windows with lines of code."""
    rng = canvas.rng
    sketch = Sketch(ramp(canvas, shade(pick(rng, VIVID), 0.6), (0.1, 0.12, 0.2), rng.uniform(0, 6)))
    for _ in range(3):
        x, y = rng.uniform((0.04, 0.05), (0.5, 0.45))
        x1, y1 = x + rng.uniform(0.3, 0.45), y + rng.uniform(0.35, 0.5)
        dark = rng.random() < 0.5
        sketch.rectangle(x, y, x1, y1, (0.12, 0.12, 0.15) if dark else (0.95, 0.95, 0.95))
        sketch.rectangle(x, y, x1, y + 0.05, shade(pick(rng, VIVID), 0.9))
        ink: Color = (0.6, 0.9, 0.7) if dark else (0.15, 0.15, 0.2)
        sketch.text_lines(rng, (x + 0.02, y + 0.08, x1 - 0.02, y1 - 0.03), 7, ink)
    return bordered(sketch.pixels(), 0.05, (0.06, 0.06, 0.07))


@painter
def spine(canvas: Canvas, color: Color) -> Pixels:
    """Paint the back of a book: cloth, two bands and a title."""
    rng = canvas.rng
    sketch = Sketch(plaster(color, 0.06, 0.03)(canvas))
    bands = shade(pick(rng, VIVID), rng.uniform(0.6, 1.6))
    for y in (rng.uniform(0.06, 0.15), rng.uniform(0.8, 0.92)):
        sketch.rectangle(0, y, 1, y + 0.04, bands)
    top = rng.uniform(0.2, 0.4)
    sketch.text_lines(rng, (0.2, top, 0.85, top + rng.uniform(0.2, 0.35)), 6, shade(bands, 1.4))
    return sketch.pixels()


@painter
def door(canvas: Canvas, color: Color, window: bool = False) -> Pixels:
    """Paint a door leaf with frame, panels, handle and, if wanted, a small window."""
    sketch = Sketch(plaster(color, 0.05, 0.03)(canvas))
    dark = shade(color, 0.7)
    for y0, y1 in ((0.1, 0.45), (0.55, 0.92)):
        sketch.rectangle(0.18, y0, 0.82, y1, dark)
        sketch.rectangle(0.2, y0 + 0.01, 0.8, y1 - 0.01, shade(color, 1.1))
    if window:
        sketch.rectangle(0.35, 0.12, 0.65, 0.4, (0.75, 0.85, 0.9))
    sketch.rectangle(0.85, 0.49, 0.93, 0.53, (0.8, 0.75, 0.5))
    return bordered(sketch.pixels(), 0.07, shade(color, 0.55))


@painter
def cabinet_front(canvas: Canvas, color: Color, doors: int = 2, rows: int = 1) -> Pixels:
    """Paint doors or drawers, each with a handle and a label.

    Args:
        canvas: What is painted on.
        color: Colour of the fronts, varied a little from one to the next.
        doors: Number of them side by side.
        rows: Number of them one above the other.
    """
    sketch = Sketch(plaster(color, 0.05, 0.03)(canvas))
    for column in range(doors):
        for row in range(rows):
            x0, x1 = (column + 0.03) / doors, (column + 0.97) / doors
            y0, y1 = (row + 0.03) / rows, (row + 0.97) / rows
            tint = shade(color, canvas.rng.uniform(0.9, 1.12))
            sketch.rectangle(x0, y0, x1, y1, shade(color, 0.5))
            sketch.rectangle(x0 + 0.008, y0 + 0.008, x1 - 0.008, y1 - 0.008, tint)
            middle, wide = (x0 + x1) / 2, (x1 - x0) / 5
            sketch.rectangle(middle - wide, y0 + 0.1 / rows, middle + wide, y0 + 0.13 / rows, METAL)
            sketch.rectangle(middle - wide, y0 + 0.2 / rows, middle + wide, y0 + 0.4 / rows, PAPER)
            box = (middle - 0.9 * wide, y0 + 0.22 / rows, middle + 0.9 * wide, y0 + 0.38 / rows)
            sketch.text_lines(canvas.rng, box, 3, pick(canvas.rng, INK))
    return tinted(sketch.pixels(), 0.03 * canvas.noise(0.05, 3))


@painter
def keyboard(canvas: Canvas) -> Pixels:
    """Paint dark keys in five rows."""
    sketch = Sketch(canvas.plain((0.1, 0.1, 0.11)))
    for row in range(5):
        for column in range(16):
            x, y = (column + 0.12) / 16, (row + 0.12) / 5
            key = shade((0.28, 0.28, 0.3), canvas.rng.uniform(0.8, 1.2))
            sketch.rectangle(x, y, x + 0.048, y + 0.15, key)
    return sketch.pixels()


@painter
def page(canvas: Canvas) -> Pixels:
    """Paint a printed sheet of paper: a heading, a coloured figure, text."""
    sketch = Sketch(canvas.plain(PAPER))
    sketch.text_lines(canvas.rng, (0.1, 0.06, 0.9, 0.14), 1, pick(canvas.rng, INK))
    sketch.text_lines(canvas.rng, (0.1, 0.5, 0.9, 0.94), 9, (0.2, 0.2, 0.2))
    sketch.rectangle(0.1, 0.18, 0.9, 0.46, shade(pick(canvas.rng, VIVID), 1.3))
    return sketch.pixels()


@painter
def label(canvas: Canvas, color: Color) -> Pixels:
    """Paint a carton with a printed label."""
    sketch = Sketch(plaster(color, 0.06, 0.03)(canvas))
    sketch.rectangle(0.15, 0.2, 0.85, 0.8, PAPER)
    sketch.text_lines(canvas.rng, (0.2, 0.28, 0.8, 0.75), 3, pick(canvas.rng, INK))
    return sketch.pixels()


@painter
def gilded(canvas: Canvas) -> Pixels:
    """Paint gold leaf over carved wood."""
    image = marble((0.86, 0.66, 0.24), (0.4, 0.24, 0.06), 0.12)(canvas)
    return tinted(image, 0.15 * canvas.noise(0.03, 3))
