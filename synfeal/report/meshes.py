"""Table 1: the meshes of the scenes beside the paper's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from pydantic import TypeAdapter

from synfeal.report.grid import Entry, Grid, Group, Line, Value
from synfeal.report.latex import write_latex
from synfeal.report.layouts import scene_title
from synfeal.report.published import MeshFacts, published_meshes
from synfeal.report.results import check_result, read_result
from synfeal.report.tables import write_rows

NAME = "table1_meshes"
_SHAPE = TypeAdapter(MeshFacts)
FACTS = ("vertices", "faces", "volume_m3")
COLUMNS = ("scene", *FACTS, *(f"published_{fact}" for fact in FACTS))
LABELS = {"vertices": "# Vertices", "faces": "# Faces", "volume_m3": "Volume [m³]"}
REMARK = (
    "Vertices at distinct positions, as a scan file counts them: copies along texture seams count"
    " once. Volume of the axis-aligned bounding box. Lines marked paper: the meshes of the paper."
)


def write_meshes_table(scenes: Sequence[str], root: Path, out_csv: Path, out_tex: Path) -> None:
    """Write Table 1 from the properties of the scenes' meshes.

    Args:
        scenes: the scenes of the tables, in order.
        root: results directory of the profile, where ``scenes`` is.
        out_csv: one row per scene.
        out_tex: a table environment.

    Raises:
        InputError: a scene's properties are missing or unreadable.
    """
    meshes = {scene: read_mesh_facts(root, scene) for scene in scenes}
    write_rows(out_csv, COLUMNS, [_record(scene, facts) for scene, facts in meshes.items()])
    write_latex(out_tex, meshes_grid(meshes))


def read_mesh_facts(root: Path, scene: str) -> MeshFacts:
    """Counts and volume from ``<root>/scenes/<scene>/properties.json``."""
    path = root / "scenes" / scene / "properties.json"
    remedy = "make the scene again"
    values = read_result(path, FACTS, remedy)
    facts = {fact: values[fact] for fact in FACTS}
    check_result(path, facts, _SHAPE, remedy)
    return MeshFacts(**facts)


def meshes_grid(meshes: Mapping[str, MeshFacts]) -> Grid:
    """Table 1 as printed: properties down, scenes across."""
    titles = [scene_title(scene) for scene in meshes]
    caption = "Properties of the 3D textured meshes used."
    rows = tuple(_rows(meshes, fact) for fact in FACTS)
    return Grid(NAME, caption, ("", "", *titles), (Group("", rows),), (REMARK,))


def _record(scene: str, facts: MeshFacts) -> dict[str, str | int | float | None]:
    published = published_meshes().get(scene)
    record: dict[str, str | int | float | None] = {"scene": scene}
    for fact in FACTS:
        record[fact] = getattr(facts, fact)
        record[f"published_{fact}"] = getattr(published, fact) if published else None
    return record


def _rows(meshes: Mapping[str, MeshFacts], fact: str) -> tuple[Line, ...]:
    own = tuple(_entry(facts, fact) for facts in meshes.values())
    printed = tuple(_entry(published_meshes().get(scene), fact) for scene in meshes)
    return (
        Line("labels", LABELS[fact], "regenerated", own),
        Line("paper", "", "paper", printed),
    )


def _entry(facts: MeshFacts | None, fact: str) -> Entry:
    if facts is None:
        return Entry((Value("–"),))
    number = getattr(facts, fact)
    return Entry((Value(f"{number:.2f}" if fact == "volume_m3" else f"{number:,}"),))
