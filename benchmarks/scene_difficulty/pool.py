"""Tasks in fresh processes, with a bar that shows the time left."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from typing import Any

from tqdm import tqdm


def run_tasks(
    function: Callable[..., Any], tasks: Sequence[tuple[Any, ...]], jobs: int, title: str
) -> list[Any]:
    """Call ``function(*task)`` for every task in ``jobs`` processes; results in order of tasks.

    Processes are spawned anew for every call, because the renderer and Open3D must not be loaded
    into one process. The first exception is raised, after tasks that already run have ended.
    """
    if not tasks:
        return []
    context = multiprocessing.get_context("spawn")
    workers = min(jobs, len(tasks))
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        futures = [pool.submit(function, *task) for task in tasks]
        try:
            for future in tqdm(as_completed(futures), total=len(futures), desc=title):
                future.result()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
        return [future.result() for future in futures]
