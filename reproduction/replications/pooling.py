"""Tables of the pooled replications: ``claim_effects.csv`` and ``claims.csv``."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from reproduction.claims.verdicts import Verdict
from reproduction.replications.effects import (
    NETWORKS,
    RIVALS,
    Against,
    Archive,
    Effect,
    effects_of,
    printed_effects,
)
from reproduction.replications.judge import (
    Part,
    Shares,
    judge,
    judge_best,
    judge_few,
    judge_many,
    odds_of,
    percent,
    pooled_odds,
    share,
)
from reproduction.statistics.pooled import pool
from synfeal.errors import InputError
from synfeal.evaluation.bootstrap import limits
from synfeal.records.tables import write_frame

EFFECTS, CLAIMS = "claim_effects.csv", "claims.csv"
COLUMNS = (
    "claim",
    "part",
    "quantity",
    "against",
    "replication",
    "value",
    "low",
    "high",
    "printed",
    "standard_error",
    "unit",
)
POOLED = "pooled"
KINECT_FUSION = "kinect-fusion"
# Section 4.1 counts assisted batches; its images make 34 batches of a room.
PRINTED_ASSISTED = {"sfm": 3, "rgbd-toro": 6, "rgbd-g2o": 4}
PRINTED_BATCHES = 34
Rows = list[Mapping[str, object]]


def write_pooled(folders: Sequence[Path], out: Path) -> None:
    """Pool archived replications.

    Args:
        folders: Archives, named by their seeds.
        out: Directory to write both tables into. Changes are in percent, shares of batches are
            shares; ``standard_error`` is that of the logarithm, of a ratio or of odds.

    Raises:
        InputError: there are fewer than two archives.
    """
    if len(folders) < 2:
        raise InputError(f"{len(folders)} archives of replications", "two are the least to pool")
    archives = {folder.name: Archive(folder) for folder in folders}
    rows: Rows = []
    verdicts: dict[tuple[str, str], Verdict] = {}
    for key, effects in _by_key(archives).items():
        part = _part(key, effects)
        rows += _effect_rows(key, part, dict(zip(archives, effects, strict=True)))
    for (claim, against), parts in _by_claim(archives).items():
        if claim != NETWORKS:
            verdicts[claim, against] = judge_best(parts) if claim == "C12" else judge(parts)
    counts = {
        method: odds_of(
            [tuple(a.assistance.loc[method, ["assisted", "batches"]]) for a in archives.values()]
        )
        for method in (*RIVALS, KINECT_FUSION)
    }
    for method, shares in counts.items():
        rows += _share_rows(method, shares, list(archives))
    verdicts["C4", ""] = judge_few({method: counts[method] for method in RIVALS})
    verdicts["C15", ""] = judge_many(counts[KINECT_FUSION])
    out.mkdir(parents=True, exist_ok=True)
    write_frame(out / EFFECTS, pd.DataFrame(rows, columns=list(COLUMNS)), "%.6g")
    judged = [
        {"claim": claim, "against": against, "verdict": verdict, "replications": len(archives)}
        for (claim, against), verdict in sorted(
            verdicts.items(), key=lambda item: (int(item[0][0][1:]), item[0][1])
        )
    ]
    write_frame(out / CLAIMS, pd.DataFrame(judged))


Key = tuple[str, str, str, Against]


def _by_key(archives: dict[str, Archive]) -> dict[Key, list[Effect]]:
    """Gather each effect over the replications, in their order."""
    found: dict[Key, list[Effect]] = {}
    for archive in archives.values():
        for effect in effects_of(archive):
            found.setdefault(effect[:4], []).append(effect)
    return found


def _by_claim(archives: dict[str, Archive]) -> dict[tuple[str, str], list[Part]]:
    """Gather the parts of each claim under each score."""
    found: dict[tuple[str, str], list[Part]] = {}
    for key, effects in _by_key(archives).items():
        found.setdefault((key[0], key[3]), []).append(_part(key, effects))
    return found


def _part(key: Key, effects: Sequence[Effect]) -> Part:
    first = effects[0]
    return Part(
        name=f"{key[1]}, {key[2]}",
        asked=first.asked,
        sign=first.sign,
        values=tuple(float(effect.sample[0]) for effect in effects),
        variances=tuple(float(np.var(effect.sample[1:], ddof=1)) for effect in effects),
        printed=printed_effects().get(key, math.nan),
    )


def _effect_rows(
    key: Key, part: Part, by_seed: dict[str, Effect]
) -> Iterator[Mapping[str, object]]:
    same = dict(zip(COLUMNS, key, strict=False)) | {"printed": percent(part.printed)}
    same |= {"unit": "percent"}
    for (seed, effect), variance in zip(by_seed.items(), part.variances, strict=True):
        value, ends = effect.sample[0], limits(effect.sample)
        numbers = map(percent, (float(value), *ends))
        yield same | {
            "replication": seed,
            **dict(zip(("value", "low", "high"), numbers, strict=True)),
            "standard_error": math.sqrt(variance),
        }
    pooled = pool(part.values, part.variances)
    numbers = map(percent, pooled[:3])
    yield same | {
        "replication": POOLED,
        **dict(zip(("value", "low", "high"), numbers, strict=True)),
    }


def _share_rows(
    method: str, shares: Shares, seeds: Sequence[str]
) -> Iterator[Mapping[str, object]]:
    claim = "C15" if method == KINECT_FUSION else "C4"
    assisted = PRINTED_ASSISTED.get(method)
    printed = math.nan if assisted is None else assisted / PRINTED_BATCHES
    same: dict[str, object] = {"claim": claim, "part": method, "quantity": "batches assisted"}
    same |= {"against": "", "printed": printed, "unit": "share"}
    for seed, value, variance in zip(seeds, *shares, strict=True):
        yield same | {
            "replication": seed,
            "value": 1 / (1 + math.exp(-value)),
            "standard_error": math.sqrt(variance),
        }
    numbers = share(pooled_odds(shares))
    yield same | {
        "replication": POOLED,
        **dict(zip(("value", "low", "high"), numbers, strict=True)),
    }
