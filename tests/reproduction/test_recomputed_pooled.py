"""Pooled effects, recomputed from the archives by code that shares nothing with ours."""

import csv
import math
from collections import defaultdict
from functools import cache

import numpy as np
import pandas as pd
import pytest
from scipy.optimize import brentq
from scipy.stats import t

from reproduction.replications.pooling import write_pooled
from tests import ROOT
from tests.support.constructed_replications import write_replication

PUBLISHED = ROOT / "results/published/replications"
MODELS = ("posenet", "poselstm", "hourglass", "posenet2resnet", "posenet2")
ERRORS = ("position_mm", "orientation_cdeg")
QUANTITIES = ("position", "orientation")
FAILED = 65535
ROOM_6K = ("large_room", "6k", "synfeal", "pretrained")


@pytest.fixture(scope="module", params=["constructed", "published"])
def pooled(request, tmp_path_factory):
    if request.param == "published":
        return PUBLISHED
    root = tmp_path_factory.mktemp("replications")
    seeds = range(101, 106)
    write_pooled([write_replication(root / str(seed), seed, spread=0.1) for seed in seeds], root)
    return root


class Errors:
    """Errors per frame of one archive."""

    def __init__(self, folder):
        table = pd.read_parquet(folder / "errors.parquet")
        for name in ERRORS:
            table[f"true_{name}"] = table[f"true_{name}"].astype(float).fillna(table[name])
            for column in (name, f"true_{name}"):
                table[column] = table[column].astype(float).replace(FAILED, math.inf)
        keys = ["model", "scene", "size", "labels", "init", "test_set"]
        self.cells = dict(iter(table.groupby(keys, observed=True)))

    def frames(self, model, row, test_set, against):
        rows = self.cells[(model, *row, test_set)]
        prefix = "true_" if against == "true" else ""
        return rows["path"].to_numpy(), rows[[f"{prefix}{name}" for name in ERRORS]].to_numpy()

    def logs(self, model, row, test_set="common", against="true"):
        return np.log(np.median(self.frames(model, row, test_set, against)[1], axis=0))

    def ratio(self, new, old, models=MODELS, **where):
        return np.mean([self.logs(m, new, **where) - self.logs(m, old, **where) for m in models], 0)


def labels(name):
    return ("large_room", "6k", name, "pretrained")


def effects(errors):
    """Logarithms of both ratios by claim, part, and what errors are against."""
    for against in ("labels", "true"):
        where = {"test_set": "own", "against": against}
        for rival in ("sfm", "rgbd-toro", "rgbd-g2o"):
            ratio = errors.ratio(ROOM_6K, labels(rival), **where)
            yield ("C1", f"exact labels, not {rival}", against), ratio
        of_one = errors.ratio(ROOM_6K, labels("sfm"), ["posenet2"], **where)
        yield ("C2", "exact labels, not sfm", against), of_one
        noise = errors.ratio(labels("noise-p0.3-r20"), ROOM_6K, **where)
        yield ("C5", "both", against), noise
        of_one = errors.ratio(ROOM_6K, labels("noise-p0.3-r20"), ["posenet2"], **where)
        yield ("C6", "no noise, not the most", against), of_one
        newer = errors.logs("posenet2", ROOM_6K, **where) - errors.logs("posenet", ROOM_6K, **where)
        yield ("C3", "newer model", against), newer
    for claim, scene, size in (("C7", "large_room", "80k"), ("C8", "sanctuary", "95k")):
        rows = ((scene, end, "synfeal", "pretrained") for end in (size, "6k"))
        yield (claim, f"{size}, not 6k", "true"), errors.ratio(*rows)
    for size in ("6k", "20k"):
        rows = (("large_room", size, "synfeal", init) for init in ("scratch", "pretrained"))
        yield ("C10", f"from scratch, {size}", "true"), errors.ratio(*rows)
    half = ("large_room", "6k", "synfeal", "pretrained-half")
    yield ("images", "twice the images", "true"), errors.ratio(ROOM_6K, half)
    ends = (("large_room", "80k"), ("large_room", "6k"), ("sanctuary", "95k"), ("sanctuary", "6k"))
    logs = {
        model: np.mean([errors.logs(model, (*end, "synfeal", "pretrained")) for end in ends], 0)
        for model in MODELS
    }
    for model in MODELS:
        yield ("networks", model, "true"), logs[model] - np.mean([*logs.values()], 0)


