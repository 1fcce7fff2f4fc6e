"""The rows of ``speed_vs_error.csv`` that say what rendering costs."""

from __future__ import annotations

from pathlib import Path

from synfeal.report.tables import Value
from synfeal.scenes.render_speed_table import Measured, read_speed

COLUMNS = (
    *("backend", "width", "height", "supersampling", "texture_scale"),
    *("psnr_db", "depth_error_mm", "depth_off_share"),
)


def render_rows(root: Path, scene: str) -> list[dict[str, Value]]:
    """Ways to draw a frame, by camera; an item is a colour image, an error is in levels of 0-255.

    Raises:
        InputError: the measurements are missing or unreadable.
    """
    lines = read_speed(root / "scenes" / scene / "render_speed.csv")
    full = max((line.faces for line in lines), default=0)
    return [_row(scene, line, full) for line in lines]


def _row(scene: str, line: Measured, full_faces: int) -> dict[str, Value]:
    row: dict[str, Value] = {
        "stage": "render",
        "scene": scene,
        "variant": f"{line.width}x{line.height}, {name_of(line, full_faces)}",
        "faces": line.faces,
        "seconds_per_item": line.ms_per_frame / 1e3,
        "items_per_s": 1e3 / line.ms_per_frame,
        "error": line.mean_abs_error,
        "error_unit": "grey levels",
        "chosen": line.chosen,
    }
    return row | {column: getattr(line, column) for column in COLUMNS}


def name_of(line: Measured, full_faces: int) -> str:
    """A variant in words: backend, samples per pixel, and what detail of the mesh is left out."""
    name = f"{line.backend} {line.supersampling}x{line.supersampling}"
    if line.texture_scale != 1.0:
        name += f", textures 1/{round(1.0 / line.texture_scale)}"
    if line.faces != full_faces:
        name += f", {line.faces / full_faces:.0%} of faces"
    return name
