"""Agreement of rankings by labels with rankings by the truth, and down to which threshold.

A benchmark is asked which of several methods is better. Its labels answer rightly where they rank
the methods as the true poses would, so **the same predictions are scored by two yardsticks**: the
test labels, and the truth. Any other comparison would mix in what labels do to the methods: the
ranking of methods trained on exact labels against the truth, say, differs from that of methods
trained on noisy labels because they *are* others.

Which predictions matters, and there are two answers:

- *these labels*: methods that learn from the training labels of the same set, as in any benchmark
  whose labels come from one source. What its training and test labels share, a bend of space or
  drift along a path, is learnt, and then rewarded.
- *exact labels*: methods that learn from the true poses, the same predictions for every label set.
  What is left is the yardstick alone.

Scores are shares of frames within a threshold (t cm and t degrees) and medians; several runs of a
localizer count as one method, by the mean of their scores.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from baselines.config.references import ReferencesConfig
from baselines.training.score import read_predictions
from reproduction.design.experiments import Design
from reproduction.design.ranking import Ranking, rankings
from reproduction.statistics.ranking import agreement
from reproduction.tables.columns import NOTHING, Column, SideLayout
from reproduction.tables.layouts import data_set_titles, label_title
from reproduction.tables.side import SideTable, Source, Table
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.errors import InputError
from synfeal.evaluation.bootstrap import Array, Counts, mean_of, medians
from synfeal.evaluation.metrics import ORIENTATION, POSITION, Bound, draws, pose_errors, within
from synfeal.records.tables import (
    COUNT,
    MAYBE,
    TEXT,
    frame_of,
    read_frame,
    records_of,
)

NAME = "label_ranking"
# Scores by name: shares of frames within a bound, and medians.
THRESHOLDS = {f"within_{cm}cm_{cm}deg": Bound(cm / 100, cm) for cm in (1, 2, 5, 10, 25, 50)}
MEDIANS = {POSITION: "Median, m", ORIENTATION: "Median, °"}
TITLES = {name: bound.title for name, bound in THRESHOLDS.items()} | MEDIANS
KEYS = ("scene", "size", "labels", "trained_on", "score")
SCHEMA = {
    **dict.fromkeys(KEYS, TEXT),
    **dict.fromkeys(("tau", "tau_low", "tau_high"), MAYBE),
    **dict.fromkeys(("methods", "pairs", "swapped", "tied", "reversed", "paths"), COUNT),
    "ranked": TEXT,
}
# A threshold ranks rightly where the lower limit of tau is no less: without ties, three of four
# pairs are ordered as by the truth.
RIGHTLY = 0.5
TRAINED_ON = {"labels": "these labels", "exact": "exact labels"}
CAPTION = (
    "Which labels rank methods rightly, and down to which threshold: rank correlation (Kendall's"
    " tau-b, with 95 % limits over test paths) of all localizers and reference methods scored"
    " against the labels of the test set with the same predictions scored against the truth, by"
    " share of frames within a threshold, and by median error; this table is not in the paper."
)
REMARK = (
    "1: the same ranking; 0: none in common; –: the truth tells no two methods apart. Trained on"
    " these labels: methods learn from the same source as the test labels, as in any benchmark, so"
    " that what both share is rewarded. Trained on exact labels: one set of predictions for all"
    " label sets, so that only the yardstick differs. Ranked are methods that see images (neither"
    " the mean pose nor the oracle) and answer for every label set. Reversed: pairs of methods that"
    " labels and truth order oppositely, both in at least 97.5 % of resamples; over all scores."
    " Rightly from: the least threshold from which on the lower limit is 0.5 or more."
)
LINES = ["data_set", "labels", "trained_on", "methods"]


def label_ranking_table(design: Design, references: ReferencesConfig, root: Path) -> pd.DataFrame:
    """Tabulate which labels rank methods as the truth does.

    Args:
        design: The profile's table of experiments.
        references: Reference methods that are ranked beside the localizers.
        root: Results of the profile.

    Returns:
        Columns ``SCHEMA``: a row per label set, origin of the predictions and score.
    """
    return frame_of(
        [record for ranking in rankings(design, references) for record in ranked(ranking, root)],
        SCHEMA,
    )


def ranked(ranking: Ranking, root: Path) -> list[dict[str, Any]]:
    """Compute a row per score, of one label set and one origin of the predictions."""
    scene, size, labels = ranking.data_set
    folder = root / "labels" / scene / size
    label_table = read_pose_table(folder / labels / "test.csv")
    truth = read_pose_table(folder / "synfeal" / "test.csv")
    place, counts = draws(truth.path)
    predictions = [
        [_read(root / run / "predictions.csv", truth) for run in runs]
        for runs in ranking.folders.values()
    ]
    same: dict[str, Any] = dict(
        zip(KEYS, (*ranking.data_set, ranking.trained_on), strict=False),
        methods=len(predictions),
        paths=counts.shape[1],
        ranked=" ".join(ranking.folders),
    )
    against, true = (
        [[pose_errors(run, reference) for run in runs] for runs in predictions]
        for reference in (label_table, truth)
    )
    records = []
    for score in TITLES:
        scores, true_scores = (
            np.column_stack([sample_of(runs, score, place, counts) for runs in errors])
            for errors in (against, true)
        )
        found = agreement(scores, true_scores)
        records.append(same | {"score": score} | found._asdict())
    return records


def sample_of(
    runs: Sequence[Mapping[str, Array]], score: str, place: NDArray[np.intp], counts: Counts
) -> Array:
    """Score a method in each resample of the test paths.

    Args:
        runs: Errors of each of its runs, by measure (N,).
        score: A key of :data:`TITLES`.
        place: Path of each frame (N,).
        counts: How often each path is taken (B, P).

    Returns:
        Scores (B,): the share of frames of all runs, or the mean of the medians of the runs.
    """
    if score in MEDIANS:
        return mean_of([medians(errors[score], place, counts) for errors in runs])
    inside = [within(errors, THRESHOLDS[score]) for errors in runs]
    n_paths = counts.shape[1]
    hits = np.bincount(np.concatenate([place[mask] for mask in inside]), minlength=n_paths)
    frames = np.bincount(place, minlength=n_paths)
    # Whole numbers are divided once, so that equal shares are equal however many runs there are.
    return np.asarray(counts @ hits / (counts @ frames * len(runs)), dtype=np.float64)


def side_layout(table: pd.DataFrame) -> SideLayout:
    """Lay out a row for each label set and origin of the predictions, a column per score."""
    cells = table.assign(
        data_set=data_set_titles(table),
        labels=table.labels.map(label_title),
        trained_on=table.trained_on.map(TRAINED_ON),
        limits=[_limits(row) for row in records_of(table)],
    )
    lines = cells.groupby(LINES, sort=False)
    reversed_pairs = lines.reversed.sum()
    rightly = pd.Series({line: rightly_from(own) for line, own in lines}, name="rightly")
    wide = cells.pivot(index=LINES, columns="score", values=["tau", "limits"])
    wide = wide.reindex(reversed_pairs.index)
    limits = wide["limits"].add_suffix("_limits")
    rows = reversed_pairs.to_frame().assign(rightly=rightly.to_numpy())
    rows = rows.join([wide["tau"], limits]).reset_index()
    columns = [
        Column("Data set", "data_set"),
        Column("Labels", "labels"),
        Column("Trained on", "trained_on"),
        Column("Methods", "methods", "{:.0f}"),
        Column("Rightly, from", "rightly"),
        *(
            Column(title, name, "{:.2f}", small=f"{name}_limits")
            for name, title in TITLES.items()
            if name in wide["tau"]
        ),
        Column("Reversed, pairs", "reversed", "{:.0f}"),
    ]
    return SideLayout(NAME, CAPTION, columns, rows, REMARK, block="data_set")


def rightly_from(rows: pd.DataFrame) -> str:
    """Name the least threshold from which on all thresholds rank rightly.

    Args:
        rows: Rows of the table, of one label set and one origin of the predictions.

    Returns:
        The threshold as printed; a dash where even the largest does not.
    """
    low = rows.set_index("score").tau_low.where(rows.set_index("score").tau.notna())
    found = NOTHING
    for name, bound in reversed(THRESHOLDS.items()):
        if not low.get(name, np.nan) >= RIGHTLY:
            break
        found = bound.title
    return found


def _limits(row: Mapping[str, Any]) -> str:
    return "" if pd.isna(row["tau"]) else f"{row['tau_low']:.2f} to {row['tau_high']:.2f}"


def read_label_ranking(path: Path) -> pd.DataFrame:
    """Read the table that the rule ``side_table`` wrote."""
    return read_frame(path, SCHEMA)


def _read(path: Path, truth: PoseTable) -> PoseTable:
    predicted = read_predictions(path)
    if not np.array_equal(predicted.frame, truth.frame):
        raise InputError(path, "its frames are not those of the test set", "predict again")
    return predicted


@SideTable(
    name="label_ranking",
    title="Label ranking",
    rank=70,
    needs=("{ranked}/predictions.csv", "labels/{ranking_set}/test.csv"),
    settings=("references",),
    in_document=True,
)
class LabelRankingTable(Table):
    """Ranking of methods by labels, beside that by the truth."""

    schema = SCHEMA
    layout = staticmethod(side_layout)

    def rows(self, source: Source) -> pd.DataFrame:
        """Rank the methods by all labels."""
        settings = ReferencesConfig.model_validate(source.settings["references"])
        return label_ranking_table(source.design, settings, source.root)
