"""Archives of replications whose effects are known by construction."""

import numpy as np
import pandas as pd

from reproduction.claims.effects import BOTH, MOVED, OWN, PAPERS_FIVE, TURNED
from reproduction.claims.evidence import COMMON, Cell
from reproduction.replications.archive import (
    ASSISTANCE,
    ERRORS,
    FAILED,
    KEYS,
    LABEL_ERROR,
    UNITS,
    write_errors,
)
from reproduction.tables.label_error import SCHEMA as LABEL_ERROR_SCHEMA

N_FRAMES, N_PATHS = 240, 40
# Factors on an error of 4 m and 50°, by what a cell is trained with.
FACTORS = {
    "sfm": (1.5, 1.5),
    "rgbd-toro": (1.2, 1.2),
    "rgbd-g2o": (1.2, 1.2),
    TURNED: (1.02, 1.8),
    MOVED: (1.8, 1.02),
    BOTH: (3.0, 5.0),
}
SIZES = {"6k": 1.0, "20k": 0.8, "80k": 0.5, "95k": 0.28}
SCRATCH = {"6k": 1.5, "20k": 1.3, "80k": 0.9}
# Of networks; the newer model is exactly as good as the older one.
NETWORKS = dict(zip(PAPERS_FIVE, (1.0, 1.1, 1.25, 1.05, 1.0), strict=True))
LABELS_OFF_M = {"sfm": 0.01, "rgbd-toro": 0.02, "rgbd-g2o": 0.02, "kinect-fusion": 0.04}
SHARES = {"": 1.0, "-half": 2**0.5, "-quarter": 2.0}  # error as images to the power of -1/2


def cells():
    """Every cell of a replication: itself, its test set, and the factors on both errors."""
    for model in PAPERS_FIVE:
        yield Cell(model), OWN, (1.0, 1.0)
        for labels, factors in FACTORS.items():
            yield Cell(model, labels=labels), OWN, factors
        for size in ("6k", "95k"):
            yield Cell(model, "sanctuary", size), COMMON, (SIZES[size],) * 2
        for size in ("6k", "20k", "80k"):
            # PoseNet2 from scratch is the best of all at 80k.
            best = 0.8 if (model, size) == ("posenet2", "80k") else 1.0
            yield Cell(model, size=size), COMMON, (SIZES[size],) * 2
            scratch = SIZES[size] * SCRATCH[size] * best
            yield Cell(model, size=size, init="scratch"), COMMON, (scratch,) * 2
        for end, factor in SHARES.items():
            if end:
                yield Cell(model, init=f"pretrained{end}"), COMMON, (factor,) * 2
                yield Cell(model, init=f"scratch{end}"), COMMON, (1.5 * factor,) * 2


def write_replication(folder, seed, spread=0.0, networks=NETWORKS):
    """Write an archive.

    Args:
        folder: Where to.
        seed: Draws how difficult its frames are.
        spread: Of the logarithms of factors that each cell, and each of its frames, has of its
            own; without it, ratios of cells are the same in all replications.
        networks: Factors on the errors of the networks, by name.
    """
    rng = np.random.default_rng(seed)
    path = np.repeat(np.arange(N_PATHS), N_FRAMES // N_PATHS)
    # The same frames are difficult for every cell: ratios are known without any noise.
    difficulty = {s: rng.lognormal(0, 0.5, (2, N_FRAMES)) for s in (OWN, COMMON)}
    rows = []
    for cell, test_set, factors in cells():
        row = {key: getattr(cell, key, test_set) for key in KEYS}
        frame = pd.DataFrame(row, index=range(N_FRAMES))
        frame["frame"], frame["path"] = np.arange(N_FRAMES), path
        sizes = (4000, 5000)
        for unit, size, factor, hard in zip(
            UNITS, sizes, factors, difficulty[test_set], strict=True
        ):
            own = np.exp(spread * (rng.normal() + rng.normal(size=N_FRAMES)))
            errors = size * factor * networks[cell.model] * hard * own
            frame[unit] = frame[f"true_{unit}"] = np.minimum(errors, FAILED).round()
        rows.append(frame)
    folder.mkdir(parents=True)
    write_errors(pd.concat(rows, ignore_index=True), folder / ERRORS)
    batches = {"sfm": 2, "rgbd-toro": 1, "rgbd-g2o": 0, "kinect-fusion": 3}
    assistance = [
        {"method": method, "split": split, "assisted": count, "batches": 34}
        for method, count in batches.items()
        for split in ("train", "total")
    ]
    pd.DataFrame(assistance).to_csv(folder / ASSISTANCE, index=False)
    errors = [
        dict.fromkeys(LABEL_ERROR_SCHEMA, 0)
        | {"scene": "large_room", "size": "6k", "method": method, "split": split}
        | {"assistance": state, "position_m_median": off_m * seed / 102}
        | {"orientation_deg_median": 0.5, "position_m_rmse": 10 * off_m * (seed == 102)}
        for method, off_m in LABELS_OFF_M.items()
        for split in ("train", "test")
        for state in ("before", "after")
    ]
    pd.DataFrame(errors).to_csv(folder / LABEL_ERROR, index=False)
    return folder
