"""Tables of the pooled replications: effects and verdicts, errors of networks and of labels."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from reproduction.claims.effects import (
    DESCRIBED,
    OWN,
    RIVALS,
    Against,
    Effect,
    effects_of,
)
from reproduction.claims.judge import (
    Condition,
    Limits,
    condition_of,
    judge_claim,
    judge_few,
    judge_many,
    percent,
)
from reproduction.claims.levels import (
    CELL_ERRORS,
    CELLS_SCHEMA,
    LABEL_ERRORS,
    LABELS_SCHEMA,
    RMSE,
    UNITS,
    limits_columns,
)
from reproduction.claims.run import KINECT_FUSION, NOT_JUDGED
from reproduction.claims.tables import PERCENT, POOLED, SHARE, Keys, Row, write_claims
from reproduction.claims.verdicts import Verdict
from reproduction.replications.archive import UNITS as ARCHIVED_UNITS
from reproduction.replications.archive import Archive
from reproduction.statistics.pooled import Pooled, pool
from reproduction.tables.assistance import PUBLISHED_ASSISTED, PUBLISHED_BATCHES
from synfeal.errors import InputError
from synfeal.evaluation.bootstrap import Array, limits
from synfeal.records.tables import frame_of, write_frame

Key = tuple[str, str, str, Against]
# What replications cannot decide, and why.
NOT_POOLED = NOT_JUDGED | {
    "C14": (Verdict.NOT_TESTABLE, "replications share their machines with other programs")
}
SCALES = tuple(ARCHIVED_UNITS.values())  # archived units in a metre and in a degree


class Part(NamedTuple):
    """One effect of a claim in every replication.

    Attributes:
        values: Logarithms of ratios, one of each replication.
        variances: Their squared standard errors within the replication.
    """

    values: tuple[float, ...]
    variances: tuple[float, ...]

    def limits(self, comparisons: int = 1) -> tuple[float, float]:
        """Return the pooled limits, at the level corrected for ``comparisons``."""
        pooled = pool(self.values, self.variances, comparisons)
        return pooled.low, pooled.high


class Shares(NamedTuple):
    """Logarithms of odds, one of each replication, with their variances."""

    values: tuple[float, ...]
    variances: tuple[float, ...]


def write_pooled(folders: Sequence[Path], out: Path) -> None:
    """Pool archived replications.

    Args:
        folders: Archives, named by their seeds.
        out: Directory to write the tables into. Changes are in percent, shares of batches are
            shares; ``standard_error`` is that of the logarithm, of a ratio or of odds.

    Raises:
        InputError: there are fewer than two archives.
    """
    if len(folders) < 2:
        raise InputError(f"{len(folders)} archives of replications", "two are the least to pool")
    archives = {folder.name: Archive(folder) for folder in folders}
    seeds = list(archives)
    rows: list[Row] = []
    by_claim = defaultdict[Keys, dict[str, list[Condition]]](dict)
    for key, effects in _by_key(archives).items():
        part = _part(effects)
        condition = condition_of(effects[0], part.limits)
        rows += _effect_rows(key, part, condition.printed, dict(zip(seeds, effects, strict=True)))
        by_claim[key[0], key[3]].setdefault(effects[0].part, []).append(condition)
    verdicts: dict[Keys, Verdict] = {
        keys: judge_claim(keys[0], parts)
        for keys, parts in by_claim.items()
        if keys[0] not in DESCRIBED
    }
    counts = {
        method: {seed: archive.batches_of(method) for seed, archive in archives.items()}
        for method in (*RIVALS, KINECT_FUSION)
    }
    shares = {method: odds_of(list(by_seed.values())) for method, by_seed in counts.items()}
    for method, by_seed in counts.items():
        rows += _share_rows(method, by_seed, shares[method])
    verdicts["C4", ""] = judge_few({method: limits_of(shares[method]) for method in RIVALS})
    verdicts["C15", ""] = judge_many(limits_of(shares[KINECT_FUSION]))
    out.mkdir(parents=True, exist_ok=True)
    reasons = {(claim, ""): reason for claim, (_, reason) in NOT_POOLED.items()}
    verdicts |= {(claim, ""): verdict for claim, (verdict, _) in NOT_POOLED.items()}
    write_claims(out, rows, verdicts, len(archives), reasons)
    sources = list(archives.values())
    write_frame(out / CELL_ERRORS, frame_of(_cell_rows(sources), CELLS_SCHEMA), "%.6g")
    write_frame(out / LABEL_ERRORS, frame_of(_label_rows(sources), LABELS_SCHEMA), "%.6g")


def _cell_rows(archives: Sequence[Archive]) -> Iterator[Row]:
    """Yield the median errors of each cell, pooled as logarithms."""
    for cell, test_set in archives[0].cells:
        scores: tuple[Against, ...] = ("labels", "true") if test_set == OWN else ("true",)
        for against in scores:
            samples = [archive.log_errors(cell, test_set, against) for archive in archives]
            row: dict[str, object] = {**cell._asdict(), "test_set": test_set, "against": against}
            quantities = zip(UNITS, SCALES, zip(*samples, strict=True), strict=True)
            for unit, scale, of_error in quantities:
                pooled = pool([s[0] for s in of_error], [_variance(s) for s in of_error])
                row |= limits_columns(unit, *map(float, np.exp(pooled[:3]) / scale))
            yield row | {"replications": len(archives)}


def _label_rows(archives: Sequence[Archive]) -> Iterator[Row]:
    """Yield how far off the training labels of each method are, pooled as logarithms."""
    tables = [archive.label_errors for archive in archives]
    for method in tables[0].index:
        row: dict[str, object] = {"method": method}
        for unit in UNITS:
            logs = [math.log(table.loc[method, f"{unit}_median"]) for table in tables]
            pooled = pool(logs, [0.0] * len(logs))  # all labels of a replication are counted
            row |= limits_columns(unit, *map(float, np.exp(pooled[:3])))
        squares = [table.loc[method, "position_m_rmse"] ** 2 for table in tables]
        yield row | {RMSE: math.sqrt(np.mean(squares)), "replications": len(archives)}


def _by_key(archives: Mapping[str, Archive]) -> dict[Key, list[Effect]]:
    """Gather each effect over the replications, in their order."""
    found: dict[Key, list[Effect]] = {}
    for archive in archives.values():
        for effect in effects_of(archive):
            found.setdefault(effect[:4], []).append(effect)
    return found


def _part(effects: Sequence[Effect]) -> Part:
    return Part(
        values=tuple(float(effect.sample[0]) for effect in effects),
        variances=tuple(_variance(effect.sample) for effect in effects),
    )


def _variance(sample: Array) -> float:
    """Return the squared standard error of what was observed; none where a resample failed."""
    with np.errstate(invalid="ignore"):
        return float(np.var(sample[1:], ddof=1))


def _effect_rows(
    key: Key, part: Part, printed: float, by_seed: Mapping[str, Effect]
) -> Iterator[Row]:
    same: dict[str, object] = dict(zip(("claim", "part", "quantity", "against"), key, strict=True))
    same |= {"printed": percent(printed), "unit": PERCENT}
    for (seed, effect), variance in zip(by_seed.items(), part.variances, strict=True):
        numbers = map(percent, (float(effect.sample[0]), *limits(effect.sample)))
        yield {
            **same,
            "replication": seed,
            **dict(zip(("value", "low", "high"), numbers, strict=True)),
            "standard_error": math.sqrt(variance),
        }
    pooled = pool(*part)
    numbers = map(percent, pooled[:3])
    yield {
        **same,
        "replication": POOLED,
        **dict(zip(("value", "low", "high"), numbers, strict=True)),
    }


def odds_of(counts: Sequence[tuple[int, int]]) -> Shares:
    """Return the logarithm of the odds of each count, half a case added on either side.

    Args:
        counts: Assisted batches, and all batches, of each replication.
    """
    pairs = [(some + 0.5, total - some + 0.5) for some, total in counts]
    return Shares(tuple(math.log(a / b) for a, b in pairs), tuple(1 / a + 1 / b for a, b in pairs))


def pooled_odds(shares: Shares, comparisons: int = 1) -> Pooled:
    """Pool logarithms of odds; see :func:`~reproduction.statistics.pooled.pool`."""
    return pool(shares.values, shares.variances, comparisons, counted=True)


def share(pooled: Pooled) -> tuple[float, float, float]:
    """Return a pooled share with its limits, from its logarithm of odds."""
    value, low, high = (float(1 / (1 + np.exp(-x))) for x in pooled[:3])
    return value, low, high


def limits_of(shares: Shares) -> Limits:
    """Return the pooled limits of a share, by the number of shares it is one of."""

    def limits_at(comparisons: int) -> tuple[float, float]:
        return share(pooled_odds(shares, comparisons))[1:]

    return limits_at


def _share_rows(
    method: str, counts: Mapping[str, tuple[int, int]], shares: Shares
) -> Iterator[Row]:
    """Yield the shares of assisted batches by replication, and their pooled one."""
    assisted = PUBLISHED_ASSISTED.get(method)
    same: dict[str, object] = {
        "claim": "C15" if method == KINECT_FUSION else "C4",
        "part": method,
        "quantity": "batches assisted",
        "against": "",
        "printed": math.nan if assisted is None else assisted / PUBLISHED_BATCHES,
        "unit": SHARE,
    }
    for (seed, (some, total)), variance in zip(counts.items(), shares.variances, strict=True):
        yield {
            **same,
            "replication": seed,
            "value": some / total,
            "standard_error": math.sqrt(variance),
        }
    numbers = share(pooled_odds(shares))
    yield {
        **same,
        "replication": POOLED,
        **dict(zip(("value", "low", "high"), numbers, strict=True)),
    }
