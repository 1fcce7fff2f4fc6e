"""No wrong configuration ends in a traceback, a hang or a silently different run."""

import math
from pathlib import Path

import pytest
from pydantic import BaseModel

from synfeal.config import Config, load_config, parse_config
from synfeal.config.collection import ClutterConfig
from tests.fuzzing import at, places, problem_with, removed, replaced

pytestmark = pytest.mark.slow
REPOSITORY = Path(__file__).parent.parent
CONFIG = REPOSITORY / "config"
EXTERNAL = "../examples/external.yaml"  # no profile has a localizer of somebody else's
PROFILES = (("config.yaml", EXTERNAL), ("config.yaml", "smoke.yaml"), ("config.yaml", "paper.yaml"))
LEAST = 2500  # inputs of all kinds together
VALUES = (
    *(None, True, False, 0, -1, 0.5, 1e30, -1e30, 10**30, 10**400, 1e-320),
    *(float("nan"), float("inf"), float("-inf"), "", "x", "..", "../../x", "/", "a/b", "a\0b"),
    *("x" * 300, "x" * 100_000, "0x10", "1e400", [], [1], [[]], [None], {}, {"x": 1}, {1: 2}),
)


@pytest.fixture(autouse=True)
def _in_the_repository(monkeypatch):
    monkeypatch.chdir(REPOSITORY)


def full(profile):
    """Every key of a profile with its value, defaults included."""
    config = load_config(*(CONFIG / name for name in profile))
    raw = config.model_dump(mode="json")
    next(iter(raw["scenes"].values()))["clutter"] = ClutterConfig().model_dump(mode="json")
    return raw


def wrong_values(profile):
    """Label, changed key, what it was changed to, and the whole mapping."""
    raw = full(profile)
    for place in places(raw):
        name = ".".join(map(str, place))
        for value in VALUES:
            yield f"{name} = {str(value)[:20]!r}", place, value, replaced(raw, place, value)
        yield f"without {name}", place, None, removed(raw, place)
        if isinstance(at(raw, place), dict):
            for key in ("surplus", "", "x" * 5000, "../x", 5, None):
                inner = {**at(raw, place), key: next(iter(at(raw, place).values()), 1)}
                yield f"{name} with {str(key)[:9]!r}", place, inner, replaced(raw, place, inner)


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
def test_every_key_takes_a_right_value_or_none(profile):
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


def models(model):
    """A model and all below it, by their annotations."""
    found, pending = {model}, [model]
    while pending:
        annotations = [field.annotation for field in pending.pop().model_fields.values()]
        while annotations:
            annotation = annotations.pop()
            if isinstance(annotation, type) and issubclass(annotation, BaseModel):
                if annotation not in found:
                    found.add(annotation)
                    pending.append(annotation)
            else:
                annotations += getattr(annotation, "__args__", ())
    return found


def test_no_model_was_left_out():
    """Every key of every model stands in the mapping whose values are changed."""
    keys = {place[-1] for place in places(full(PROFILES[0]))}
    for model in models(Config):
        missing = set(model.model_fields) - keys
        assert missing <= {"calibration"}, model
