"""A results directory with everything the page shows, small and with known numbers."""

import shutil

import numpy as np
import trimesh
from PIL import Image

from reproduction.claims.evidence import QUANTITIES
from reproduction.claims.label_shapes import NAME, SCHEMA
from reproduction.claims.tables import PERCENT, THIS_RUN, write_claims
from reproduction.claims.verdicts import Verdict
from reproduction.design.shapes import SHAPES
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.save import save_glb
from synfeal.records.tables import frame_of
from tests.support.report_results import (
    CONFIG,
    METHODS_RUN,
    complete_results,
    shipped_design,
)

RED = (220, 20, 20)
PLANS = {"train": [[1.0, 1.0, 1.0], [3.0, 1.0, 1.0]], "test": [[1.0, 2.0, 1.0], [3.0, 2.0, 1.5]]}
# Of C2 by score: both of its effects with limits, percent, and the verdict.
CLAIM = {"labels": ((-41.5, -50.0, -9.0), "holds"), "true": ((-33.5, -44.0, 3.0), "undecided")}
UNTESTED = "no row <40k>"
PUBLISHED = CONFIG.parent / "results/published/mini"
SIDE_TABLES = ("speed_vs_error", "recall", "assistance", "label_error", "references")


def large_room_design():
    """The rows of the shipped design that need one scene alone."""
    return [row for row in shipped_design() if row.scene == "large_room"]


def page_results(root):
    """Known scores and claims, two figures, one scene; other tables as a run published them."""
    complete_results(root)
    write_known_claims(root)
    write_shape_changes(root)
    for name in SIDE_TABLES:
        shutil.copy(PUBLISHED / "tables" / f"{name}.csv", root / "tables")
    shutil.copy(PUBLISHED / "provenance.json", root)
    write_scene(root)
    write_figures(root / "figures")
    return root


def write_known_claims(root):
    """The verdict on C2 by either score, and C15 that the run could not test."""
    same = {"claim": "C2", "part": "exact labels, not sfm", "replication": THIS_RUN}
    rows, verdicts = [], {}
    for against, (numbers, verdict) in CLAIM.items():
        ends = dict(zip(("value", "low", "high"), numbers, strict=True))
        for quantity in ("position", "orientation"):
            row = {**same, "quantity": quantity, "against": against, **ends, "printed": -55.0}
            rows.append(row | {"unit": PERCENT})
        verdicts["C2", against] = Verdict(verdict)
    verdicts["C15", ""] = Verdict.NOT_TESTABLE
    write_claims(root, rows, verdicts, 1, {("C15", ""): UNTESTED, ("C2", "true"): "stays <short>"})


def write_shape_changes(root):
    """What label errors of each shape change; those that bend space do the most harm."""
    rows = [
        {"change": shape, "error": error, "percent": 10 * harm}
        | {"percent_low": 10 * harm - 4, "percent_high": 10 * harm + 4}
        for harm, shape in enumerate(SHAPES, start=1)
        for error in QUANTITIES
    ]
    frame_of(rows, SCHEMA).to_csv(root / "tables" / f"{NAME}.csv", index=False)


def write_scene(root):
    """A red box to look into from above, and one straight path per split."""
    box = trimesh.creation.box((4.0, 3.0, 2.0))
    colors = np.tile(np.array(RED, np.uint8), (8, 1))
    vertices_m = np.asarray(box.vertices) + np.array([2.0, 1.5, 1.0])
    part = MeshPart("room", vertices_m, np.asarray(box.faces)[:, ::-1], vertex_rgb=colors)
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
