"""`python -m benchmarks.collecting`: the plain loop draws the frames that we draw."""

import numpy as np
import pandas as pd
import pytest

from benchmarks import collecting
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.geometry.rotations import quat_wxyz_from_matrix
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.save import save_glb
from tests.support.small_room import furnished_room, room_poses

pytestmark = pytest.mark.slow


@pytest.fixture
def results(tmp_path):
    """A scene and a plan, as a run leaves them."""
    poses = room_poses(3, seed=2)
    index = np.arange(len(poses))
    rotations = quat_wxyz_from_matrix(poses[:, :3, :3])
    plan = PoseTable(index, index, poses[:, :3, 3], rotations)
    for folder in ("scenes", "plans"):
        (tmp_path / folder / "room").mkdir(parents=True)
    # Without the ball and the plant: pyrender does not know that vertex colours are linear, nor
    # what a texture cuts out of surfaces.
    painted = TexturedMesh(furnished_room((8.0,)).parts[:-2])
    save_glb(tmp_path / "scenes/room/mesh.glb", painted)
    write_pose_table(tmp_path / "plans/room/test.csv", plan)
    return tmp_path


@pytest.mark.parametrize("packed", [[], ["--packed", "40"]])
def test_a_plain_loop_draws_the_same_frames(packed, results):
    out = results / "collecting.csv"
    options = [
        "room",
        "--results",
        str(results),
        "--size",
        "96x72",
        "--frames",
        "3",
        "--rounds",
        "1",
    ]
    assert collecting.main([*options, *packed, "--out", str(out)]) == 0
    rows = pd.read_csv(out).set_index("way")
    assert (rows[["cpu_s", "wall_s", "drawing_cpu_ms"]] > 0).all(axis=None)
    assert (rows.frames == 3).all()
    # With as many samples the images differ by how textures are filtered, by less than without.
    assert rows.levels_from_ours[collecting.OURS] == 0.0
    assert rows.levels_from_ours[collecting.SAME] < 3.0
    assert rows.levels_from_ours[collecting.SAME] < rows.levels_from_ours[collecting.EDGES]
