"""``synfeal restore``: finished runs back into a results directory, for the workflow to go on from.

What was restored is listed in ``restored.json``. The workflow asks for nothing that those files
were made from, so they count as done though there is no model and no frame, whatever else is made
again. Where the configuration has changed since, the workflow refuses them
(:func:`restored_files`).
"""

from __future__ import annotations

import hashlib
import json
import lzma
import os
import time
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path, PurePosixPath
from typing import Annotated

from pydantic import AfterValidator, BaseModel, TypeAdapter

from baselines.config.learning import MODELS
from baselines.labels.methods import METHODS
from baselines.training.record import RECORD, read_training_record
from reproduction.config.profile import Config
from reproduction.design.experiments import Run
from reproduction.design.labels import estimation_parameters
from reproduction.design.runs import training_parameters
from reproduction.runs.keep import DESCRIPTOR, PREDICTIONS
from reproduction.runs.results import read_result, unequal_leaves
from synfeal.dataset.frame_files import ARCHIVE_DAMAGE
from synfeal.errors import InputError, read_as, why
from synfeal.records.files import atomic_path, write_json
from synfeal.records.lock import begin_run

LIST = "restored.json"
ESTIMATION = "estimation.json"
DAMAGE = (OSError, *ARCHIVE_DAMAGE, lzma.LZMAError, KeyError, TypeError)


def _inside(path: str) -> str:
    if PurePosixPath(path).is_absolute() or ".." in PurePosixPath(path).parts or "\\" in path:
        raise ValueError(f"'{path}' does not lie in a results directory")
    return path


class Resource(BaseModel):
    """A file of a package, as its descriptor says it."""

    path: Annotated[str, AfterValidator(_inside)]  # below the results directory, with ``/``
    hash: str  # ``sha256:`` of what it holds
    bytes: int  # how much of its member it is: a smaller data set is the beginning of a larger one
    member: str | None = None  # name in the ZIP file, where it is not ``path``

    @property
    def holder(self) -> str:
        """Name of its member in the ZIP file."""
        return self.member or self.path


def restore(package: Path, root: Path) -> tuple[int, int]:
    """Unpack what :func:`~reproduction.runs.keep.keep` wrote.

    Files that are there already with the same content are left as they are.

    Returns:
        How many runs were written, and how many were there.

    Raises:
        InputError: the package is damaged, ``root`` holds other files under the same names, or a
            workflow is at work there. Then nothing was written.
    """
    resources = read_resources(package)
    new = [r for r, content in read_contents(package, resources) if _is_new(root / r.path, content)]
    begin_run(root)
    now_ns = time.time_ns()  # one date for all: none is younger than what was made from it
    for resource, content in read_contents(package, new):
        with atomic_path(root / resource.path) as temporary:
            temporary.write_bytes(content)
            os.utime(temporary, ns=(now_ns, now_ns))
    written = {resource.path for resource in new}
    write_json(root / LIST, {"files": sorted(listed_files(root) | written)})
    return _runs(new), _runs(resources) - _runs(new)


def _is_new(path: Path, content: bytes) -> bool:
    """Whether a file has to be written; it may be there, but hold nothing else."""
    if path.is_file() and path.read_bytes() != content:
        raise InputError(
            f"{path}: exists and differs from what would be restored; delete it, or restore into"
            " another directory"
        )
    return not path.is_file()


def _runs(resources: Iterable[Resource]) -> int:
    return sum(Path(resource.path).name == PREDICTIONS for resource in resources)


def read_resources(package: Path) -> list[Resource]:
    """What a package says it holds.

    Raises:
        InputError: it cannot be read, or names a file outside of where it is unpacked.
    """
    with read_as(package, "what synfeal keep writes", *DAMAGE):
        with zipfile.ZipFile(package) as opened:
            described = json.loads(opened.read(DESCRIPTOR))["resources"]
        return TypeAdapter(list[Resource]).validate_python(described)


def read_contents(package: Path, resources: list[Resource]) -> Iterator[tuple[Resource, bytes]]:
    """What files of a package hold, their hashes verified; each member is read once.

    Raises:
        InputError: a member is missing, damaged or not what its hash says.
    """
    member, data = "", b""
    with zipfile.ZipFile(package) as opened:
        for resource in sorted(resources, key=lambda r: (r.holder, r.path)):
            try:
                if resource.holder != member:
                    member, data = resource.holder, opened.read(resource.holder)
            except DAMAGE as error:
                raise InputError(
                    f"{package}: {resource.holder}: is damaged ({why(error)})"
                ) from error
            content = data[: resource.bytes]
            if f"sha256:{hashlib.sha256(content).hexdigest()}" != resource.hash:
                raise InputError(f"{package}: {resource.path}: differs from its hash; copy it anew")
            yield resource, content


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


def _differences(config: Config, path: str) -> Iterable[tuple[str, str, str]]:
    """Settings that a restored record and the configuration disagree on: key, then, now."""
    stage, *parts, name = Path(path).parts
    if stage == "runs" and name == RECORD:
        run = _run_of(config, parts)
        recorded = read_training_record(config.root / path)["parameters"]
        now = training_parameters(config, run) if run else recorded
    elif stage == "labels" and name == ESTIMATION and parts[-1] in METHODS:
        recorded = read_result(config.root / path, ("parameters",), "restore again")["parameters"]
        now = estimation_parameters(config, parts[-1])
    else:
        return ()
    return unequal_leaves(recorded, now).itertuples(index=False, name=None)


def _run_of(config: Config, parts: list[str]) -> Run | None:
    """The run of a path below ``runs``; None where the configuration has no settings for it."""
    scene, size, labels, init, model, seed = parts
    known = model in MODELS and size in config.training.samples_seen
    return Run(scene, size, labels, init, model, int(seed.removeprefix("seed"))) if known else None
