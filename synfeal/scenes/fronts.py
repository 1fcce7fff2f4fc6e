"""Painters of the fronts of things: screens, shelves, doors, drawers, cartons, sheets of paper."""

from __future__ import annotations

from synfeal.scenes.canvas import Canvas, Colour, Pixels, Sketch, pick, shade
from synfeal.scenes.materials import marble, plaster
from synfeal.scenes.pictures import INK, VIVID, bordered, ramp

METAL: Colour = (0.75, 0.76, 0.78)
PAPER: Colour = (0.93, 0.92, 0.88)


def screen(canvas: Canvas) -> Pixels:
    """A computer screen: windows, a plot, lines of code."""
    rng = canvas.rng
    sketch = Sketch(ramp(canvas, shade(pick(rng, VIVID), 0.6), (0.1, 0.12, 0.2), rng.uniform(0, 6)))
    for _ in range(3):
        x, y = rng.uniform((0.04, 0.05), (0.5, 0.45))
        x1, y1 = x + rng.uniform(0.3, 0.45), y + rng.uniform(0.35, 0.5)
        dark = rng.random() < 0.5
        sketch.rectangle(x, y, x1, y1, (0.12, 0.12, 0.15) if dark else (0.95, 0.95, 0.95))
        sketch.rectangle(x, y, x1, y + 0.05, shade(pick(rng, VIVID), 0.9))
        ink: Colour = (0.6, 0.9, 0.7) if dark else (0.15, 0.15, 0.2)
        sketch.text_lines(rng, (x + 0.02, y + 0.08, x1 - 0.02, y1 - 0.03), 7, ink)
    return bordered(sketch.pixels(), 0.05, (0.06, 0.06, 0.07))


def spine(canvas: Canvas, colour: Colour) -> Pixels:
    """The back of a book: cloth, two bands and a title."""
    rng = canvas.rng
    sketch = Sketch(plaster(canvas, colour, 0.06, 0.03))
    bands = shade(pick(rng, VIVID), rng.uniform(0.6, 1.6))
    for y in (rng.uniform(0.06, 0.15), rng.uniform(0.8, 0.92)):
        sketch.rectangle(0, y, 1, y + 0.04, bands)
    top = rng.uniform(0.2, 0.4)
    sketch.text_lines(rng, (0.2, top, 0.85, top + rng.uniform(0.2, 0.35)), 6, shade(bands, 1.4))
    return sketch.pixels()


def door(canvas: Canvas, colour: Colour, window: bool = False) -> Pixels:
    """A door leaf with frame, panels, handle and, if wanted, a small window."""
    sketch = Sketch(plaster(canvas, colour, 0.05, 0.03))
    dark = shade(colour, 0.7)
    for y0, y1 in ((0.1, 0.45), (0.55, 0.92)):
        sketch.rectangle(0.18, y0, 0.82, y1, dark)
        sketch.rectangle(0.2, y0 + 0.01, 0.8, y1 - 0.01, shade(colour, 1.1))
    if window:
        sketch.rectangle(0.35, 0.12, 0.65, 0.4, (0.75, 0.85, 0.9))
    sketch.rectangle(0.85, 0.49, 0.93, 0.53, (0.8, 0.75, 0.5))
    return bordered(sketch.pixels(), 0.07, shade(colour, 0.55))


def cabinet_front(canvas: Canvas, colour: Colour, doors: int = 2, rows: int = 1) -> Pixels:
    """Doors or drawers side by side, each with a handle and a label."""
    sketch = Sketch(plaster(canvas, colour, 0.05, 0.03))
    for column in range(doors):
        for row in range(rows):
            x0, x1 = (column + 0.03) / doors, (column + 0.97) / doors
            y0, y1 = (row + 0.03) / rows, (row + 0.97) / rows
            tint = shade(colour, canvas.rng.uniform(0.9, 1.12))
            sketch.rectangle(x0, y0, x1, y1, shade(colour, 0.5))
            sketch.rectangle(x0 + 0.008, y0 + 0.008, x1 - 0.008, y1 - 0.008, tint)
            middle, wide = (x0 + x1) / 2, (x1 - x0) / 5
            sketch.rectangle(middle - wide, y0 + 0.1 / rows, middle + wide, y0 + 0.13 / rows, METAL)
            sketch.rectangle(middle - wide, y0 + 0.2 / rows, middle + wide, y0 + 0.4 / rows, PAPER)
            box = (middle - 0.9 * wide, y0 + 0.22 / rows, middle + 0.9 * wide, y0 + 0.38 / rows)
            sketch.text_lines(canvas.rng, box, 3, pick(canvas.rng, INK))
    return sketch.pixels() * (1 + 0.03 * canvas.noise(0.05, 3))[..., None]


def keyboard(canvas: Canvas) -> Pixels:
    """Dark keys in five rows."""
    sketch = Sketch(canvas.plain((0.1, 0.1, 0.11)))
    for row in range(5):
        for column in range(16):
            x, y = (column + 0.12) / 16, (row + 0.12) / 5
            sketch.rectangle(
                x, y, x + 0.048, y + 0.15, shade((0.28, 0.28, 0.3), canvas.rng.uniform(0.8, 1.2))
            )
    return sketch.pixels()


def page(canvas: Canvas) -> Pixels:
    """A printed sheet of paper, sometimes with a figure."""
    sketch = Sketch(canvas.plain(PAPER))
    sketch.text_lines(canvas.rng, (0.1, 0.06, 0.9, 0.14), 1, pick(canvas.rng, INK))
    sketch.text_lines(canvas.rng, (0.1, 0.5, 0.9, 0.94), 9, (0.2, 0.2, 0.2))
    sketch.rectangle(0.1, 0.18, 0.9, 0.46, shade(pick(canvas.rng, VIVID), 1.3))
    return sketch.pixels()


def label(canvas: Canvas, colour: Colour) -> Pixels:
    """A carton with a printed label."""
    sketch = Sketch(plaster(canvas, colour, 0.06, 0.03))
    sketch.rectangle(0.15, 0.2, 0.85, 0.8, PAPER)
    sketch.text_lines(canvas.rng, (0.2, 0.28, 0.8, 0.75), 3, pick(canvas.rng, INK))
    return sketch.pixels()


def gilded(canvas: Canvas) -> Pixels:
    """Gold leaf over carved wood."""
    image = marble(canvas, (0.86, 0.66, 0.24), (0.4, 0.24, 0.06), 0.12)
    return image * (1 + 0.15 * canvas.noise(0.03, 3))[..., None]
