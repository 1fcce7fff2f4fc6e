"""Checks before hours are spent: the sampling box, the merged mesh, and the files asked for."""

from pathlib import Path

import numpy as np
import pytest

from synfeal.config import check_mesh_files, load_config
from synfeal.config.load import read_yaml
from synfeal.config.models import SceneConfig
from synfeal.errors import InputError
from synfeal.mesh.checks import check_sampling_box
from tests.test_workflow import snakemake

CONFIG = Path(__file__).parents[1] / "config"


@pytest.mark.parametrize(
    ("scale", "shift", "message"),
    [(1.0, 0.0, None), (1000.0, 0.0, "1000 times"), (1.0, 50.0, "outside"), (0.001, 2, "outside")],
)
def test_sampling_box_must_fit_the_mesh(scale, shift, message):
    bounds = np.array([[-1.0, -1, -1], [1, 1, 1]]) * scale + shift
    box = np.array([[-1.0, -1, -1], [1, 1, 1]])
    if message is None:
        check_sampling_box(box, bounds, "scenes.room")
        return
    with pytest.raises(InputError, match=message) as caught:
        check_sampling_box(box, bounds, "scenes.room")
    assert "unit_m" in str(caught.value)


def test_the_first_missing_mesh_is_named(tmp_path):
    (tmp_path / "here.glb").write_bytes(b"anything")
    scenes = {
        "stand_in": SceneConfig(source="procedural", builder="sanctuary"),
        "present": SceneConfig(source="mesh", path=tmp_path / "here.glb"),
    }
    check_mesh_files(scenes)
    scenes["absent"] = SceneConfig(source="mesh", path=tmp_path / "gone.glb")
    with pytest.raises(InputError) as caught:
        check_mesh_files(scenes)
    message = str(caught.value)
    assert all(w in message for w in ("scenes.absent.path", "gone.glb", "config/scenes/README.md"))


@pytest.mark.parametrize("scene", ["large_room", "sanctuary"])
def test_scene_fragments_are_complete_configurations(scene):
    config = load_config(CONFIG / "config.yaml", CONFIG / "scenes" / f"{scene}.yaml")
    assert config.scenes[scene].source == "mesh"
    assert config.scenes[scene].min_view_distance_m == 1.2
    others = set(config.scenes) - {scene}
    assert {config.scenes[other].source for other in others} == {"procedural"}
    # Results of another mesh must not end up among those of the stand-ins.
    assert config.profile != read_yaml(CONFIG / "config.yaml")["profile"]
    assert (CONFIG / "scenes" / "README.md").is_file()


@pytest.mark.skipif((CONFIG.parent / "meshes/large_room.glb").exists(), reason="mesh is here")
def test_snakemake_stops_in_one_line_when_the_mesh_is_absent():
    run = snakemake("--dry-run", "--configfile", "config/scenes/large_room.yaml", "--", "all")
    assert run.returncode == 1
    errors = [line for line in run.stderr.splitlines() if line.startswith("error:")]
    assert len(errors) == 1
    for word in ("scenes.large_room.path", "meshes/large_room.glb", "config/scenes/README.md"):
        assert word in errors[0]
    assert "Traceback" not in run.stderr
