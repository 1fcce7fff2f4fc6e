"""A benchmark as a table of settings: what is measured, under which values, with which seeds.

A sweep is a YAML file. ``given`` holds what all its runs share, ``vary`` its axes: a list holds the
values of the setting that the axis is named after, a mapping names groups of changes. Runs are all
combinations. A setting is a dotted key of what the measure asks for; sections that a profile has
too, such as ``training``, start from the sweep's ``profile``. What the table lacks is measured,
each run in a process of its own, each row written at once.
"""

from __future__ import annotations

import hashlib
import multiprocessing
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple, Self

import pandas as pd
from pydantic import Field, ValidationError, model_validator
from tqdm import tqdm

from benchmarks.measures import MEASURES, open_measure
from benchmarks.rows import read_rows
from reproduction.config.load import load_config
from synfeal.config.load import describe, merge, read_yaml
from synfeal.config.types import Strict
from synfeal.errors import InputError
from synfeal.records.tables import write_frame

Value = str | int | float | bool | None
Changes = dict[str, Value]

RESULTS = "{results}"  # in a path: the directory given on the command line


class Shown(Strict):
    """A column of the page."""

    title: str = Field(description="head of the column, with its unit")
    digits: int = Field(3, description="after the decimal point")


class Picture(Strict):
    """Measured values against one of them: a panel for each of ``y``, a colour along ``group``."""

    x: str = Field(description="column along the horizontal axis")
    y: list[str] = Field(description="columns, one panel each")
    group: str | None = Field(None, description="axis whose values differ in colour, if any")
    across: str | None = Field(None, description="axis with a column of panels for each value")
    log: bool = Field(True, description="both axes logarithmic")
    average: list[str] = Field([], description="axes that a mark is the mean over")
    chosen: dict[str, str] = Field(
        {}, description="values in use, by axis: ringed, and what is both slower and worse is grey"
    )


class Sweep(Strict):
    """One benchmark."""

    title: str = Field(description="of the page")
    notes: str = Field(description="what a reader of the page has to know")
    measure: str = Field(description=f"one of {', '.join(MEASURES)}")
    profile: Path = Field(Path("config/config.yaml"), description="where settings start from")
    given: Changes = Field(default_factory=dict, description="what all runs share")
    vary: dict[str, list[Value] | dict[str, Changes]] = Field(description="the axes")
    seeds: int = Field(1, ge=1, description="runs of each combination, seeds 0, 1, ...")
    show: dict[str, Shown] = Field(description="measured columns of the page")
    picture: Picture | None = Field(None, description="what is drawn")

    @model_validator(mode="after")
    def _check_picture(self) -> Self:
        if self.picture is not None:
            for name in (self.picture.x, *self.picture.y):
                if name not in self.show:
                    raise ValueError(f"picture: '{name}' must be a column of `show`")
            single = {self.picture.group, self.picture.across} - {None}
            named = (*single, *self.picture.average, *self.picture.chosen)
            if not {*named} <= {*self.vary}:
                raise ValueError(f"picture: axes must be of {', '.join(self.vary)}")
        return self


class SweepRun(NamedTuple):
    """One row of the table that is to be measured."""

    key: dict[str, str]  # value of every axis, and the seed, as the table writes them
    case: Strict  # what the measure takes
    settings: str  # digest of the case: a row is taken for this run's only where it is the same


def read_sweep(path: Path) -> Sweep:
    """Read and check a sweep.

    Raises:
        InputError: the file cannot be used.
    """
    try:
        sweep = Sweep.model_validate(read_yaml(path))
    except ValidationError as error:
        raise InputError(path, describe(error)) from error
    if sweep.measure not in MEASURES:
        raise InputError(path, f"measure: '{sweep.measure}' must be one of {', '.join(MEASURES)}")
    return sweep


def runs_of(sweep: Sweep, results: Path, n_seeds: int) -> list[SweepRun]:
    """List all runs of a sweep, one seed after the other.

    Args:
        sweep: The sweep.
        results: Directory that ``{results}`` in its settings stands for.
        n_seeds: Seeds of each combination, from 0.

    Raises:
        InputError: a setting does not exist or its value is not allowed.
    """
    profile = load_config(sweep.profile).model_dump()
    return [
        _run({**axes, "seed": str(seed)}, changes, sweep, profile, results)
        for seed in range(n_seeds)
        for axes, changes in _combinations(sweep)
    ]


