"""Results whose claims are known: errors of every cell, path by path, and changes of them."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation
from scipy.stats import norm

from baselines.config.learning import MODELS
from reproduction.claims import evidence as reading
from reproduction.claims.evidence import evidence_of
from reproduction.claims.run import claims_of_run
from reproduction.design.experiments import SHARES
from reproduction.statistics.seeds import Borrowed
from reproduction.tables.cells import key_of, published_cells
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.records.files import write_json
from tests.support.report_results import (
    MEASURES,
    SCENES,
    design_of,
    fill_assistance,
    fill_scenes,
    shipped_design,
    write_errors,
)

N_PATHS, FRAMES_OF_PATH = 12, 3
# The paper prints root mean squares over the axes.
AXES = 3**0.5


@dataclass
class Results:
    """A results directory whose runs are written one by one; its claims, by name."""

    root: Path
    design: tuple = field(default_factory=shipped_design)
    n_paths: int = N_PATHS
    spread: tuple = (2.0, 80.0)
    more_scenes: tuple = ()

    def __post_init__(self):
        self.table = far_apart(self.n_paths, *self.spread)
        for scene, size in {(row.scene, row.size) for row in self.design}:
            for split in ("train", "test"):
                labels = self.root / "labels" / scene / size / "synfeal" / f"{split}.csv"
                write_pose_table(labels, self.table)
        for row in self.design:
            if row.estimated:  # all labels 4 cm off
                labels = self.root / "labels" / row.scene / row.size / row.labels / "train.csv"
                moved = self.table.position_m + np.array([0.0, 0.0, 0.04])
                write_pose_table(labels, replace(self.table, position_m=moved))

    def write(self, row, model, errors, errors_true=None, repetition=0):
        """Errors (N, 2), or the two values every frame has, under both scores or each its own."""
        both = (errors, errors if errors_true is None else errors_true)
        columns = [np.broadcast_to(values, (len(self.table), 2)) for values in both]
        write_errors(self.root, row, model, np.hstack(columns), repetition)

    def judged(self):
        """What the run says about the claims."""
        design = design_of(self.design, more_scenes=self.more_scenes)
        return claims_of_run(evidence_of(design, self.root))


def far_apart(n_paths, metres, degrees):
    """Poses that all lie some metres and some degrees from their mean, so a constant is no use."""
    path = np.repeat(np.arange(n_paths), FRAMES_OF_PATH)
    side = np.where(np.arange(len(path)) % 2 == 0, 1.0, -1.0)[:, None]
    turn = Rotation.from_rotvec(np.radians(degrees) * side * [0.0, 0.0, 1.0])
    quat = turn.as_quat(scalar_first=True, canonical=True)
    return PoseTable(np.arange(len(path)), path, side * [metres, 0.0, 0.0], quat)


def papers_results(root, **changes):
    """Every frame of a cell has the error the paper printed as the median of that cell; of a run
    that is shown a part of the images, as many times that as the images are fewer."""
    results = Results(root, **changes)
    printed = {row.label_id for row in results.design if row.table != "table6_label_errors"}
    for row in results.design:
        start, _, part = row.init.partition("-")
        table = row.table
        if table == "table7_images_shown":
            table = "table4_size" if start == "pretrained" else "table5_from_scratch"
        elif table == "table6_label_errors" and row.label_id in printed:
            continue  # the runs of other tables
        for model in MODELS:
            key = key_of(row.model_copy(update={"init": start}), model)
            cell = published_cells(table).get(key)
            if cell is None:  # KinectFusion, say: the paper has no such row
                errors = np.array([1.0, 30.0])
            else:
                degrees = 10.0 if cell.flag == "misprint" else cell.orientation_deg
                errors = np.array([AXES * cell.position_m, degrees])
            results.write(row, model, errors / SHARES[part])
    assisted = {"sfm": 3, "rgbd-toro": 6, "rgbd-g2o": 4, "kinect-fusion": 34}
    return measured(results, assisted, batches=(34, 0))


def measured(results, *assisted, **batches):
    """Volumes of the paper's meshes, a little over its 5 frames per second, and assistance."""
    fill_assistance(results.root, *assisted, **batches)
    fill_scenes(results.root, (89.4, 183.18))
    for scene in SCENES:
        write_speed(results.root, scene, [5.0, 5.2])
    return results


