"""``synfeal keep``: what the tables of a run need and training made, in one small file.

Of each finished run: predictions, history, what it was trained from and what that took. Of its data
set: true poses, test labels, and estimated labels with what estimation left. Not kept: models and
frames, which are large, and whatever follows from the rest in no time.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from synfeal.errors import InputError
from synfeal.report.predictions.package import write_package

PACKAGE, PREDICTIONS = "predictions.zip", "predictions.csv"
OF_RUN = (PREDICTIONS, "common_predictions.csv", "history.csv", "training.json")
OF_SCENE = (
    *("properties.json", "collision_curve.csv", "render_speed.csv", "collection_speed.json"),
    "test_depth.npy",
)
# Written by the job that estimates labels, so it tells them from labels that are computed.
ESTIMATED = "assistance.json"
OF_REFERENCE = ("metrics.json", "facts.json")  # their answers take minutes, not hours
TRUTH = ("train.csv", "test.csv")


def keep(root: Path, out: Path) -> int:
    """Write what is finished below a results directory as one file; returns the number of runs.

    A workflow may be at work there: a run counts as finished when its predictions are there.

    Raises:
        InputError: no run is finished, or labels of one are missing.
    """
    runs = sorted(path.parent for path in root.glob(f"runs/**/{PREDICTIONS}"))
    if not runs:
        raise InputError(f"{root}: holds no runs/**/{PREDICTIONS}; name results with finished runs")
    files = {file for run in runs for file in _of_run(root, run)}
    for scene, size in sorted({_data_set(root, run)[:2] for run in runs}):
        files.update(_of_data_set(root, scene, size))
    names = sorted(file.relative_to(root).as_posix() for file in files)
    write_package(root, {name: name for name in names} | _beginnings(root, names), out)
    return len(runs)


def _data_set(root: Path, run: Path) -> tuple[str, str, str]:
    """Scene, size and labels of a run, by its path."""
    scene, size, labels, *_ = run.relative_to(root / "runs").parts
    return scene, size, labels


def _of_run(root: Path, run: Path) -> Iterable[Path]:
    scene, size, labels = _data_set(root, run)
    label_set = root / "labels" / scene / size / labels
    if not (label_set / "test.csv").is_file():
        raise InputError(f"{label_set / 'test.csv'}: missing, and {run} was made from it")
    yield label_set / "test.csv"
    yield from (run / name for name in OF_RUN if (run / name).is_file())
    measured = root / "benchmarks" / "train" / run.relative_to(root / "runs")
    yield from measured.parent.glob(f"{measured.name}.tsv")


def _of_data_set(root: Path, scene: str, size: str) -> Iterable[Path]:
    """True poses, estimated labels, what estimation left, and records of the scene."""
    label_sets = root / "labels" / scene / size
    yield from (path for name in TRUTH if (path := label_sets / "synfeal" / name).is_file())
    for record in label_sets.glob(f"*/{ESTIMATED}"):
        yield from (path for path in record.parent.iterdir() if path.suffix in (".csv", ".json"))
    yield from (root / "groundtruth" / scene / size).glob("*/*/batch-*.*")
    yield from (path for name in OF_SCENE if (path := root / "scenes" / scene / name).is_file())
    yield from (root / "frames" / scene).glob("*.json")
    for name in OF_REFERENCE:
        yield from (root / "references" / scene / size).glob(f"*/*/{name}")


def _beginnings(root: Path, names: Iterable[str]) -> dict[str, str]:
    """Of true poses that a larger data set of the scene begins with: where those of it lie."""
    found = [name for name in names if Path(name).parent.name == "synfeal"]
    largest: dict[tuple[str, str], tuple[str, bytes]] = {}
    held: dict[str, str] = {}
    for name in sorted(found, key=lambda name: -(root / name).stat().st_size):
        key, data = (name.split("/")[1], Path(name).name), (root / name).read_bytes()
        larger, content = largest.setdefault(key, (name, data))
        if content.startswith(data):
            held[name] = larger
    return held
