"""Sections 4 and 4.3: scenes, speed and methods; none of it depends on a localizer's score."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from synfeal.errors import InputError
from synfeal.report.claims.evidence import Evidence
from synfeal.report.claims.model import (
    FAILS,
    HOLDS,
    NOT_TESTABLE,
    UNDECIDED,
    Claim,
    Missing,
    Outcome,
    Verdict,
)
from synfeal.report.layouts import scene_title
from synfeal.report.meshes import read_mesh_facts
from synfeal.report.results import read_result

SCENES = ("large_room", "sanctuary")
MEAN_7_SCENES_M3 = 6.37
# What the published code renders; smaller frames are written sooner and say nothing about it.
PIXELS_OF_THE_PAPER = 640 * 480
CAMERA = "network"


def collection_rate(claim: Claim, evidence: Evidence) -> Outcome:
    """C14: every scene is collected at the published rate, at the published size of a frame."""
    rates = {scene: _rates(evidence, scene) for scene in SCENES}
    sizes = {scene: _manifest(evidence, scene)["camera"] for scene in SCENES}
    measured = ", ".join(
        f"{scene_title(scene)} {rate:.1f} frames/s at {size['width']} x {size['height']}"
        for (scene, (rate, _, _)), size in zip(rates.items(), sizes.values(), strict=True)
    )
    spans = [f"{scene_title(s)} {low:.1f} to {high:.1f}" for s, (_, low, high) in rates.items()]
    interval = f"single sequences, without planning: {', '.join(spans)}"
    if any(size["width"] * size["height"] < PIXELS_OF_THE_PAPER for size in sizes.values()):
        reason = "frames are smaller than 640 x 480, and the machine is another one"
        return Outcome(NOT_TESTABLE, measured, interval, reason)
    parts = [HOLDS if rate >= claim.numbers[0] else FAILS for rate, _, _ in rates.values()]
    return Outcome(_together(parts), measured, interval, "one machine, one measurement per job")


def kinectfusion(claim: Claim, evidence: Evidence) -> Outcome:
    """C15: cannot be tested, since the method is not among those of this run."""
    raise Missing("KinectFusion is not part of this run")


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


def _manifest(evidence: Evidence, scene: str) -> dict[str, Any]:
    path = evidence.file(f"datasets/{scene}/{CAMERA}/manifest.json")
    return read_result(path, ("camera", "sequences"), "make that data set again")


def _rates(evidence: Evidence, scene: str) -> tuple[float, float, float]:
    """Frames per second of a scene, planning included, and of its slowest and fastest sequence."""
    frames = {s["name"]: s["frames"] for s in _manifest(evidence, scene)["sequences"]}
    jobs = f"benchmarks/render/{scene}/{CAMERA}"
    seconds = {name: _seconds(evidence.file(f"{jobs}/{name}.tsv")) for name in frames}
    plans = [evidence.file(f"benchmarks/plan/{scene}/{split}.tsv") for split in ("train", "test")]
    whole = sum(seconds.values()) + sum(map(_seconds, plans))
    each = [count / seconds[name] for name, count in frames.items()]
    return sum(frames.values()) / whole, min(each), max(each)


def _seconds(path: Path) -> float:
    """Mean wall time over the rows of a Snakemake benchmark file."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            found = [float(row["s"]) for row in csv.DictReader(file, delimiter="\t")]
        return sum(found) / len(found)
    except (KeyError, ValueError, ZeroDivisionError) as error:
        raise InputError(
            f"{path}: cannot be read as a benchmark ({error!r}); run it again"
        ) from None