def lend(monkeypatch, relative_sd):
    """Single runs borrow this deviation over seeds."""
    lent = {(m, e): Borrowed(relative_sd, 16) for m in MODELS for e in MEASURES}
    monkeypatch.setattr(reading, "borrowed_deviations", lambda: lent)


def rows_where(results, **keys):
    """Rows of the design with some values, each data set once."""
    rows = [r for r in results.design if all(getattr(r, k) == v for k, v in keys.items())]
    return list({(r.scene, r.size, r.label_id, r.init): r for r in rows}.values())


def write_speed(root, scene, frames_per_s):
    """Speeds of collecting a scene, part by part."""
    speed = {"width": 640, "height": 480, "processor": "Abacus 9", "cores": 2}
    path = root / "scenes" / scene / "collection_speed.json"
    write_json(path, speed | {"frames_per_s": frames_per_s})


def put(keys, models, position_m, orientation_deg, true=None):
    """A change: errors of some models on the first data set with these keys.

    Positions are the paper's, root mean squares over the axes; ``true`` is in metres.
    """

    def change(results):
        errors = np.array([AXES * np.asarray(position_m), orientation_deg]).T
        for model in models:
            results.write(rows_where(results, **keys)[0], model, errors, true)

    return change


def first_paths(count, inside, outside):
    """One value on the frames of the first of twelve paths, another on the rest."""
    return np.where(np.arange(N_PATHS).repeat(FRAMES_OF_PATH) < count, inside, outside)


def assisted(g2o, kinect):
    """A change: of 17 batches so many assisted."""
    counts = {"sfm": 0, "rgbd-toro": 0, "rgbd-g2o": g2o, "kinect-fusion": kinect}
    return lambda results: fill_assistance(results.root, counts, batches=(17, 0))


def collected_at(*rates):
    """A change: frames per second in the Sanctuary; the Large Room's are 5.0 to 5.2."""
    return lambda results: write_speed(results.root, "sanctuary", list(rates))


def curves(ratio, falls=0.8):
    """A change: errors fall as a power of the images, from scratch of ``ratio`` times as many."""

    def change(results):
        for row in rows_where(results, table="table7_images_shown"):
            start, _, part = row.init.partition("-")
            images = SHARES[part] / (ratio if start == "scratch" else 1.0)
            for model in MODELS:
                results.write(row, model, np.array([0.2, 10.0]) * images**-falls)

    return change


def chance_results(root):
    """Tables 2 and 3 as 300 frames gave them: localizers about as good as the mean pose."""
    tables = ("table2_ground_truth", "table3_inconsistencies")
    design = tuple(row for row in shipped_design() if row.table in tables)
    results = Results(root, design=design, n_paths=30, spread=(1.37, 85.0))
    rng = np.random.default_rng(0)
    for cell in pd.read_csv(Path(__file__).with_name("chance_level.csv")).itertuples():
        keys = {"labels": cell.labels, "noise_m": cell.noise_m, "noise_deg": cell.noise_deg}
        errors = np.stack([_paths_with(rng, cell, m).repeat(FRAMES_OF_PATH) for m in MEASURES])
        row = rows_where(results, **keys)[0]
        results.write(row, cell.model, errors[:2].T, errors[2:].T)
    return measured(results)


def _paths_with(rng, cell, measure):
    """Errors of 30 paths whose median has about the published value and limits."""
    value, low, high = (getattr(cell, f"{measure}{end}") for end in ("", "_low", "_high"))
    quantiles = norm.ppf((np.arange(30) + 0.5) / 30)
    # The standard error of a normal median is 1.25 sd / sqrt(n).
    spread = np.log(high / low) / (2 * 1.96) * np.sqrt(30) / 1.25
    return value * np.exp(spread * rng.permutation(quantiles))
