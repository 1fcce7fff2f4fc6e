"""Meshes of different origin: inspect, the command it prints, validate; nobody helps."""

import contextlib
import json
import shlex

import numpy as np
import pytest

from synfeal.cli import main
from synfeal.config.models import Angles, CameraConfig
from synfeal.dataset.pose_table import read_pose_table
from synfeal.mesh.load import load_mesh
from synfeal.mesh.rays import RayCaster
from synfeal.planning.path import poses_of
from synfeal.planning.seen_surface import empty_shares
from synfeal.planning.space import pose_bounds, sample_poses
from tests.varied_meshes import MESHES

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning:OpenGL.*")

# What is said last counts: the printed command with fewer, smaller frames, farther apart.
SMALLER = ["--frames", "40", "--spacing", "0.25", "--width", "96", "--height", "72"]


def explained_by_holes(mesh, n_paths):
    """Share of empty pixels of cameras anywhere in the room that look anywhere.

    With three standard errors of a set of that many paths, the frames of each being alike.
    """
    loaded = load_mesh(mesh.path, mesh.up_axis, mesh.unit_m)
    bounds = pose_bounds(mesh.inside_m, Angles())
    poses = poses_of(sample_poses(bounds, 1000, np.random.default_rng(0)))
    shares = empty_shares(RayCaster(*loaded.merged()), poses, CameraConfig())
    return float(shares.mean() + 3.0 * shares.std() / np.sqrt(n_paths))


@pytest.mark.parametrize("make", MESHES.values(), ids=MESHES)
def test_from_a_mesh_to_a_data_set_without_help(make, tmp_path, capsys):
    mesh = make(tmp_path)
    with contextlib.chdir(tmp_path):
        assert main(["inspect", mesh.path.name]) == 0
        command = shlex.split(capsys.readouterr().out.splitlines()[-1])
        assert command[:2] == ["synfeal", "collect"]
        assert main([*command[1:], *SMALLER]) == 0
        out = tmp_path / command[command.index("--out") + 1]
        assert main(["validate", str(out)]) == 0
    table = read_pose_table(out / "train.csv")
    positions = table.position_m
    assert (positions > mesh.inside_m[0] - 0.15).all()
    assert (positions < mesh.inside_m[1] + 0.15).all()
    empty = json.loads((out / "coverage.json").read_text())["train"]["empty_pixels"]["share"]
    assert empty <= explained_by_holes(mesh, int(table.path[-1]) + 1)
