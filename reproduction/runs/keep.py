"""``synfeal keep``: what the tables of a run need and training made, in one small file.

Of each finished run: predictions, history, what it was trained from and what that took. Of its data
set: true poses, test labels, and estimated labels with what estimation left. Not kept: models and
frames, which are large, and whatever follows from the rest in no time.

The file is a Data Package (datapackage.org, version 1) in a ZIP file: files, hashes and schemas.
Members are compressed one by one, in order of name and without a date: the same files give the same
bytes, and a package that has grown shares most of its bytes with the one before, so that git keeps
the difference. LZMA makes tables of poses a quarter smaller than what ``unzip`` can read; Python,
7-Zip and bsdtar read it.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath
from typing import Any

from tqdm import tqdm

from synfeal.dataset.frame_files import EPOCH, PLAIN_FILE, UNIX
from synfeal.dataset.pose_table import HEADER
from synfeal.errors import InputError
from synfeal.records.files import atomic_path

DESCRIPTOR, SCHEMA = "datapackage.json", "schemas/poses.json"
POSES: dict[str, Any] = {
    "fields": [
        {"name": "frame", "type": "integer", "description": "index of the frame in its split"},
        {"name": "path", "type": "integer", "description": "index of its straight path"},
        *(
            {"name": f"t{axis}", "type": "number", "description": "camera centre, metres"}
            for axis in "xyz"
        ),
        *(
            {"name": f"q{axis}", "type": "number", "description": "world_from_cam, unit quaternion"}
            for axis in "wxyz"
        ),
    ],
    "missingValues": ["nan"],
    "primaryKey": "frame",
}
PREDICTIONS = "predictions.csv"
OF_RUN = (PREDICTIONS, "common_predictions.csv", "history.csv", "training.json")
# Written by the job that estimates labels, so it tells them from labels that are computed.
ESTIMATED = "assistance.json"
# True poses, what estimation of labels left, records of the scene, and what references answered in
# minutes rather than hours.
OF_DATA_SET = (
    *(f"labels/{{scene}}/{{size}}/synfeal/{split}.csv" for split in ("train", "test")),
    "groundtruth/{scene}/{size}/*/*/batch-*.*",
    *("scenes/{scene}/properties.json", "scenes/{scene}/collision_curve.csv"),
    *("scenes/{scene}/render_speed.csv", "scenes/{scene}/collection_speed.json"),
    *("scenes/{scene}/test_depth.npy", "frames/{scene}/*.json"),
    *(f"references/{{scene}}/{{size}}/*/*/{name}.json" for name in ("metrics", "facts")),
)


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
    for scene, size in {run.relative_to(root / "runs").parts[:2] for run in runs}:
        for pattern in OF_DATA_SET:
            files.update(root.glob(pattern.format(scene=scene, size=size)))
        for record in root.glob(f"labels/{scene}/{size}/*/{ESTIMATED}"):
            files.update(p for p in record.parent.iterdir() if p.suffix in (".csv", ".json"))
    names = sorted(file.relative_to(root).as_posix() for file in files)
    holders, resources = _beginnings(root, names), []
    with atomic_path(out) as temporary, zipfile.ZipFile(temporary, "w") as package:
        for name in tqdm(names, unit="file", desc="keep", leave=False, disable=None):
            data, holder = (root / name).read_bytes(), holders.get(name, name)
            resources.append(_described(name, holder, data))
            if holder == name:
                _add(package, name, data)
        described = {"name": "synfeal-run", "resources": resources}
        for name, value in ((SCHEMA, POSES), (DESCRIPTOR, described)):
            _add(package, name, f"{json.dumps(value, indent=1)}\n".encode())
    return len(runs)


def _of_run(root: Path, run: Path) -> Iterator[Path]:
    name = run.relative_to(root / "runs")
    labels = root.joinpath("labels", *name.parts[:3], "test.csv")
    if not labels.is_file():
        raise InputError(f"{labels}: missing, and {run} was made from it")
    measured = root / "benchmarks" / "train" / f"{name}.tsv"
    found = (labels, measured, *(run / file for file in OF_RUN))
    yield from (path for path in found if path.is_file())


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


def _described(path: str, member: str, data: bytes) -> dict[str, Any]:
    """A resource as the standard has it; ``member`` is ours, of a file that another one holds."""
    entry = {
        "name": path.lower().replace("/", "."),
        "path": path,
        "format": PurePosixPath(path).suffix[1:],
        "bytes": len(data),
        "hash": f"sha256:{hashlib.sha256(data).hexdigest()}",
    }
    if data.startswith(f"{HEADER}\n".encode()):
        entry["schema"] = SCHEMA
    return entry if member == path else {**entry, "member": member}


def _add(package: zipfile.ZipFile, name: str, data: bytes) -> None:
    info = zipfile.ZipInfo(name, EPOCH)
    info.create_system, info.external_attr = UNIX, PLAIN_FILE << 16
    package.writestr(info, data, zipfile.ZIP_LZMA)
