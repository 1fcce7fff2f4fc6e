"""``synfeal restore``: finished runs back into a results directory, for the workflow to go on from.

What was restored is listed in ``restored.json``. The workflow asks for nothing that those files
were made from, so they count as done though there is no model and no frame, whatever else is made
again. Where the configuration has changed since, the workflow refuses them
(:mod:`synfeal.report.predictions.restored`).
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterable
from pathlib import Path

from synfeal.errors import InputError
from synfeal.files import atomic_path, write_json
from synfeal.report.predictions.keep import PREDICTIONS
from synfeal.report.predictions.package import Resource, read_contents, read_resources
from synfeal.report.predictions.restored import LIST, listed_files
from synfeal.run_lock import begin_run


def restore(package: Path, root: Path) -> tuple[int, int]:
    """Unpack what :func:`~synfeal.report.predictions.keep.keep` wrote.

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
