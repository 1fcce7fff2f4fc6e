"""Speed and error of the variants that a stage could choose among."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd

from reproduction.runs.job_times import read_jobs
from reproduction.speed.collection import EFFECTS_SCHEMA
from reproduction.speed.rendering import SCHEMA as RENDERED
from reproduction.tables import robustness
from reproduction.tables.assistance import TOTAL
from reproduction.tables.columns import Column, SideLayout
from reproduction.tables.label_error import SCHEMA as LABEL_ERROR
from reproduction.tables.layouts import SOURCES, TITLES, scene_title
from reproduction.tables.side import SideTable, Source, Table
from synfeal.collection.collision import CURVE_HEADER
from synfeal.config.effects import CLEAN
from synfeal.errors import InputError
from synfeal.records.tables import (
    COUNT,
    LIMITLESS_MAYBE,
    MAYBE,
    MAYBE_COUNT,
    NUMBER,
    TEXT,
    frame_of,
    read_frame,
    read_numbers,
    records_of,
    rows_of,
)

# The table whose training runs are shown, and the part of their names that all of them share.
TABLE = "table4_size"
KIND = "synfeal/pretrained"
CELL = {
    "scene": TEXT,
    "size": TEXT,
    "model": TEXT,
    "n_train": COUNT,
    "n_seeds": COUNT,
    "position_m_true": MAYBE,
}


def training_rows(root: Path, scene: str) -> pd.DataFrame:
    """Tabulate the localizers on the largest set of Table 4; an item is an image shown.

    The error is the median of positions against the true poses, in metres. The time is that of
    the processor in the whole job, over all seeds: starting up, reading frames, and predicting the
    test set are in it. Nothing is chosen: the paper compares the localizers. No rows where the
    design has no Table 4, and none for a localizer of which all seeds failed.
    """
    path = root / "tables" / f"{TABLE}.csv"
    cells = read_frame(path, CELL) if path.exists() else frame_of((), CELL)
    cells = cells[cells.scene == scene]
    cells = cells[cells.n_train == cells.n_train.max()].dropna(subset="position_m_true")
    seconds = [
        _seconds_per_image(root, f"{c.scene}/{c.size}/{KIND}/{c.model}", c.n_seeds)
        for c in rows_of(cells)
    ]
    return pd.DataFrame(
        {
            "variant": cells.model.map(TITLES),
            "seconds_per_item": seconds,
            "error": cells.position_m_true,
            "error_unit": "m",
            "chosen": 0,
        }
    )


def _seconds_per_image(root: Path, run: str, n_seeds: int) -> float:
    """Divide the processor seconds of a localizer's training runs by the images shown in them."""
    seconds, shown = 0.0, 0
    for seed in range(n_seeds):
        measured = root / "benchmarks" / "train" / f"{run}/seed{seed}.tsv"
        job = read_jobs([measured] if measured.exists() else [], root / "benchmarks")
        if not job.cpu_s.sum() > 0.0:
            raise InputError(measured, "missing, or measured no time", "train it again")
        history = root / "runs" / f"{run}/seed{seed}" / "history.csv"
        images = read_frame(history, {"samples_seen": COUNT}, "train it again").samples_seen
        if images.empty or images.iloc[-1] <= 0:
            raise InputError(history, "shows no images", "train it again")
        seconds, shown = seconds + job.cpu_s.sum(), shown + images.iloc[-1]
    return float(seconds / shown)


NAME = "speed_vs_error"
SCHEMA = {
    "stage": TEXT,
    "scene": TEXT,
    "variant": TEXT,
    "faces": MAYBE_COUNT,
    **dict.fromkeys(("seconds_per_item", "items_per_s", "error"), NUMBER),
    "error_unit": TEXT,
    "chosen": COUNT,
    "backend": TEXT,
    "width": MAYBE_COUNT,
    "height": MAYBE_COUNT,
    "supersampling": MAYBE_COUNT,
    "texture_scale": MAYBE,
    "psnr_db": LIMITLESS_MAYBE,
    "depth_error_mm": MAYBE,
    "depth_off_share": MAYBE,
}


def speeds_of(stage: str, scenes: Sequence[str], root: Path) -> pd.DataFrame:
    """Tabulate the variants of one stage.

    Args:
        stage: Key of ``READERS``.
        scenes: Names of the scenes.
        root: Results of the profile.

    Returns:
        Columns ``SCHEMA``; an item is what the stage makes one of.
    """
    parts = [READERS[stage](root, scene).assign(scene=scene) for scene in scenes]
    rows = [row for part in parts for row in records_of(part)]
    same = {"stage": stage}
    return frame_of(
        [same | row | {"items_per_s": 1.0 / row["seconds_per_item"]} for row in rows], SCHEMA
    )


def collision_rows(root: Path, scene: str) -> pd.DataFrame:
    """Tabulate face counts of the collision mesh; an item is a ray, an error a decision.

    The curve holds each mesh's speed beside the full mesh's at the same moment. Only their ratio
    is free of what else the machine did, so it is applied to the full mesh's median speed.

    Raises:
        InputError: A speed is not above 0.
    """
    path = root / "scenes" / scene / "collision_curve.csv"
    values = read_numbers(path, CURVE_HEADER, "curve of the collision mesh")
    curve = pd.DataFrame(values, columns=CURVE_HEADER.split(","))
    if curve.empty:  # nothing was decimated: `collection.collision_agreement` is null
        return pd.DataFrame()
    if (curve[["rays_per_s", "full_rays_per_s"]] <= 0).to_numpy().any():
        raise InputError(path, "needs speeds above 0", "make the scene again")
    rays_per_s = curve.full_rays_per_s.median() * curve.rays_per_s / curve.full_rays_per_s
    return pd.DataFrame(
        {
            "variant": ["full"] + ["decimated"] * (len(curve) - 1),
            "faces": curve.faces.astype(int),
            "seconds_per_item": 1.0 / rays_per_s,
            "error": 1.0 - curve.agreement,
            "error_unit": "share of decisions",
            "chosen": curve.chosen.astype(int),
        }
    )