def _combinations(sweep: Sweep) -> Iterator[tuple[dict[str, str], Changes]]:
    """Yield combinations: the value of every axis as text, and all changes they stand for."""
    axes = [
        [(name, str(value), {name: value}) for value in values]
        if isinstance(values, list)
        else [(name, label, changes) for label, changes in values.items()]
        for name, values in sweep.vary.items()
    ]
    for chosen in product(*axes):
        changes = {key: value for *_, change in chosen for key, value in change.items()}
        yield {name: label for name, label, _ in chosen}, changes


def _run(
    key: dict[str, str], changes: Changes, sweep: Sweep, profile: Mapping[str, Any], results: Path
) -> SweepRun:
    model = open_measure(sweep.measure).case
    raw = {name: profile[name] for name in model.model_fields if name in profile}
    for name, value in {**sweep.given, **changes}.items():
        raw = merge(raw, _nested(name, value))
    try:
        settings = model.model_validate(raw).model_dump_json()
        case = model.model_validate(_filled(raw, str(results)))
    except ValidationError as error:
        where = ", ".join(f"{name} {value}" for name, value in key.items())
        raise InputError(f"{sweep.title} ({where})", describe(error)) from error
    return SweepRun(key, case, hashlib.sha256(settings.encode()).hexdigest()[:12])


def _nested(name: str, value: Value) -> dict[str, Any]:
    first, _, rest = name.partition(".")
    return {first: _nested(rest, value) if rest else value}


def _filled(value: Any, results: str) -> Any:
    """Fill the directory of results into every text of a nested mapping."""
    if isinstance(value, dict):
        return {key: _filled(inner, results) for key, inner in value.items()}
    return value.replace(RESULTS, results) if isinstance(value, str) else value


SETTINGS = "settings"


def read_table(path: Path, keys: Sequence[str]) -> pd.DataFrame:
    """Read all rows, keys as text and values as numbers; none where there is no table.

    Raises:
        InputError: the file is no table of such runs.
    """
    names = [*keys, SETTINGS]
    table = read_rows(path, names)
    if list(table.columns[: len(names)]) != names:
        raise InputError(path, f"must begin with the columns {', '.join(names)}", "move it away")
    return table


def run_missing(measure: str, runs: Sequence[SweepRun], table: Path, jobs: int) -> pd.DataFrame:
    """Measure the runs that the table lacks, and return the rows of all.

    Rows are added to the table one by one, so stopping loses only the runs under way.

    Args:
        measure: Name of what is measured, one of ``MEASURES``.
        runs: All runs of the sweep.
        table: CSV with the rows so far; made if need be.
        jobs: Number of runs at a time.

    Returns:
        The rows of ``runs``, in their order.

    Raises:
        InputError: a row of the table was made with other settings, or a run cannot be made.
    """
    keys = list(runs[0].key)
    done = {_key(row, keys): row[SETTINGS] for _, row in read_table(table, keys).iterrows()}
    for run in runs:
        if done.get(_key(run.key, keys), run.settings) != run.settings:
            where = ", ".join(f"{name} {value}" for name, value in run.key.items())
            raise InputError(table, f"the row of {where} was made with other settings", "remove it")
    missing = [run for run in runs if _key(run.key, keys) not in done]
    _measure(measure, missing, table, keys, jobs)
    rows = read_table(table, keys).set_index(keys, drop=False)
    wanted = [_key(run.key, keys) for run in runs]
    return rows.loc[wanted].reset_index(drop=True)


def _measure(
    measure: str, runs: Sequence[SweepRun], table: Path, keys: Sequence[str], jobs: int
) -> None:
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, mp_context=context, max_tasks_per_child=1) as pool:
        futures = {
            pool.submit(open_measure(measure).run, r.case, int(r.key["seed"])): r for r in runs
        }
        try:
            for future in tqdm(as_completed(futures), total=len(futures), desc=table.stem):
                run = futures[future]
                row = {**run.key, SETTINGS: run.settings, **future.result()}
                rows = read_table(table, keys)
                new = pd.DataFrame([row])
                write_frame(table, new if rows.empty else pd.concat([rows, new]), "%.5g")
        finally:
            pool.shutdown(cancel_futures=True)  # drops what is left after an error or Ctrl-C


def _key(row: pd.Series | dict[str, str], keys: Sequence[str]) -> tuple[str, ...]:
    return tuple(str(row[name]) for name in keys)
