"""No damaged file ends in a traceback, a hang, half a result or a silently wrong one."""

import os
import pickle
from pathlib import Path

import numpy as np
import pytest
import torch
import yaml

from baselines.groundtruth.batches import BatchTrajectory, write_trajectory
from baselines.groundtruth.chain import chain_split
from synfeal.config.models import GroundTruthConfig
from synfeal.dataset.pose_table import read_frames, write_pose_table
from synfeal.errors import InputError
from synfeal.files import PlainLoader
from tests.fuzz_files import KINDS
from tests.fuzzing import damages, json_damages, little_memory, problem_with, put, text_damages
from tests.planar_scene import straight_path

pytestmark = pytest.mark.slow
REPOSITORY = Path(__file__).parent.parent
LEAST = 4000  # inputs of all kinds together


@pytest.fixture(scope="session")
def sound(tmp_path_factory):
    """A sound file of every kind: what another may be mistaken for."""
    found = {}
    for kind in KINDS:
        found[kind.name] = kind.make(tmp_path_factory.mktemp("sound")).read_bytes()
    return found


def inputs_of(kind, sound):
    data = sound[kind.name]
    every = list(damages(data, sound, seed=KINDS.index(kind), n_flips=kind.n_flips))
    if kind.form == "json":
        every += json_damages(data)
    elif kind.form:
        every += text_damages(data, kind.form)
    return every


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_damage_is_refused_in_one_line_or_does_no_harm(kind, sound, tmp_path):
    path = kind.make(tmp_path)
    kind.read(path)
    failures = []
    with little_memory():
        for damage in inputs_of(kind, sound):
            put(path, damage)
            names = (str(path), path.name, str(path.parent))
            problem = problem_with(lambda: kind.read(path), kind.is_valid, names, tmp_path)
            failures += [f"{damage.label}: {problem}"] if problem else []
    assert not failures, f"{len(failures)} of {kind.name}:\n" + "\n".join(failures)


class Payload:
    """Unpickled, it makes a directory."""

    def __init__(self, made):
        self.made = str(made)

    def __reduce__(self):
        return os.mkdir, (self.made,)


@pytest.mark.parametrize(
    "name", ["checkpoint", "backbone", "packed frames", "packed frames, training"]
)
def test_a_pickle_with_code_does_not_run(name, tmp_path):
    kind = next(kind for kind in KINDS if kind.name == name)
    path, made = kind.make(tmp_path), tmp_path / "made"
    for write in (
        lambda: torch.save({"localizer": {}, "images": Payload(made)}, path),
        lambda: path.write_bytes(pickle.dumps(Payload(made))),
        lambda: np.save(path.with_suffix(".npy"), np.array([Payload(made)]), allow_pickle=True),
    ):
        write()
        if path.suffix == ".pt" and path.with_suffix(".npy").exists():
            path.with_suffix(".npy").replace(path)
        with pytest.raises(InputError, match=path.name):
            kind.read(path)
        assert not made.exists()
    pickle.loads(pickle.dumps(Payload(made)))  # the payload itself is sound
    assert made.is_dir()


def test_the_loaders_of_yaml_build_plain_values_only():
    assert issubclass(PlainLoader, yaml.SafeLoader)
    plain = {f"tag:yaml.org,2002:{name}" for name in PLAIN}
    for loader in (PlainLoader, *PlainLoader.__subclasses__()):
        assert set(filter(None, loader.yaml_constructors)) <= plain
        assert not loader.yaml_multi_constructors


PLAIN = (
    *("null", "bool", "int", "float", "binary", "timestamp", "omap", "pairs", "set", "str"),
    *("seq", "map", "opencv-matrix"),
)


def test_tables_cut_between_two_lines_are_named(tmp_path):
    """Every line of them is sound, so only who knows the number of frames can tell."""
    plan, batch = tmp_path / "plan.csv", tmp_path / "batch.csv"
    table = straight_path(6, 0.1, 3.0)
    write_pose_table(plan, table)
    write_trajectory(batch, BatchTrajectory(table.world_from_cam[:5], np.ones(5, bool)))
    with pytest.raises(InputError, match=r"plan\.csv: holds 6 poses, 7 are needed"):
        read_frames(plan, 2, 7)
    np.testing.assert_array_equal(read_frames(plan, 2, 6).frame, [2, 3, 4, 5])
    outputs = tmp_path / "labels.csv", tmp_path / "unassisted.csv"
    with pytest.raises(InputError, match=r"batch\.csv: holds 5 poses for 6 frames"):
        chain_split([batch], plan, *outputs, GroundTruthConfig(batch_frames=5))
    assert not any(path.exists() for path in outputs)
