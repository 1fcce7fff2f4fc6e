"""Methods that are ranked by label sets, and where their predictions lie."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

from baselines.config.learning import MODELS
from baselines.config.references import ReferencesConfig
from baselines.labels.methods import SIMULATOR
from reproduction.design.experiments import Design
from reproduction.design.references import DataSet, answered_by, data_sets

TrainedOn = Literal["labels", "exact"]
# Reads the true poses of the test frames, so nobody could enter it in a benchmark.
ORACLE = "nearest-pose"


class Ranking(NamedTuple):
    """Predictions of all methods that one label set ranks."""

    data_set: DataSet  # whose test labels are the yardstick
    # What the methods learn or build their maps from: this label set, or the true poses.
    trained_on: TrainedOn
    folders: dict[str, list[str]]  # by method, those of its runs, below the results


def rankings(design: Design, references: ReferencesConfig) -> list[Ranking]:
    """List what is ranked: methods that see images, by each label set that is not exact.

    Which methods answer may differ between label sets. Of those that learn from the set itself,
    ranked are the ones that answer for every such set of a scene and size: an additional method may
    be easy or hard to rank, and label sets could not be compared.
    """
    found = []
    sets = ranked_sets(design)
    for size in dict.fromkeys(key[:2] for key in sets):
        inexact = [key for key in sets if key[:2] == size]
        folders = {key: _folders(design, references, key) for key in inexact}
        shared = _in_all([*folders.values()])
        exact = _folders(design, references, (*size, SIMULATOR))
        for key, methods in folders.items():
            found.append(Ranking(key, "labels", {name: methods[name] for name in shared}))
            if exact:
                found.append(Ranking(key, "exact", exact))
    return found


def ranked_sets(design: Design) -> list[DataSet]:
    """List the data sets whose labels rank methods: inexact ones, with localizers trained on."""
    return [
        key for key in data_sets(design.rows) if key[2] != SIMULATOR and _localizers(design, key)
    ]


def _localizers(design: Design, key: DataSet) -> dict[str, list[str]]:
    """List the runs' folders of all localizers that start pretrained; none without such runs."""
    rows = [row for row in design.rows if (row.scene, row.size, row.label_id) == key]
    runs = {model: design.runs_of(row.pretrained, model) for row in rows[:1] for model in MODELS}
    return {
        model: [f"runs/{run.directory}" for run in of_model]
        for model, of_model in runs.items()
        if of_model
    }


def _folders(design: Design, references: ReferencesConfig, key: DataSet) -> dict[str, list[str]]:
    """List the folders of all methods on a data set; none where no localizer is trained on it."""
    localizers = _localizers(design, key)
    if not localizers:
        return {}
    answered = [name for name in answered_by(design.rows, key, references) if name != ORACLE]
    return localizers | {name: [f"references/{'/'.join(key)}/{name}"] for name in answered}


def _in_all(sets: Sequence[dict[str, list[str]]]) -> list[str]:
    """List the names that all of the mappings have, in the order of the first."""
    return [name for name in (sets[0] if sets else {}) if all(name in one for one in sets)]
