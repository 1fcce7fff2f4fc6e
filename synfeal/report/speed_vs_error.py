"""What speed costs: the variants a stage could choose among, how fast and how wrong each is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from statistics import median

from synfeal.dataset.number_table import read_numbers
from synfeal.mesh.collision import CURVE_HEADER, Rung
from synfeal.report.tables import Value, write_rows

COLUMNS = (
    *("stage", "scene", "variant", "faces", "seconds_per_item", "items_per_s"),
    *("error", "error_unit", "chosen"),
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


READERS: tuple[Callable[[Path, str], list[Row]], ...] = (collision_rows,)
