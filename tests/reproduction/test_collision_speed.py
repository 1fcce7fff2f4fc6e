"""Speeds of collision meshes in the table of speeds: what else the machine did is taken out."""

from dataclasses import replace

import pytest

from reproduction.figures.registry import write_figures
from reproduction.tables.speed_vs_error import speeds_of
from synfeal.collection.collision import (
    Rung,
    write_curve,
)
from synfeal.errors import InputError
from synfeal.records.tables import write_frame
from tests.support.report_results import design_of, read

RUNG = Rung(100, 1.0, 0.99, 1.0, 0, 0, 1, 1, 0.0)


def test_the_table_rids_speeds_of_what_else_the_machine_did(tmp_path):
    # The second pair was measured while the machine did half its work elsewhere.
    full = replace(RUNG, faces=4000, rays_per_s=100, full_rays_per_s=100)
    slow = replace(RUNG, faces=800, agreement=0.998, rays_per_s=75, full_rays_per_s=50, chosen=1)
    few = replace(RUNG, agreement=0.9, rays_per_s=200, full_rays_per_s=100)
    write_curve(tmp_path / "scenes" / "large_room" / "collision_curve.csv", [full, slow, few])
    table = tmp_path / "tables" / "speed_vs_error.csv"
    write_frame(table, speeds_of("collision", ["large_room"], tmp_path))
    rows = read(table)
    assert [row["variant"] for row in rows] == ["full", "decimated", "decimated"]
    assert [float(row["items_per_s"]) for row in rows] == [100.0, 150.0, 200.0]
    assert [float(row["error"]) for row in rows] == pytest.approx([0.0, 0.002, 0.1])
    assert [row["chosen"] for row in rows] == ["0", "1", "0"]
    assert {(row["stage"], row["scene"]) for row in rows} == {("collision", "large_room")}
    write_figures(design_of(()), tmp_path, tmp_path / "figures")
    drawn = {path.name for path in (tmp_path / "figures").iterdir()}
    assert drawn == {f"speed_vs_error_collision.{end}" for end in ("png", "svg")}
    with pytest.raises(InputError, match=r"sanctuary/collision_curve\.csv"):
        speeds_of("collision", ["sanctuary"], tmp_path)
