"""Which files of a results directory were restored, and whether the configuration fits them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from baselines.groundtruth.methods import METHODS, estimation_parameters
from baselines.training.record import RECORD, read_training_record, training_parameters
from synfeal.config import MODELS, Config, Run
from synfeal.errors import InputError
from synfeal.report.results import read_result

LIST = "restored.json"
ESTIMATION = "estimation.json"


def restored_files(config: Config) -> frozenset[str]:
    """Paths of the restored files that are still there, as the workflow names them."""
    root = config.root
    found = {path for path in listed_files(root) if (root / path).is_file()}
    for path in sorted(found):
        for key, made_with, now in _differences(config, path):
            raise InputError(
                f"{root / path}: restored, and made with another {key} than the configuration has"
                f" ({made_with}, now {now}); delete {(root / path).parent} to make it anew"
            )
    return frozenset(f"{root.as_posix()}/{path}" for path in found)


def listed_files(root: Path) -> set[str]:
    """What ``restored.json`` lists; nothing where there is none."""
    if not (root / LIST).exists():
        return set()
    return set(read_result(root / LIST, ("files",), "restore again")["files"])


def _differences(config: Config, path: str) -> Iterator[tuple[str, str, str]]:
    """Settings that a restored record and the configuration disagree on: key, then, now."""
    stage, *parts, name = Path(path).parts
    if stage == "runs" and name == RECORD:
        run = _run_of(config, parts)
        recorded = read_training_record(config.root / path)["parameters"]
        yield from _unequal(recorded, training_parameters(config, run)) if run else ()
    if stage == "labels" and name == ESTIMATION and parts[-1] in METHODS:
        recorded = read_result(config.root / path, ("parameters",), "restore again")["parameters"]
        yield from _unequal(recorded, estimation_parameters(config, parts[-1]))


def _run_of(config: Config, parts: list[str]) -> Run | None:
    """The run of a path below ``runs``; None where the configuration has no settings for it."""
    scene, size, labels, init, model, seed = parts
    known = model in MODELS and size in config.training.samples_seen
    return Run(scene, size, labels, init, model, int(seed.removeprefix("seed"))) if known else None


def _unequal(then: Any, now: Any, key: str = "") -> Iterator[tuple[str, str, str]]:
    """Leaves of two nested mappings that differ, with dotted keys."""
    if isinstance(then, Mapping) and isinstance(now, Mapping):
        for name in sorted({*then, *now}):
            yield from _unequal(then.get(name), now.get(name), f"{key}.{name}" if key else name)
    elif then != json.loads(json.dumps(now)):
        yield key, str(then), str(now)