@cache
def archives(folder):
    return {path.parent.name: Errors(path.parent) for path in folder.glob("*/errors.parquet")}


def table(folder):
    """Rows of the table of effects by claim, part, against, quantity and replication."""
    found = defaultdict(dict)
    with (folder / "claim_effects.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            key = row["claim"], row["part"], row["against"], row["quantity"]
            found[key][row["replication"]] = row
    return found


def percent(log):
    return 100 * (math.exp(log) - 1)


def paule_mandel(values, variances):
    """Pooled value and Hartung and Knapp's limits, their variance found by bisection."""
    n = len(values)

    def excess(between):
        weights = 1 / (variances + between)
        centre = weights @ values / weights.sum()
        return weights @ (values - centre) ** 2 - (n - 1)

    between = 0.0 if excess(0) <= 0 else brentq(excess, 0, 100, xtol=1e-14)
    weights = 1 / (variances + between)
    centre = weights @ values / weights.sum()
    error = math.sqrt(weights @ (values - centre) ** 2 / (n - 1) / weights.sum())
    half = t.ppf(0.975, n - 1) * error
    return centre, centre - half, centre + half


def test_effects_of_each_replication_are_those_of_its_frames(pooled):
    rows = table(pooled)
    n_checked = 0
    for seed, errors in archives(pooled).items():
        for key, logs in effects(errors):
            for quantity, log in zip(QUANTITIES, logs, strict=True):
                told = float(rows[(*key, quantity)][seed]["value"])
                assert told == pytest.approx(percent(log), abs=0.002), (seed, key, quantity)
                n_checked += 1
    assert n_checked == 2 * 24 * len(archives(pooled))


def test_pooled_effects_and_limits_follow_from_those_of_the_replications(pooled):
    for key, by_replication in table(pooled).items():
        told = by_replication.pop("pooled")
        if told["unit"] != "percent":
            continue
        if not all(row["value"] and row["standard_error"] for row in by_replication.values()):
            assert [float(told["low"]), float(told["high"])] == [-100, math.inf], key
            continue
        values = np.log1p([float(row["value"]) / 100 for row in by_replication.values()])
        errors = np.array([float(row["standard_error"]) for row in by_replication.values()])
        expected = [*map(percent, paule_mandel(values, errors**2))]
        # Numbers of the table have six digits, and both solve one equation to 1e-5.
        found = [float(told[name]) for name in ("value", "low", "high")]
        assert found == pytest.approx(expected, abs=0.02, rel=1e-3), key


def test_standard_errors_are_those_of_a_bootstrap_over_paths(pooled):
    rows = table(pooled)
    seed, errors = next(iter(archives(pooled).items()))
    rng = np.random.default_rng(1)
    logs = []
    paths, _ = errors.frames(MODELS[0], ROOM_6K, "common", "true")
    names = np.unique(paths)
    frames_of = {name: np.flatnonzero(paths == name) for name in names}
    large = ("large_room", "80k", "synfeal", "pretrained")
    pairs = [
        [errors.frames(model, row, "common", "true")[1] for row in (large, ROOM_6K)]
        for model in MODELS
    ]
    for _ in range(300):
        drawn = np.concatenate([frames_of[name] for name in rng.choice(names, len(names))])
        changes = [
            np.log(np.median(new[drawn], 0)) - np.log(np.median(old[drawn], 0))
            for new, old in pairs
        ]
        logs.append(np.mean(changes, 0))
    for quantity, found in zip(QUANTITIES, np.std(logs, axis=0, ddof=1), strict=True):
        told = float(rows["C7", "80k, not 6k", "true", quantity][seed]["standard_error"])
        assert found == pytest.approx(told, rel=0.2), quantity
