"""Sections 4 and 4.3: scenes, speed and methods; none of it depends on a localizer's score."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field, PositiveInt, TypeAdapter

from synfeal.errors import InputError
from synfeal.report.claims.evidence import Evidence
from synfeal.report.claims.model import (
    FAILS,
    HOLDS,
    NOT_TESTABLE,
    UNDECIDED,
    Claim,
    Outcome,
    Verdict,
)
from synfeal.report.layouts import scene_title
from synfeal.report.meshes import read_mesh_facts
from synfeal.report.results import check_result, read_result

SCENES = ("large_room", "sanctuary")
MEAN_7_SCENES_M3 = 6.37
# What the published code renders; smaller frames are written sooner and say nothing about it.
PIXELS_OF_THE_PAPER = 640 * 480
SPLITS = ("train", "test")


class _Camera(BaseModel):
    width: PositiveInt
    height: PositiveInt


class _Shard(BaseModel):
    name: Annotated[str, Field(pattern=r"^[\w-]+$", max_length=64)]
    frames: PositiveInt


class _Record(BaseModel):
    camera: _Camera
    shards: list[_Shard]


_SHAPE = TypeAdapter(_Record)


def collection_rate(claim: Claim, evidence: Evidence) -> Outcome:
    """C14: every scene is collected at the published rate, at the published size of a frame."""
    rates = {scene: _rates(evidence, scene) for scene in SCENES}
    sizes = {scene: _records(evidence, scene)[0]["camera"] for scene in SCENES}
    measured = ", ".join(
        f"{scene_title(scene)} {rate:.1f} frames/s at {size['width']} x {size['height']}"
        for (scene, (rate, _, _)), size in zip(rates.items(), sizes.values(), strict=True)
    )
    spans = [f"{scene_title(s)} {low:.1f} to {high:.1f}" for s, (_, low, high) in rates.items()]
    interval = f"single shards, without planning: {', '.join(spans)}"
    if any(size["width"] * size["height"] < PIXELS_OF_THE_PAPER for size in sizes.values()):
        reason = "frames are smaller than 640 x 480, and the machine is another one"
        return Outcome(NOT_TESTABLE, measured, interval, reason)
    parts = [HOLDS if rate >= claim.numbers[0] else FAILS for rate, _, _ in rates.values()]
    return Outcome(_together(parts), measured, interval, "one machine, one measurement per job")


def times_7_scenes(claim: Claim, evidence: Evidence) -> Outcome:
    """C16: both volumes, over the mean of the 7-Scenes and rounded, are the published numbers."""
    ratios = []
    for scene in SCENES:
        evidence.file(f"scenes/{scene}/properties.json")
        ratios.append(read_mesh_facts(evidence.root, scene).volume_m3 / MEAN_7_SCENES_M3)
    alike = [round(r) == n for r, n in zip(ratios, claim.numbers, strict=True)]
    names = map(scene_title, SCENES)
    measured = ", ".join(f"{name} {r:.2f}" for name, r in zip(names, ratios, strict=True))
    return Outcome(HOLDS if all(alike) else FAILS, measured, "", "volumes are exact")


def _together(parts: list[Verdict]) -> Verdict:
    return parts[0] if len(set(parts)) == 1 else UNDECIDED


def _records(evidence: Evidence, scene: str) -> list[dict[str, Any]]:
    """What the packed frames of a scene are, split by split."""
    paths = [evidence.file(f"frames/{scene}/{split}.json") for split in SPLITS]
    remedy = "pack those frames again"
    records = [read_result(path, ("camera", "shards"), remedy) for path in paths]
    for path, record in zip(paths, records, strict=True):
        check_result(path, record, _SHAPE, remedy)
    return records


def _rates(evidence: Evidence, scene: str) -> tuple[float, float, float]:
    """Frames per second of a scene, planning included, and of its slowest and fastest shard."""
    records = _records(evidence, scene)
    frames = {shard["name"]: shard["frames"] for record in records for shard in record["shards"]}
    jobs = f"benchmarks/render_packed/{scene}"
    seconds = {name: _seconds(evidence.file(f"{jobs}/{name}.tsv")) for name in frames}
    plans = [evidence.file(f"benchmarks/plan/{scene}/{split}.tsv") for split in SPLITS]
    whole = sum(seconds.values()) + sum(map(_seconds, plans))
    each = [count / seconds[name] for name, count in frames.items()]
    return sum(frames.values()) / whole, min(each), max(each)


def _seconds(path: Path) -> float:
    """Mean wall time over the rows of a Snakemake benchmark file."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            found = [float(row["s"]) for row in csv.DictReader(file, delimiter="\t")]
        if not 0 < min(found) <= max(found) < math.inf:
            raise ValueError("a time is no positive number")
        return sum(found) / len(found)
    except (OSError, KeyError, ValueError, TypeError, csv.Error) as error:
        raise InputError(
            f"{path}: cannot be read as a benchmark ({error!r}); run it again"
        ) from None
