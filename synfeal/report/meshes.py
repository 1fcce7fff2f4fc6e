"""Table 1: the meshes of the scenes beside the paper's."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from synfeal.frames import COUNT, MAYBE, MAYBE_COUNT, NUMBER, TEXT, frame_of, write_frame
from synfeal.report.cells import MeshFacts, published_meshes
from synfeal.report.layouts import scene_title
from synfeal.report.results import read_result
from synfeal.report.sheet import PAPER, Sheet, sheet_of_texts, write_latex

NAME = "table1_meshes"
# Title, and how numbers are written.
FACTS = {
    "vertices": ("# Vertices", "{:,.0f}"),
    "faces": ("# Faces", "{:,.0f}"),
    "volume_m3": ("Volume [m³]", "{:,.2f}"),
}
SCHEMA = {
    **{"scene": TEXT, "vertices": COUNT, "faces": COUNT, "volume_m3": NUMBER},
    **{"published_vertices": MAYBE_COUNT, "published_faces": MAYBE_COUNT},
    "published_volume_m3": MAYBE,
}
REMARK = (
    "Vertices at distinct positions, as a scan file counts them: copies along texture seams count"
    " once. Volume of the axis-aligned bounding box. Lines marked paper: the meshes of the paper."
)


def write_meshes_table(scenes: Sequence[str], root: Path, out_csv: Path, out_tex: Path) -> None:
    """Write Table 1 from the properties of the scenes' meshes: a row per scene, ``SCHEMA``."""
    meshes = read_meshes(scenes, root)
    write_frame(out_csv, meshes)
    write_latex(out_tex, meshes_sheet(meshes))


def read_meshes(scenes: Sequence[str], root: Path) -> pd.DataFrame:
    """Columns ``SCHEMA`` of some scenes; what the paper has not is missing."""
    printed = {
        scene: {f"published_{fact}": value for fact, value in vars(facts).items()}
        for scene, facts in published_meshes().items()
    }
    records = [
        {"scene": scene} | vars(read_mesh_facts(root, scene)) | printed.get(scene, {})
        for scene in scenes
    ]
    return frame_of(records, SCHEMA)


def read_mesh_facts(root: Path, scene: str) -> MeshFacts:
    """Counts and volume from ``<root>/scenes/<scene>/properties.json``."""
    path = root / "scenes" / scene / "properties.json"
    facts: MeshFacts = read_result(path, FACTS, "make the scene again", MeshFacts)
    return facts


def meshes_sheet(meshes: pd.DataFrame) -> Sheet:
    """Table 1 as printed: properties down, scenes across."""
    scenes = meshes.set_index(meshes.scene.map(scene_title))
    lines = [
        {"row": fact, "kind": kind, " ": title, "  ": against}
        | {
            scene: "–" if pd.isna(value) else form.format(value)
            for scene, value in scenes[f"{start}{fact}"].items()
        }
        for fact, (label, form) in FACTS.items()
        for start, kind, title, against in (
            ("", "", label, "regenerated"),
            ("published_", PAPER, "", "paper"),
        )
    ]
    return sheet_of_texts(
        NAME, "Properties of the 3D textured meshes used.", pd.DataFrame(lines), (REMARK,)
    )
