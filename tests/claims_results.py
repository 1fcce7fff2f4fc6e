"""Results trees whose claims are known: errors of every cell, path by path."""

from dataclasses import dataclass, field

import numpy as np

from synfeal.config import MODELS
from synfeal.dataset.number_table import write_numbers
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.files import write_json
from synfeal.report.claims.evidence import HEADER, evidence_of
from synfeal.report.claims.table import claim_rows
from synfeal.report.published import key_of, published_cells
from tests.report_results import design_of, fill_assistance, shipped_design

N_PATHS, FRAMES_OF_PATH = 12, 3


@dataclass
class Results:
    """A results directory to be; ``errors`` maps a cell's directory to (N, 2) errors."""

    root: object
    design: tuple = field(default_factory=shipped_design)
    n_paths: int = N_PATHS

    def __post_init__(self):
        path = np.repeat(np.arange(self.n_paths), FRAMES_OF_PATH)
        poses = np.zeros((len(path), 3)), np.tile([1.0, 0, 0, 0], (len(path), 1))
        self.table = PoseTable(np.arange(len(path)), path, *poses)
        for scene, size in {(row.scene, row.size) for row in self.design}:
            labels = self.root / "labels" / scene / size / "synfeal" / "test.csv"
            write_pose_table(labels, self.table)

    def write(self, row, model, errors, errors_true=None, repetition=0):
        """Errors (N, 2), or the two values every frame has, under both scores or each its own."""
        both = [
            np.broadcast_to(e, (len(self.table), 2)) for e in (errors, errors_true) if e is not None
        ]
        columns = [self.table.frame[:, None], both[0], both[-1]]
        name = f"{row.scene}/{row.size}/{row.label_id}/{row.init}/{model}/seed{repetition}"
        rows = np.concatenate(columns, axis=1).tolist()
        write_numbers(self.root / "runs" / name / "errors.csv", HEADER, rows)

    def rows(self):
        """``claims.csv`` by claim."""
        return {
            row["id"]: row for row in claim_rows(evidence_of(design_of(self.design), self.root))
        }


def papers_results(root, **changes):
    """Every frame of a cell has the error the paper printed as the median of that cell."""
    results = Results(root, **changes)
    for row in results.design:
        for model in MODELS:
            cell = published_cells(row.table).get(key_of(row, model))
            if row.table == "table6_label_errors" and row.labels in ("synfeal", "noise"):
                continue  # the runs of other tables
            if cell is None:  # KinectFusion, say: the paper has no such row
                results.write(row, model, (1.0, 30.0))
            elif cell.flag != "misprint":
                results.write(row, model, (cell.position_m, cell.orientation_deg))
            else:
                results.write(row, model, (cell.position_m, 10.0))
    assisted = {"sfm": 3, "rgbd-toro": 6, "rgbd-g2o": 4, "kinect-fusion": 34}
    fill_assistance(root, assisted, batches=(34, 0))
    for scene, volume in (("large_room", 89.4), ("sanctuary", 183.18)):
        facts = {"vertices": 1, "faces": 1, "volume_m3": volume}
        write_json(root / "scenes" / scene / "properties.json", facts)
        write_collection(root, scene, 640, 480)
    return results


def write_collection(root, scene, width, height, seconds=(20.0, 10.0)):
    """A shard of 100 frames for each split, rendered in some seconds each, and plans of 5 s."""
    names = {"train": "seq-01", "test": "seq-02"}
    for split, name in names.items():
        camera = {"width": width, "height": height}
        record = {"camera": camera, "shards": [{"name": name, "frames": 100}]}
        write_json(root / "frames" / scene / f"{split}.json", record)
    shards = zip(names.values(), seconds, strict=True)
    times = {f"render_packed/{scene}/{name}": value for name, value in shards}
    times |= {f"plan/{scene}/{split}": 5.0 for split in names}
    for name, value in times.items():
        path = root / "benchmarks" / f"{name}.tsv"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"s\th:m:s\n{value}\t0:00:00\n")


def rows_where(results, **keys):
    """Rows of the design with some values, each data set once."""
    rows = [r for r in results.design if all(getattr(r, k) == v for k, v in keys.items())]
    return list({(r.scene, r.size, r.label_id, r.init): r for r in rows}.values())
