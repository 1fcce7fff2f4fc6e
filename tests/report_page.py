"""A results directory with everything the page shows, small and with known numbers."""

import json

import numpy as np
import trimesh
from PIL import Image

from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.files import write_json
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.save import save_glb
from synfeal.report import references
from synfeal.report.assistance import LAST_POSE
from synfeal.report.claims.table import COLUMNS
from synfeal.report.label_error import SCHEMA as LABEL_ERROR_SCHEMA
from synfeal.report.recall import COLUMNS as RECALL_COLUMNS
from synfeal.report.speed_vs_error import SCHEMA as SPEEDS
from tests.report_results import METHODS_RUN, complete_results, shipped_design, write_rows

RED = (220, 20, 20)
PLANS = {"train": [[1.0, 1.0, 1.0], [3.0, 1.0, 1.0]], "test": [[1.0, 2.0, 1.0], [3.0, 2.0, 1.5]]}
CLAIM = {
    **{"id": "C2", "section": "4.1", "statement": "A <b>& c", "published": "p -55 %"},
    **{"measured_labels": "p -41.5 %", "measured_true": "p -33.5 %"},
    **{"interval_labels": "p -50.0 % to -9.0 %", "interval_true": "p -44.0 % to +3.0 %"},
    **{"test": "by a rule", "verdict_labels": "holds", "verdict_true": "undecided"},
    **{
        "reason": "labels: reaches it; true: stays short",
        "footnote": "",
        "evidence": "a.csv;b.csv",
    },
}
UNTESTED = CLAIM | dict.fromkeys(("verdict_labels", "verdict_true"), "not testable here")
UNTESTED |= {"id": "C15", "statement": "Another.", "reason": "no row 40k", "evidence": ""}
SPEED = dict.fromkeys(SPEEDS, "") | {
    **{"stage": "collision", "scene": "large_room", "variant": "full", "faces": 4321},
    **{"seconds_per_item": 1e-6, "items_per_s": 1e6, "error": 0.125, "error_unit": "share"},
    "chosen": 1,
}
ASSISTED = {
    **{"scene": "large_room", "size": "6k", "method": "sfm", "split": "total", "batches": 17},
    **{"assisted": 5, "lost": 2, "frames": 425, "registered": 90, "filled": 6},
    **dict.fromkeys(LAST_POSE, 0.5),
    **{"last_m_before_median": 0.375, "last_deg_before_median": 3.5},
    **{"published_assisted": 3, "published_batches": 34},
}
LABEL_ERROR = {
    **dict.fromkeys(LABEL_ERROR_SCHEMA, 0.25),
    **{"scene": "large_room", "size": "6k", "method": "sfm", "split": "total"},
    **{"assistance": "after", "frames": 425, "position_m_median": 0.0375},
    **{"relative_25_m_per_m": "", "relative_25_deg_per_m": ""},
}
HARD_CASE = {
    **{"family": "angles", "case": "at 0", "quantity": "angle", "unit": "rad", "naive": "arccos"},
    **{"ours": "angle_of", "naive_error": 3e-8, "our_error": 1e-17, "bound": 1e-15, "ok": 1},
    **{"reference": "mpmath", "naive_seconds": 1e-6, "our_seconds": 4e-5},
}


REFERENCE = {
    **dict.fromkeys(references.SCHEMA, 0.0),
    **{"scene": "large_room", "size": "6k", "labels": "sfm", "method": "nearest-vlad"},
    **{"title": "Nearest image, DenseVLAD", "kind": "reference", "position_m": 0.75},
}
RECALL = {
    **{"scene": "large_room", "size": "6k", "labels": "synfeal", "init": "pretrained"},
    **{"model": "posenet", "n_seeds": 1},
    **dict.fromkeys(RECALL_COLUMNS, 0.375),
}


def large_room_design():
    """The rows of the shipped design that need one scene alone."""
    return [row for row in shipped_design() if row.scene == "large_room"]


def page_results(root):
    """Scores of every run, tables, claims, figures, one scene, provenance."""
    complete_results(root)
    write_rows(root / "claims.csv", COLUMNS, [CLAIM, UNTESTED])
    write_rows(root / "tables" / "speed_vs_error.csv", [*SPEED], [SPEED])
    write_rows(root / "tables" / "recall.csv", [*RECALL], [RECALL])
    write_rows(root / "tables" / "assistance.csv", [*ASSISTED], [ASSISTED])
    write_rows(root / "tables" / "label_error.csv", [*LABEL_ERROR], [LABEL_ERROR])
    write_rows(root / "tables" / "references.csv", references.SCHEMA, [REFERENCE])
    write_rows(root / "tables" / "hard_cases.csv", [*HARD_CASE], [HARD_CASE])
    write_scene(root)
    write_figures(root / "figures")
    write_json(root / "provenance.json", PROVENANCE)
    return root


def write_scene(root):
    """A red box to look into from above, and one straight path per split."""
    box = trimesh.creation.box((4.0, 3.0, 2.0))
    colours = np.tile(np.array(RED, np.uint8), (8, 1))
    vertices_m = np.asarray(box.vertices) + np.array([2.0, 1.5, 1.0])
    part = MeshPart("room", vertices_m, np.asarray(box.faces)[:, ::-1], vertex_rgb=colours)
    save_glb(root / "scenes" / "large_room" / "mesh.glb", TexturedMesh((part,)))
    for split, ends_m in PLANS.items():
        write_pose_table(root / "plans" / "large_room" / f"{split}.csv", straight(ends_m))
        for method in METHODS_RUN:
            path = root / "labels" / "large_room" / "6k" / method / f"{split}.csv"
            write_pose_table(path, straight(np.array(ends_m) + 0.25))


def straight(ends_m, path=0):
    """A pose table of one path between two points (2, 3)."""
    position_m = np.array(ends_m)
    quat = np.tile([1.0, 0.0, 0.0, 0.0], (len(position_m), 1))
    return PoseTable(np.arange(len(quat)), np.full(len(quat), path), position_m, quat)


def write_figures(folder):
    """One figure with a caption of the project, one without."""
    folder.mkdir()
    svg = '<svg xmlns="http://www.w3.org/2000/svg" width="40" height="20"><path d="M0 0H9"/></svg>'
    (folder / "error_by_size.svg").write_text(svg)
    Image.new("RGB", (40, 20)).save(folder / "error_by_size.png")
    Image.new("RGB", (30, 30), (9, 9, 9)).save(folder / "of_my_own.png")


def edit_json(path, **changes):
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


PROVENANCE = {
    **{"commit": "0123abcd-dirty", "config_sha256": "feed" * 16, "seed": 3, "python": "3.11.9"},
    **{"packages": {"numpy": "2.2.2"}, "platform": "Linux-x", "cpus": 4},
    "time_utc": "2030-01-02T03:04:05+00:00",
    "machine": {"processor": "Abacus 9", "usable_cores": 2, "memory_gib": 7.5, "gpu": None},
    "stages": [
        {"stage": "train", "jobs": 4, "seconds": 40.0, "median_seconds": 9.5, "peak_mb": 512.25},
        {"stage": "score", "jobs": 2, "seconds": 2.0, "median_seconds": 1.0, "peak_mb": None},
    ],
}
