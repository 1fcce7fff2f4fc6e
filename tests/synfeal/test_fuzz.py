"""No wrong configuration or file ends in a traceback, a hang, half a result or a wrong one."""

import math
import os
import pickle
from pathlib import Path
from zlib import crc32

import numpy as np
import pytest
import torch
import yaml

from reproduction.config.load import load_config, parse_config
from reproduction.config.profile import Config
from synfeal.config.collection import ClutterConfig
from synfeal.config.photometric import PhotometricConfig
from synfeal.dataset.pose_table import read_frames, write_pose_table
from synfeal.errors import InputError
from synfeal.records.files import PlainLoader
from tests import CONFIG, ROOT
from tests.support.fuzz_files import KINDS
from tests.support.fuzzing import (
    at,
    damages,
    json_damages,
    little_memory,
    places,
    problem_with,
    put,
    removed,
    replaced,
    text_damages,
)
from tests.support.room_scene import straight_path

pytestmark = pytest.mark.slow
EXTERNAL = "../examples/external.yaml"  # no profile has a localizer of somebody else's
PROFILES = (("config.yaml", EXTERNAL), ("config.yaml", "smoke.yaml"), ("config.yaml", "paper.yaml"))
LEAST = 2500  # inputs of all kinds together
VALUES = (
    *(None, True, False, 0, -1, 0.5, 1e30, -1e30, 10**30, 10**400, 1e-320),
    *(float("nan"), float("inf"), float("-inf"), "", "x", "..", "../../x", "/", "a/b", "a\0b"),
    *("x" * 300, "x" * 100_000, "0x10", "1e400", [], [1], [[]], [None], {}, {"x": 1}, {1: 2}),
)


def full(profile):
    """Every key of a profile with its value, defaults included."""
    config = load_config(*(CONFIG / name for name in profile))
    raw = config.model_dump(mode="json")
    scene = next(iter(raw["scenes"].values()))
    scene |= {"clutter": ClutterConfig().model_dump(mode="json"), "min_seen": 0.5}
    raw["training"]["randomisation"] = PhotometricConfig().model_dump(mode="json")
    return raw


def wrong_values(profile):
    """Label, changed key, what it was changed to, and the whole mapping.

    Every change is tried on one profile: they hold nearly the same keys, and a label falls to the
    same profile wherever it stands.
    """
    raw = full(profile)

    def is_tried(label):
        return crc32(label.encode()) % len(PROFILES) == PROFILES.index(profile)

    for place in places(raw):
        name = ".".join(map(str, place))
        for value in VALUES:
            if is_tried(label := f"{name} = {str(value)[:20]!r}"):
                yield label, place, value, replaced(raw, place, value)
        if is_tried(label := f"without {name}"):
            yield label, place, None, removed(raw, place)
        if isinstance(at(raw, place), dict):
            for key in ("surplus", "", "x" * 5000, "../x", 5, None):
                if is_tried(label := f"{name} with {str(key)[:9]!r}"):
                    inner = {**at(raw, place), key: next(iter(at(raw, place).values()), 1)}
                    yield label, place, inner, replaced(raw, place, inner)


def is_config(config, place, value):
    """Whether what was accepted is what was given, can be run, and stays in its directory."""
    dump = config.model_dump(mode="json")
    assert parse_config(dump) == config
    for found in (at(dump, p) for p in places(dump)):
        assert not isinstance(found, float) or math.isfinite(found)
        assert not isinstance(found, str) or "\0" not in found
        assert not isinstance(found, int) or abs(found) < 2**63
    assert config.root.resolve().parent == config.results.resolve()
    names = [*config.scenes, *(size for scene in config.scenes.values() for size in scene.sizes)]
    assert all(len(name) <= 64 and name.replace("_", "").isalnum() for name in names)
    if value is not None and not isinstance(value, dict | list):
        kept = at(dump, place)
        if isinstance(kept, bool):
            assert kept is bool(value)
        else:
            assert not isinstance(value, bool)
            is_path = isinstance(value, str) and str(Path(value)) == kept
            assert is_path or kept == value or float(value) == kept
    return True


@pytest.mark.parametrize("profile", PROFILES, ids=lambda files: Path(files[-1]).stem)
def test_every_key_takes_a_right_value_or_none(profile, monkeypatch):
    monkeypatch.chdir(ROOT)
    fields = tuple(f"my.yaml: {name}" for name in Config.model_fields)
    failures, count = [], 0
    for label, place, value, raw in wrong_values(profile):
        count += 1
        problem = problem_with(
            lambda raw=raw: parse_config(raw, "my.yaml"),
            lambda config, place=place, value=value: is_config(config, place, value),
            (*fields, "my.yaml: surplus"),
        )
        failures += [f"{label}: {problem}"] if problem else []
    assert count >= LEAST
    assert not failures, f"{len(failures)} of {profile}:\n" + "\n".join(failures)


# Of cameras that a perspective one without calibration excludes, and what null leaves out.
LEFT_OUT = {
    "calibration",
    "projection",
    "fisheye_k",
    "stereo_baseline_m",
    "depth_units_per_m",
    "test_paths",
    "around_m",
    "around_turn_deg",
    "shade",
}


def test_no_model_was_left_out():
    """Every key of every model stands in the mapping whose values are changed."""
    keys = {place[-1] for place in places(full(PROFILES[0]))}
    schema = Config.model_json_schema()
    for name, model in {"Config": schema, **schema["$defs"]}.items():
        assert set(model.get("properties", ())) - keys <= LEFT_OUT, name


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


def test_a_table_cut_between_two_lines_is_named(tmp_path):
    """Every line of it is sound, so only who knows the number of frames can tell."""
    plan = tmp_path / "plan.csv"
    write_pose_table(plan, straight_path(6, 0.1, 3.0))
    with pytest.raises(InputError, match=r"plan\.csv: holds 6 poses, 7 are needed"):
        read_frames(plan, 2, 7)
    np.testing.assert_array_equal(read_frames(plan, 2, 6).frame, [2, 3, 4, 5])
