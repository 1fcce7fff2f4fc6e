"""Table 1: the meshes of the scenes beside the paper's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from reproduction.runs.results import read_result
from reproduction.tables.cells import FOLDER
from reproduction.tables.columns import Column, SideLayout
from reproduction.tables.layouts import scene_title
from reproduction.tables.side import SideTable, Source, Table
from synfeal.records.tables import (
    COUNT,
    MAYBE,
    MAYBE_COUNT,
    NUMBER,
    TEXT,
    frame_of,
    read_frame,
    records_of,
)

NAME = "table1_meshes"
# Title, and how numbers are written.
FACTS = {
    "vertices": ("# Vertices", "{:,.0f}"),
    "faces": ("# Faces", "{:,.0f}"),
    "volume_m3": ("Volume [m³]", "{:,.2f}"),
}
SCHEMA = {
    "scene": TEXT,
    "vertices": COUNT,
    "faces": COUNT,
    "volume_m3": NUMBER,
    "published_vertices": MAYBE_COUNT,
    "published_faces": MAYBE_COUNT,
    "published_volume_m3": MAYBE,
}
CAPTION = "Properties of the 3D textured meshes used."
REMARK = (
    "Vertices at distinct positions, as a scan file counts them: copies along texture seams count"
    " once. Volume of the axis-aligned bounding box. In grey: the meshes of the paper."
)


@dataclass(frozen=True)
class MeshFacts:
    """Properties of a scene's mesh: counts, and the volume of its bounding box in cubic metres."""

    vertices: int
    faces: int
    volume_m3: float


def read_meshes(scenes: Sequence[str], root: Path) -> pd.DataFrame:
    """Read columns ``SCHEMA`` of some scenes; what the paper lacks is missing."""
    own = pd.DataFrame([{"scene": s} | vars(read_mesh_facts(root, s)) for s in scenes])
    published = read_frame(
        FOLDER / f"{NAME}.csv", {name: SCHEMA[name] for name in ("scene", *FACTS)}
    )
    printed = published.rename(columns={fact: f"published_{fact}" for fact in FACTS})
    return frame_of(records_of(own.merge(printed, how="left", on="scene")), SCHEMA)


def read_mesh_facts(root: Path, scene: str) -> MeshFacts:
    """Read counts and volume from ``<root>/scenes/<scene>/properties.json``."""
    path = root / "scenes" / scene / "properties.json"
    facts: MeshFacts = read_result(path, FACTS, "make the scene again", MeshFacts)
    return facts


def side_layout(meshes: pd.DataFrame) -> SideLayout:
    """Lay out Table 1 as the paper prints it: properties down, scenes across."""
    columns = [Column("Property", "fact")]
    rows = pd.DataFrame({"fact": [title for title, _ in FACTS.values()]})
    for mesh in records_of(meshes):
        scene, printed = mesh["scene"], f"published_{mesh['scene']}"
        columns.append(Column(scene_title(scene), scene, text=scene, paper=printed))
        for name, start in {scene: "", printed: "published_"}.items():
            values = [(mesh[f"{start}{fact}"], form) for fact, (_, form) in FACTS.items()]
            rows[name] = [None if pd.isna(value) else form.format(value) for value, form in values]
    return SideLayout(NAME, CAPTION, columns, rows, REMARK)


@SideTable(
    name="table1_meshes",
    title="Table 1",
    rank=10,
    needs=("scenes/{scene}/properties.json",),
    in_document=True,
    in_summary=True,
)
class MeshesTable(Table):
    """Table 1: a row per scene."""

    schema = SCHEMA
    layout = staticmethod(side_layout)

    def rows(self, source: Source) -> pd.DataFrame:
        """Read the properties of the scenes' meshes."""
        return read_meshes(source.scenes, source.root)
