"""Sections 4 and 4.3: scenes and speed; none of it depends on a localizer's score."""

from __future__ import annotations

from pydantic import BaseModel, Field

from synfeal.report.claims.evidence import Evidence
from synfeal.report.claims.model import HOLDS, MIXED, OPPOSITE, UNDECIDED, Claim, Outcome, Verdict
from synfeal.report.layouts import scene_title
from synfeal.report.meshes import read_mesh_facts
from synfeal.report.results import read_result

SCENES = ("large_room", "sanctuary")
MEAN_7_SCENES_M3 = 6.37


class _Speed(BaseModel):
    width: int
    height: int
    frames_per_s: list[float] = Field(min_length=1)
    processor: str
    cores: int


def collection_rate(claim: Claim, evidence: Evidence) -> Outcome:
    """C14: every scene is collected at the published rate: 640 x 480 as PNG, with poses."""
    verdicts, measured, spans, machines = [], [], [], []
    for scene in SCENES:
        evidence.need(scene=scene)
        path = evidence.file(f"scenes/{scene}/collection_speed.json")
        speed: _Speed = read_result(path, (), "measure it again", _Speed)
        low, high = min(speed.frames_per_s), max(speed.frames_per_s)
        verdicts.append(_compared(low, high, claim.numbers[0]))
        mean = len(speed.frames_per_s) / sum(1 / rate for rate in speed.frames_per_s)
        measured.append(f"{scene_title(scene)} {mean:.1f} frames/s")
        spans.append(f"{scene_title(scene)} {low:.1f} to {high:.1f}")
        machines.append(f"{speed.processor}, {speed.cores} usable cores")
    verdict = verdicts[0] if len(set(verdicts)) == 1 else MIXED
    reason = f"on {', '.join(dict.fromkeys(machines))}; the paper's laptop is not named"
    return Outcome(
        verdict, ", ".join(measured), f"slowest to fastest part: {', '.join(spans)}", reason
    )


def times_7_scenes(claim: Claim, evidence: Evidence) -> Outcome:
    """C16: both volumes, over the mean of the 7-Scenes and rounded, are the published numbers."""
    ratios = []
    for scene in SCENES:
        evidence.need(scene=scene)
        evidence.file(f"scenes/{scene}/properties.json")
        ratios.append(read_mesh_facts(evidence.root, scene).volume_m3 / MEAN_7_SCENES_M3)
    alike = [round(r) == n for r, n in zip(ratios, claim.numbers, strict=True)]
    names = map(scene_title, SCENES)
    measured = ", ".join(f"{name} {r:.2f}" for name, r in zip(names, ratios, strict=True))
    verdict: Verdict = HOLDS if all(alike) else MIXED if any(alike) else OPPOSITE
    return Outcome(verdict, measured, "", "volumes are exact")


def _compared(low: float, high: float, published: float) -> Verdict:
    return HOLDS if low >= published else OPPOSITE if high < published else UNDECIDED
