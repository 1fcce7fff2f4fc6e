"""Several realisations of one label set: what the same method's labels changed in each run.

All training runs of a profile share one set of SfM's labels, so that their limits do not cover what
another set of labels would have changed. Runs with different seeds have different frames, and so
labels that were estimated anew. This module puts them side by side.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pandas as pd

from reproduction.report.findings import paired_changes, read_table, sfm_training_labels
from reproduction.report.fresh import SEEN_SEED
from reproduction.report.intervals import Interval, percent
from reproduction.report.published_claims import published_runs, read_published
from reproduction.tables.sheet import markdown_table
from synfeal.records.tables import rows_of

# C2 compares PoseNet2 on these labels with PoseNet2 on exact ones.
CLAIM, METHOD, MODEL = "C2", "sfm", "posenet2"
# Training frames of the paper's smallest set; smaller profiles have wider gaps between frames.
PAPER_FRAMES = 6000


class Realisation(NamedTuple):
    """SfM's labels of one run, and what exact labels in their place change.

    Attributes:
        profile: Name of the run.
        seed: Seed of its frames.
        n_runs: Training runs of PoseNet2 per label set.
        position_m: Median position error of the labels, metres.
        position_rmse_m: Root mean square of it, metres.
        changes: Factors on PoseNet2's position and orientation error against the truth.
    """

    profile: str
    seed: str
    n_runs: int
    position_m: float
    position_rmse_m: float
    changes: tuple[Interval, Interval]


def realisations(published: Path) -> list[Realisation]:
    """Collect the published runs that compare SfM's labels of the paper's frames with exact ones.

    Args:
        published: Folder of the published runs.
    """
    found = (realisation(root) for root in published_runs(published))
    return [own for own in found if own is not None]


def realisation(root: Path) -> Realisation | None:
    """Describe SfM's labels of a run; None where it has none of the paper's frames."""
    changes = paired_changes(root, CLAIM)
    if changes is None:
        return None
    labels = sfm_training_labels(root)
    if labels is None or labels[1].frames != PAPER_FRAMES:
        return None
    _, errors = labels
    cells = read_table(root, "table2_ground_truth")
    (trained,) = rows_of(cells[(cells.labels == METHOD) & (cells.model == MODEL)])
    return Realisation(
        profile=root.name,
        seed=read_published(root)[0].get("seed") or SEEN_SEED,
        n_runs=trained.n_seeds,
        position_m=errors.position_m_median,
        position_rmse_m=errors.position_m_rmse,
        changes=changes,
    )


def realisations_table(published: Path) -> str:
    """Tabulate the realisations as Markdown; a sentence where none is published."""
    rows = [
        {
            "run": f"`{own.profile}` (seed {own.seed})",
            "SfM's labels: median; RMSE": f"{100 * own.position_m:.1f} cm;"
            f" {100 * own.position_rmse_m:.1f} cm",
            "training runs": own.n_runs,
            "position error": percent(own.changes[0]),
            "orientation error": percent(own.changes[1]),
        }
        for own in realisations(published)
    ]
    return markdown_table(pd.DataFrame(rows)) if rows else "No such run has been published yet."
