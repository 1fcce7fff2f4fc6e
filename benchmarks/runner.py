"""Measuring what a table lacks: each run in a process of its own, each row written at once."""

from __future__ import annotations

import multiprocessing
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

import pandas as pd
from tqdm import tqdm

from benchmarks.measures import open_measure
from benchmarks.sweep import Run
from synfeal.errors import InputError
from synfeal.files import atomic_path

SETTINGS = "settings"


def read_table(path: Path, keys: Sequence[str]) -> pd.DataFrame:
    """All rows, keys as text and measured values as numbers; none where there is no table.

    Raises:
        InputError: the file is no table of such runs.
    """
    names = [*keys, SETTINGS]
    if not path.exists():
        return pd.DataFrame(columns=names, dtype=str)
    try:
        table = pd.read_csv(path, dtype=dict.fromkeys(names, str), keep_default_na=False)
    except (ValueError, OSError) as error:
        raise InputError(f"{path}: cannot be read as a table ({error})") from None
    if list(table.columns[: len(names)]) != names:
        raise InputError(f"{path}: must begin with the columns {', '.join(names)}; move it away")
    return table


def run_missing(measure: str, runs: Sequence[Run], table: Path, jobs: int) -> pd.DataFrame:
    """The rows of these runs, in their order, after those that the table lacks were measured.

    Args:
        measure: one of ``MEASURES``.
        runs: all of one sweep.
        table: CSV; rows are added one by one, so stopping loses only the runs under way.
        jobs: runs side by side.

    Raises:
        InputError: a row of the table was made with other settings, or a run cannot be made.
    """
    keys = list(runs[0].key)
    done = {_key(row, keys): row[SETTINGS] for _, row in read_table(table, keys).iterrows()}
    for run in runs:
        if done.get(_key(run.key, keys), run.settings) != run.settings:
            where = ", ".join(f"{name} {value}" for name, value in run.key.items())
            raise InputError(f"{table}: the row of {where} was made with other settings; remove it")
    missing = [run for run in runs if _key(run.key, keys) not in done]
    _measure(measure, missing, table, keys, jobs)
    rows = read_table(table, keys).set_index(keys, drop=False)
    wanted = [_key(run.key, keys) for run in runs]
    return rows.loc[wanted].reset_index(drop=True)


def _measure(
    measure: str, runs: Sequence[Run], table: Path, keys: Sequence[str], jobs: int
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
                write_table(table, new if rows.empty else pd.concat([rows, new]))
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise


def write_table(path: Path, rows: pd.DataFrame) -> None:
    """The table as CSV, five digits of each number."""
    with atomic_path(path) as temporary:
        rows.to_csv(temporary, index=False, float_format="%.5g", lineterminator="\n")


def _key(row: pd.Series | dict[str, str], keys: Sequence[str]) -> tuple[str, ...]:
    return tuple(str(row[name]) for name in keys)
