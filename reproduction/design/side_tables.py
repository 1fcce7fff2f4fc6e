"""Side tables, those beside the tables of the design: what is declared, and what each needs.

A side table is a class with a declaration above it, in any module of this package or of one that is
installed beside it (``docs/adding.md``)::

    @SideTable(name="recall", title="Recall", needs=("runs/{run}/metrics.json",))
    class RecallTable(Table): ...

One rule makes all of them. Declarations are read from the source, so that the workflow lists its
jobs without importing pandas, which every one of its jobs would do again.
"""

from __future__ import annotations

import hashlib
import importlib.util
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from baselines.registry.declarations import declared
from baselines.registry.kinds import Kind
from reproduction.design.files import SPLITS, Files
from reproduction.design.ranking import ranked_sets, rankings
from reproduction.design.shapes import TABLE as SHAPE_TABLE
from reproduction.design.shapes import shape_rows
from synfeal.errors import InputError


@dataclass(frozen=True, kw_only=True)
class SideTable(Kind):
    """A side table: a class, a :class:`reproduction.tables.side.Table`.

    Attributes:
        needs: Files that it reads, below the results, with ``NAMES`` in braces.
            Without any file of the first pattern a run has no rows for the table, and leaves it
            out; patterns that follow may have none.
        settings: Keys of the profile whose parts it is given; :class:`reproduction.tables.side.
            Source` says how.
        in_document: Whether ``all_tables.tex`` has it.
        in_summary: Whether ``summary.md`` has it.
        mem_mb: Memory that its job asks for.
    """

    room: ClassVar[str] = "reproduction"
    entry_points: ClassVar[str] = "synfeal.tables"
    names: ClassVar[tuple[str, str]] = (
        "[a-z][a-z0-9_]*",
        "lower-case letters, digits and _",
    )
    needs: tuple[str, ...] = ()
    settings: tuple[str, ...] = ()
    in_document: bool = False
    in_summary: bool = False
    mem_mb: int = 1000


def _ranked(files: Files) -> list[str]:
    found = rankings(files.design, files.config.references)
    return sorted({f for each in found for runs in each.folders.values() for f in runs})


def _ranking_sets(files: Files) -> list[str]:
    sets = ranked_sets(files.design)
    exact = {f"{scene}/{size}/synfeal" for scene, size, _ in sets}
    return sorted({"/".join(key) for key in sets} | exact)


def _tested_scene(files: Files) -> list[str]:
    return [files.config.robustness.scene] if files.has_robustness else []


# What may stand in braces in ``needs``, and what it stands for. Two more take the name of a table:
# ``{run:table4_size}`` are the runs of this one, and ``{table:table4_size}`` is its name if the
# profile makes it.
NAMES: Mapping[str, Callable[[Files], Sequence[str]]] = {
    "scene": lambda files: files.scenes,
    "split": lambda files: SPLITS,
    "run": lambda files: [run.directory for run in files.design.runs],
    # <scene>/<size>/<labels>: true poses, estimated ones, either.
    "true_set": lambda files: files.true_sets,
    "estimated_set": lambda files: files.estimated_sets,
    "pose_set": lambda files: files.pose_sets,
    # <scene>/<size>/<stage>/<split>/batch-<index>
    "estimated_batch": lambda files: files.estimated_batches,
    # <scene>/<size>/<labels>/<method>
    "reference": lambda files: files.reference_answers,
    # Folders of the predictions that label sets rank, and the sets whose test labels do.
    "ranked": _ranked,
    "ranking_set": _ranking_sets,
    # Runs that tell label errors apart by their shape.
    "shape_run": lambda files: files.runs_of(SHAPE_TABLE) if shape_rows(files.design.rows) else (),
    # The scene that effects are tested in; it where their speed is measured, too.
    "tested_scene": _tested_scene,
    "timed_scene": lambda files: _tested_scene(files) if files.effects_speed() else (),
}
SIDE_TABLES = declared(SideTable)
_FIELD = re.compile(r"\{(\w+)(?::(\w+))?\}")


def made_side_tables(files: Files) -> list[str]:
    """List the side tables that a profile has rows for."""
    return [name for name in SIDE_TABLES if has_rows(files, name)]


def has_rows(files: Files, name: str) -> bool:
    """Tell whether a profile has rows for a side table."""
    needs = SIDE_TABLES[name].needs
    return not needs or bool(_files_of(files, name, needs[0]))


def needs_of(files: Files, name: str) -> list[str]:
    """List the files that a side table reads.

    Args:
        files: Files of the profile.
        name: Key of ``SIDE_TABLES``.

    Returns:
        Their names, each once.

    Raises:
        InputError: A pattern has a name that there is not.
    """
    patterns = SIDE_TABLES[name].needs
    found = [file for pattern in patterns for file in _files_of(files, name, pattern)]
    return list(dict.fromkeys(found))


def code_of(name: str) -> str:
    """Hash the module that declares a side table.

    The one script of the rule does not change with it, so this is how Snakemake notices.
    """
    module = SIDE_TABLES[name].place.partition(":")[0]
    spec = importlib.util.find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    return hashlib.sha256(Path(spec.origin).read_bytes()).hexdigest()[:16]


def _files_of(files: Files, table: str, pattern: str) -> list[str]:
    """Fill the names of a pattern in every combination."""
    fields = list(dict.fromkeys(_FIELD.findall(pattern)))
    paths = [f"{files.root}/{pattern}"]
    for name, of in fields:
        field = f"{{{name}:{of}}}" if of else f"{{{name}}}"
        values = _values(files, table, name, of)
        paths = [path.replace(field, value) for path in paths for value in values]
    return paths


def _values(files: Files, table: str, name: str, of: str) -> Sequence[str]:
    """List what a name of a pattern stands for."""
    if name == "run" and of:
        return files.runs_of(of)
    if name == "table" and of:
        made = of in files.tables or (of in SIDE_TABLES and has_rows(files, of))
        return [of] if made else []
    if name not in NAMES or of:
        known = ", ".join([*NAMES, "run:<table>", "table:<name>"])
        field = f"{name}:{of}" if of else name
        raise InputError(SIDE_TABLES[table].place, f"needs: {field!r} is not one of {known}")
    return NAMES[name](files)
