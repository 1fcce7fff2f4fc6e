"""Table 1: the meshes of the scenes beside the paper's."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from synfeal.frames import (
    COUNT,
    MAYBE,
    MAYBE_COUNT,
    NUMBER,
    TEXT,
    frame_of,
    records_of,
    write_frame,
)
from synfeal.report.cells import MeshFacts, published_meshes
from synfeal.report.columns import Column, SideTable, write_side_latex
from synfeal.report.layouts import scene_title
from synfeal.report.results import read_result

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
CAPTION = "Properties of the 3D textured meshes used."
REMARK = (
    "Vertices at distinct positions, as a scan file counts them: copies along texture seams count"
    " once. Volume of the axis-aligned bounding box. In grey: the meshes of the paper."
)


def write_meshes_table(scenes: Sequence[str], root: Path, out_csv: Path, out_tex: Path) -> None:
    """Write Table 1 from the properties of the scenes' meshes: a row per scene, ``SCHEMA``."""
    meshes = read_meshes(scenes, root)
    write_frame(out_csv, meshes)
    write_side_latex(out_tex, side_table(meshes))


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


def side_table(meshes: pd.DataFrame) -> SideTable:
    """Table 1 as the paper prints it: properties down, scenes across."""
    columns = [Column("Property", "fact")]
    rows = pd.DataFrame({"fact": [title for title, _ in FACTS.values()]})
    for mesh in records_of(meshes):
        scene, printed = mesh["scene"], f"published_{mesh['scene']}"
        columns.append(Column(scene_title(scene), scene, text=scene, paper=printed))
        for name, start in {scene: "", printed: "published_"}.items():
            values = [(mesh[f"{start}{fact}"], form) for fact, (_, form) in FACTS.items()]
            rows[name] = [None if pd.isna(value) else form.format(value) for value, form in values]
    return SideTable(NAME, CAPTION, columns, rows, REMARK)
