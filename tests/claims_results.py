"""Results trees whose claims are known: errors of every cell, path by path."""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from synfeal.config import MODELS
from synfeal.config.experiments import SHARES
from synfeal.dataset.number_table import write_numbers
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.files import write_json
from synfeal.geometry.rotations import canonical_quat_wxyz
from synfeal.report.claims.evidence import evidence_of
from synfeal.report.claims.table import claim_rows
from synfeal.report.published import key_of, published_cells
from synfeal.report.stats import COLUMNS, COMMON_COLUMNS
from tests.report_results import design_of, fill_assistance, shipped_design

N_PATHS, FRAMES_OF_PATH = 12, 3
# The paper prints root mean squares over the axes.
AXES = 3**0.5


@dataclass
class Results:
    """A results directory to be; ``errors`` maps a cell's directory to (N, 2) errors."""

    root: object
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

    def write(self, row, model, errors, errors_true=None, repetition=0):
        """Errors (N, 2), or the two values every frame has, under both scores or each its own."""
        both = [
            np.broadcast_to(e, (len(self.table), 2)) for e in (errors, errors_true) if e is not None
        ]
        columns = [self.table.frame[:, None], both[0], both[-1]]
        name = f"{row.scene}/{row.size}/{row.label_id}/{row.init}/{model}/seed{repetition}"
        rows = np.concatenate(columns, axis=1)
        folder = self.root / "runs" / name
        write_numbers(folder / "errors.csv", ",".join(COLUMNS), rows.tolist())
        common = rows[:, [0, 3, 4]].tolist()  # all sizes have the same test frames here
        write_numbers(folder / "common_errors.csv", ",".join(COMMON_COLUMNS), common)

    def rows(self):
        """``claims.csv`` by claim."""
        design = design_of(self.design, more_scenes=self.more_scenes)
        return {row["id"]: row for row in claim_rows(evidence_of(design, self.root))}


def far_apart(n_paths, metres, degrees):
    """Poses that all lie some metres and some degrees from their mean, so a constant is no use."""
    path = np.repeat(np.arange(n_paths), FRAMES_OF_PATH)
    side = np.where(np.arange(len(path)) % 2 == 0, 1.0, -1.0)
    position_m = side[:, None] * [metres, 0.0, 0.0]
    turn = np.radians(degrees) * side[:, None] * [0.0, 0.0, 1.0]
    quat = canonical_quat_wxyz(Rotation.from_rotvec(turn).as_quat(scalar_first=True))
    return PoseTable(np.arange(len(path)), path, position_m, quat)


def write_part(results, row, model):
    """Errors of a run that is shown a part of the images, as many times as large as these are few;
    those of one that is shown all are the paper's."""
    start, _, part = row.init.partition("-")
    table = "table4_size" if start == "pretrained" else "table5_from_scratch"
    cell = published_cells(table)[key_of(row.model_copy(update={"init": start}), model)]
    errors = np.array([AXES * cell.position_m, cell.orientation_deg]) / SHARES[part]
    results.write(row, model, errors)


def write_lengths(results, ratio, exponent=0.8):
    """Errors that fall as a power of the images shown, from scratch ``ratio`` times as many."""
    for row in rows_where(results, table="table7_images_shown"):
        start, _, part = row.init.partition("-")
        images = SHARES[part] / (ratio if start == "scratch" else 1.0)
        for model in MODELS:
            results.write(row, model, np.array([0.2, 10.0]) * images**-exponent)


def papers_results(root, **changes):
    """Every frame of a cell has the error the paper printed as the median of that cell."""
    results = Results(root, **changes)
    for row in results.design:
        for model in MODELS:
            cell = published_cells(row.table).get(key_of(row, model))
            if row.table == "table7_images_shown":
                write_part(results, row, model)
                continue
            if row.table == "table6_label_errors" and row.labels in ("synfeal", "noise"):
                continue  # the runs of other tables
            if cell is None:  # KinectFusion, say: the paper has no such row
                results.write(row, model, (1.0, 30.0))
            elif cell.flag != "misprint":
                results.write(row, model, (AXES * cell.position_m, cell.orientation_deg))
            else:
                results.write(row, model, (AXES * cell.position_m, 10.0))
    assisted = {"sfm": 3, "rgbd-toro": 6, "rgbd-g2o": 4, "kinect-fusion": 34}
    fill_assistance(root, assisted, batches=(34, 0))
    write_scenes(root)
    return results


def write_scenes(root):
    """Volumes of the paper's meshes, and a little over its 5 frames per second."""
    for scene, volume in (("large_room", 89.4), ("sanctuary", 183.18)):
        facts = {"vertices": 1, "faces": 1, "volume_m3": volume}
        write_json(root / "scenes" / scene / "properties.json", facts)
        write_speed(root, scene, [5.0, 5.2])


def write_speed(root, scene, frames_per_s):
    """How fast a scene was collected, part by part."""
    speed = {"width": 640, "height": 480, "frames_per_s": frames_per_s}
    write_json(
        root / "scenes" / scene / "collection_speed.json",
        speed | {"processor": "Abacus 9", "cores": 2},
    )


def rows_where(results, **keys):
    """Rows of the design with some values, each data set once."""
    rows = [r for r in results.design if all(getattr(r, k) == v for k, v in keys.items())]
    return list({(r.scene, r.size, r.label_id, r.init): r for r in rows}.values())
