"""Painters of the sanctuary's frescoes."""

from __future__ import annotations

import numpy as np

from synfeal.scenes.canvas import Canvas, Colour, Pixels, Sketch, pick, shade
from synfeal.scenes.materials import mix

ROBES: tuple[Colour, ...] = (
    (0.7, 0.15, 0.12), (0.15, 0.25, 0.6), (0.2, 0.45, 0.25), (0.75, 0.5, 0.15),
    (0.5, 0.2, 0.4), (0.85, 0.8, 0.7), (0.35, 0.2, 0.12),
)  # fmt: skip
GOLD: Colour = (0.9, 0.72, 0.3)
SKIN: Colour = (0.85, 0.65, 0.5)


def mural(canvas: Canvas, ground: Colour, sky: Colour, figures: int = 5) -> Pixels:
    """Saints before a landscape of ``ground`` and ``sky``, framed by a painted border."""
    rng = canvas.rng
    y = (np.arange(canvas.height_px, dtype=np.float32) / canvas.height_px)[:, None]
    horizon = 0.55 + 0.06 * canvas.noise((canvas.size_m[0] / 3, 1e3), 3)
    share = np.clip((y - horizon) * 12 + 0.5, 0, 1).astype(np.float32)
    clouds = (1 + 0.12 * canvas.noise((0.6, 0.25), 4))[..., None]
    image = mix(
        np.asarray(sky, np.float32) * clouds, np.asarray(ground, np.float32) * clouds, share
    )
    sketch = Sketch(image)
    for x in np.linspace(0.16, 0.84, figures) + rng.uniform(-0.04, 0.04, figures):
        _saint(sketch, rng, x, rng.uniform(0.3, 0.45), canvas)
    _border(sketch, rng, shade(ground, 0.55), canvas)
    aged = 1 + 0.1 * canvas.noise(0.25, 5, 0.75)
    return sketch.pixels() * aged[..., None]


def _saint(sketch: Sketch, rng: np.random.Generator, x: float, top: float, canvas: Canvas) -> None:
    aspect = canvas.height_px / canvas.width_px
    robe, head = pick(rng, ROBES), 0.055 * (1.0 - top)
    wide, foot = 2.2 * head * aspect, rng.uniform(0.86, 0.92)
    sketch.ellipse(x, top, 1.9 * head * aspect, 1.9 * head, GOLD)
    shoulder = top + 2 * head
    hem_left, hem_right = (x - 1.5 * wide, foot), (x + 1.5 * wide, foot)
    body = np.array([(x - wide, shoulder), (x + wide, shoulder), hem_right, hem_left])
    sketch.polygon(body, robe)
    for _ in range(6):
        fold = rng.uniform(-1.2, 1.2) * wide
        line = np.array([(x + 0.6 * fold, top + 2.5 * head), (x + fold, foot)])
        sketch.line(line, shade(robe, rng.uniform(0.5, 1.5)), 0.008)
    mantle = shade(pick(rng, ROBES), 1.2)
    side = rng.choice((-1, 1)) * wide
    sketch.polygon(
        np.array([(x + side, shoulder), (x - 0.3 * side, top + 3 * head), (x + 1.4 * side, 0.75)]),
        mantle,
    )
    hair = shade((0.3, 0.2, 0.1), rng.uniform(0.5, 2.5))
    sketch.ellipse(x, top - 0.15 * head, 1.1 * head * aspect, 1.2 * head, hair)
    sketch.ellipse(x, top + 0.25 * head, 0.8 * head * aspect, 0.95 * head, SKIN)
    staff = x + 1.6 * side
    sketch.line(np.array([(staff, top), (staff, foot)]), GOLD, 0.008)


def _border(sketch: Sketch, rng: np.random.Generator, colour: Colour, canvas: Canvas) -> None:
    edge_y = 0.1 / canvas.size_m[1]
    edge_x = 0.1 / canvas.size_m[0]
    for box in ((0, 0, 1, edge_y), (0, 1 - edge_y, 1, 1), (0, 0, edge_x, 1), (1 - edge_x, 0, 1, 1)):
        sketch.rectangle(box[0], box[1], box[2], box[3], colour)
    for x in np.arange(edge_x, 1 - edge_x, 1.5 * edge_x):
        for y in (edge_y / 2, 1 - edge_y / 2):
            sketch.ellipse(x, y, 0.4 * edge_x, 0.4 * edge_y, shade(pick(rng, ROBES), 1.3))
    for y in np.arange(edge_y, 1 - edge_y, 1.5 * edge_y):
        for x in (edge_x / 2, 1 - edge_x / 2):
            sketch.ellipse(x, y, 0.4 * edge_x, 0.4 * edge_y, GOLD)


def starry_vault(canvas: Canvas, first: Colour, second: Colour) -> Pixels:
    """A painted vault: from ``first`` to ``second`` along x, golden stars, ribbons, medallions."""
    rng = canvas.rng
    x, _ = canvas.coordinates_m()
    share = np.broadcast_to(x / canvas.size_m[0], (canvas.height_px, canvas.width_px)).astype(
        np.float32
    )
    image = mix(np.asarray(first, np.float32), np.asarray(second, np.float32), share)
    sketch = Sketch(image * (1 + 0.12 * canvas.noise(0.7, 5, 0.7))[..., None])
    aspect = canvas.width_px / canvas.height_px
    for _ in range(260):
        at_x, at_y = rng.uniform(0.01, 0.99, 2)
        _star(sketch, at_x, at_y, rng.uniform(0.006, 0.014), aspect)
    for at_x in np.linspace(0.12, 0.88, 5):
        for at_y in (0.22, 0.5, 0.78):
            _medallion(sketch, rng, at_x + rng.uniform(-0.02, 0.02), at_y, aspect)
    return sketch.pixels() * (1 + 0.06 * canvas.noise(0.12, 4, 0.8))[..., None]


def _star(sketch: Sketch, x: float, y: float, radius: float, aspect: float) -> None:
    angle = np.arange(10) * np.pi / 5
    reach = radius * np.where(np.arange(10) % 2, 0.4, 1.0)
    points = np.stack([x + reach * np.cos(angle) / aspect, y + reach * np.sin(angle)], axis=1)
    sketch.polygon(points, GOLD)


def _medallion(sketch: Sketch, rng: np.random.Generator, x: float, y: float, aspect: float) -> None:
    radius = rng.uniform(0.045, 0.075)
    for scale, colour in (
        (1.0, GOLD),
        (0.85, pick(rng, ROBES)),
        (0.7, shade(pick(rng, ROBES), 1.4)),
    ):
        sketch.ellipse(x, y, scale * radius / aspect, scale * radius, colour)
    for _ in range(7):
        dx, dy = rng.uniform(-0.4, 0.4, 2) * radius
        sketch.ellipse(
            x + dx / aspect,
            y + dy,
            0.18 * radius / aspect,
            0.2 * radius,
            shade(pick(rng, ROBES), 1.2),
        )
