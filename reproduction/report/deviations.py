"""Spread of training runs over seeds, from published tables with several of them.

A profile with one training run per cell borrows these deviations where a verdict is given.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from baselines.config.learning import MODELS
from reproduction.design.experiments import FROM_SCRATCH
from reproduction.statistics.limits import MEASURES
from reproduction.statistics.seeds import BORROWED_SCHEMA
from reproduction.tables.cells import schema_of
from synfeal.records.tables import frame_of, read_frame

TABLES = (
    "table2_ground_truth",
    "table3_inconsistencies",
    "table4_size",
    "table5_from_scratch",
    "table7_images_shown",
)


def seed_deviations(root: Path) -> pd.DataFrame:
    """Pool the relative variances over seeds of all cells that have several.

    Args:
        root: Published results with several training runs per cell, as ``results/published/night``.

    Returns:
        Columns ``model``, ``measure``, ``relative_sd``, ``cells`` and ``degrees_of_freedom``. A
        cell that stands in several tables counts once. Cells that differ in labels or in images
        shown alone drew the same random numbers, and share their degrees of freedom.
    """
    found = []
    for table in TABLES:
        cells = read_frame(root / "tables" / f"{table}.csv", schema_of(table, repeated=True))
        start = FROM_SCRATCH if table == FROM_SCRATCH else cells.get("init", "pretrained")
        scratch = pd.Series(start, index=cells.index).str.contains("scratch")
        scene = cells.get("scene", "large_room")
        found.append(cells.assign(scene=scene, scratch=scratch))
    cells = pd.concat(found, ignore_index=True)
    cells = cells[cells.n_seeds > 1].drop_duplicates(["model", *MEASURES])
    records = []
    for model in MODELS:
        own = cells[cells.model == model]
        drawn = own.drop_duplicates(["scene", "n_train", "scratch"])
        for measure in MEASURES:
            variances = (own[f"{measure}_sd"] / own[measure]) ** 2
            records.append(
                {
                    "model": model,
                    "measure": measure,
                    "relative_sd": float(np.sqrt(np.average(variances, weights=own.n_seeds - 1))),
                    "cells": len(own),
                    "degrees_of_freedom": int((drawn.n_seeds - 1).sum()),
                }
            )
    return frame_of(records, BORROWED_SCHEMA)
