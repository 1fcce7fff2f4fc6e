"""What speed costs: the variants a stage could choose among, how fast and how wrong each is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median

from synfeal.dataset.number_table import read_numbers
from synfeal.errors import InputError
from synfeal.report.assistance import TOTAL
from synfeal.report.label_error import COLUMNS as LABEL_COLUMNS
from synfeal.report.layouts import SOURCES
from synfeal.report.render_speed import COLUMNS as RENDER_COLUMNS
from synfeal.report.render_speed import render_rows
from synfeal.report.results import read_table
from synfeal.report.tables import Value, write_rows
from synfeal.report.training_speed import training_rows
from synfeal.scenes.collision import CURVE_HEADER, Rung

NAME = "speed_vs_error"
COLUMNS = (
    *("stage", "scene", "variant", "faces", "seconds_per_item", "items_per_s"),
    *("error", "error_unit", "chosen", *RENDER_COLUMNS),
)
Row = dict[str, Value]


def write_speed_vs_error(scenes: Sequence[str], root: Path, out_csv: Path) -> None:
    """Write one row per stage, scene and variant; ``chosen`` is 1 where the pipeline uses it.

    Speeds are measured, so this table is not the same in every run.

    Args:
        scenes: the scenes of the tables, in order.
        root: results directory of the profile.
        out_csv: the table.

    Raises:
        InputError: a stage's measurements are missing or unreadable.
    """
    rows = [row for reader in READERS for scene in scenes for row in reader(root, scene)]
    write_rows(out_csv, COLUMNS, rows)


def collision_rows(root: Path, scene: str) -> list[Row]:
    """The face counts of the collision mesh, largest first; an item is a ray, an error a decision.

    The curve holds each mesh's speed beside the full mesh's at the same moment. Only their ratio
    is free of what else the machine did, so it is applied to the full mesh's median speed.
    """
    path = root / "scenes" / scene / "collision_curve.csv"
    values = read_numbers(path, CURVE_HEADER, "curve of the collision mesh")
    curve = [Rung(*line) for line in values.tolist()]
    if not curve or min(min(r.rays_per_s, r.full_rays_per_s) for r in curve) <= 0:
        raise InputError(f"{path}: needs rows, and speeds above 0; make the scene again")
    full_rays_per_s = median(rung.full_rays_per_s for rung in curve)
    variants = ["full"] + ["decimated"] * (len(curve) - 1)
    return [
        _row(scene, variant, rung, full_rays_per_s * rung.rays_per_s / rung.full_rays_per_s)
        for variant, rung in zip(variants, curve, strict=True)
    ]


def _row(scene: str, variant: str, rung: Rung, rays_per_s: float) -> Row:
    return {
        "stage": "collision",
        "scene": scene,
        "variant": variant,
        "faces": int(rung.faces),
        "seconds_per_item": 1.0 / rays_per_s,
        "items_per_s": rays_per_s,
        "error": 1.0 - rung.agreement,
        "error_unit": "share of decisions",
        "chosen": int(rung.chosen),
    }


def label_rows(root: Path, scene: str) -> list[Row]:
    """The methods that estimate labels; an item is a frame, an error that of its position.

    The error is the median over both splits after assistance; times are of the processor. Nothing
    is chosen: the paper compares the methods.
    """
    numbers = ("seconds_per_frame", "position_m_median")
    rows = read_table(root / "tables" / "label_error.csv", LABEL_COLUMNS, numbers)
    shown = {"scene": scene, "split": TOTAL, "assistance": "after"}
    return [
        {
            "stage": "labels",
            "scene": scene,
            "variant": SOURCES[row["method"]],
            "seconds_per_item": float(row["seconds_per_frame"]),
            "items_per_s": 1.0 / float(row["seconds_per_frame"]),
            "error": float(row["position_m_median"]),
            "error_unit": "m",
            "chosen": 0,
        }
        for row in rows
        if shown.items() <= row.items()
    ]


READERS: tuple[Callable[[Path, str], list[Row]], ...] = (
    collision_rows,
    render_rows,
    label_rows,
    training_rows,
)
