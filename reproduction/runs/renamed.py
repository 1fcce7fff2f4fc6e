"""Results under names of an earlier version: refused by the workflow, renamed by this module.

``python -m reproduction.runs.renamed results/night`` renames them; no file changes.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import pandas as pd

from synfeal.errors import InputError, exit_status

# Trajectories of label methods lay in ``groundtruth``, and the camera of the frames that they see
# was called so: both hold estimates, or serve to make them.
OLD = "groundtruth"
ESTIMATES, CAMERA = "estimates", "estimation"
EFFECTS = "robustness"
# Files and directories that are called by camera, below the results.
BY_CAMERA = (f"datasets/*/{OLD}*", f"scenes/*/*_{OLD}.*")
MEASURED_BY_CAMERA = (f"benchmarks/**/*{OLD}*", f"logs/**/*{OLD}*")


def refuse_old_names(root: Path) -> None:
    """Refuse results with names that the workflow would make anew beside them.

    Raises:
        InputError: naming one of them and the command that renames them.
    """
    for path, _ in _old_names(root, BY_CAMERA):
        raise InputError(
            path,
            "is called otherwise now",
            f"rename it and its like with `python -m reproduction.runs.renamed {root}`",
        )


def rename_results(root: Path) -> int:
    """Give results their present names.

    Args:
        root: Results of a profile.

    Returns:
        Files and directories that were renamed.

    Raises:
        InputError: there is something under a present name already; nothing was renamed.
    """
    found = list(_old_names(root, BY_CAMERA + MEASURED_BY_CAMERA))
    for old, new in found:
        if new.exists():
            raise InputError(new, f"is there beside {old}", "remove the one that is not needed")
    for old, new in found:
        old.rename(new)
    return len(found)


def with_present_names(jobs: pd.DataFrame) -> pd.DataFrame:
    """Give measured jobs the names that they have today.

    An old run measured effects as the job of that name in the stage ``tables``, which becomes a
    stage of its own. A run that has that stage already keeps the jobs of its tables.

    Args:
        jobs: Their ``stage`` and ``job``, such as ``render`` and ``large_room/groundtruth/seq-01``.

    Returns:
        The same jobs, renamed.
    """
    renamed = jobs.assign(job=jobs["job"].str.replace(OLD, CAMERA, regex=False))
    if not (jobs["stage"] == EFFECTS).any():
        is_old_effects = (jobs["stage"] == "tables") & (jobs["job"] == EFFECTS)
        renamed.loc[is_old_effects, ["stage", "job"]] = EFFECTS, ""
    return renamed


def _old_names(root: Path, by_camera: Sequence[str]) -> Iterator[tuple[Path, Path]]:
    """List what has an old name, and its present one; what a directory holds before itself."""
    if (root / OLD).is_dir():
        yield root / OLD, root / ESTIMATES
    for pattern in by_camera:
        for path in sorted(root.glob(pattern), reverse=True):
            yield path, path.with_name(path.name.replace(OLD, CAMERA))


def rename_named(arguments: Sequence[str]) -> None:
    """Rename the results that a command line names.

    Raises:
        InputError: one of them is no directory, or none is named.
    """
    roots = [Path(name) for name in arguments]
    if not roots:
        raise InputError("name the results to rename, such as results/night")
    for root in roots:
        if not root.is_dir():
            raise InputError(root, "is not a directory", "name results such as results/night")
        print(f"{root}: {rename_results(root)} renamed")


if __name__ == "__main__":
    sys.exit(exit_status(lambda: rename_named(sys.argv[1:]), "start it again to go on"))