def render_rows(root: Path, scene: str) -> pd.DataFrame:
    """Tabulate ways to draw a frame, by camera.

    An item is a colour image; its error is in grey levels, 0 to 255.
    """
    lines = read_frame(root / "scenes" / scene / "render_speed.csv", RENDERED, "measure again")
    camera = lines.width.astype(str) + "x" + lines.height.astype(str) + ", "
    return lines.assign(
        variant=camera + _detail(lines),
        seconds_per_item=lines.ms_per_frame / 1e3,
        error=lines.mean_abs_error,
        error_unit="grey levels",
    )


def _detail(lines: pd.DataFrame) -> pd.Series:
    """Describe variants: backend, samples per pixel, and what detail of the mesh is left out."""
    samples = lines.supersampling.astype(str)
    textures = [
        "" if scale == 1.0 else f", textures 1/{round(1.0 / scale)}"
        for scale in lines.texture_scale
    ]
    share = lines.faces / lines.faces.max()
    faces = ["" if part == 1.0 else f", {part:.0%} of faces" for part in share]
    return lines.backend + " " + samples + "x" + samples + textures + faces


def label_rows(root: Path, scene: str) -> pd.DataFrame:
    """Tabulate methods that estimate labels; an item is a frame, an error that of its position.

    The error is the median over both splits after assistance; times are of the processor. Nothing
    is chosen: the paper compares the methods. No rows where the design has no such labels.
    """
    path = root / "tables" / "label_error.csv"
    table = read_frame(path, LABEL_ERROR) if path.exists() else frame_of((), LABEL_ERROR)
    chosen = (table.scene == scene) & (table.split == TOTAL) & (table.assistance == "after")
    return pd.DataFrame(
        {
            "variant": table.method.map(SOURCES),
            "seconds_per_item": table.seconds_per_frame,
            "error": table.position_m_median,
            "error_unit": "m",
            "chosen": 0,
        }
    )[chosen]


def effect_rows(root: Path, scene: str) -> pd.DataFrame:
    """Tabulate measured effects of camera and light; an item is a frame for the network.

    Seconds are processor time; an error is the median position error of the localizers trained on
    ideal frames, the mean over the five. The tables of the paper use ideal frames.
    """
    measured = root / "scenes" / scene / "effects_speed.csv"
    tested = root / "tables" / f"{robustness.NAME}.csv"
    if not (measured.exists() and tested.exists()):
        return pd.DataFrame()
    table = robustness.read_robustness(tested)
    trained = table[(table.trained_on == CLEAN) & table.method.isin(TITLES)]
    errors_m = trained.groupby("effects").position_m.mean()
    speeds = read_frame(measured, EFFECTS_SCHEMA, "measure again")
    return speeds.assign(
        variant=speeds.effects.map(robustness.effects_title),
        seconds_per_item=speeds.cpu_s_per_frame,
        error=speeds.effects.map(errors_m),
        error_unit="m",
        chosen=speeds.effects.eq(CLEAN).astype(int),
    )


READERS: dict[str, Callable[[Path, str], pd.DataFrame]] = {
    "collision": collision_rows,
    "render": render_rows,
    "labels": label_rows,
    "training": training_rows,
    "effects": effect_rows,
}

COLUMNS = (
    Column("Stage", "stage"),
    Column("Scene", "scene"),
    Column("Variant", "variant"),
    Column("Faces", "faces", "{:,.0f}"),
    Column("Items per second", "items_per_s", "{:,.0f}"),
    Column("Error", "error", "{:.3g}"),
    Column("Error unit", "error_unit"),
    Column("Used", "used"),
)
CAPTION = (
    "What a stage could choose among; marked rows are what the run used. Speeds are measured and"
    " differ between runs."
)


def side_layout(table: pd.DataFrame) -> SideLayout:
    """Tabulate each stage's variants, how fast and how wrong each is."""
    used, style = (table.chosen.map({1: text, 0: ""}) for text in ("✓", "used"))
    rows = table.assign(scene=table.scene.map(scene_title), used=used, style=style)
    return SideLayout(NAME, CAPTION, COLUMNS, rows)


@SideTable(
    name="speed_vs_error",
    title="Speed vs error",
    rank=90,
    needs=(
        "scenes/{scene}/collision_curve.csv",
        "scenes/{scene}/render_speed.csv",
        "scenes/{timed_scene}/effects_speed.csv",
        "tables/{table:label_error}.csv",
        "tables/{table:robustness}.csv",
        "tables/{table:table4_size}.csv",
        "runs/{run:table4_size}/history.csv",
        "benchmarks/train/{run:table4_size}.tsv",
    ),
)
class SpeedVsErrorTable(Table):
    """Speed and error of the variants that each stage could choose among."""

    schema = SCHEMA
    layout = staticmethod(side_layout)

    def rows(self, source: Source) -> pd.DataFrame:
        """Read speeds, which are measured and so not the same in every run."""
        stages = [speeds_of(stage, source.scenes, source.root) for stage in READERS]
        return pd.concat(stages, ignore_index=True)
