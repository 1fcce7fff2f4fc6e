"""``provenance.json``: commit, configuration, versions and machine of a run, and what it cost."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from torch import cuda

from synfeal.files import write_json
from synfeal.frames import records_of
from synfeal.provenance import CPU_INFO, processor_name, provenance
from synfeal.report.cost.measured import read_jobs, write_measured


def write_provenance(
    seed: int, config_hash: str, measured: Sequence[Path], results: Sequence[Path], out_json: Path
) -> None:
    """Write the record, and beside it what every job took, ``benchmarks.csv``.

    Args:
        seed: root of all seeds.
        config_hash: :func:`synfeal.provenance.config_hash` of the configuration.
        measured: what the jobs took, files below ``benchmarks`` beside the record.
        results: files, and directories of files, whose SHA-256 is recorded.
        out_json: ``synfeal.provenance.provenance``, ``machine``, ``stages`` (:func:`stages_of`) and
            ``files``: hashes by path relative to the record.
    """
    root = out_json.parent
    jobs = read_jobs(sorted(measured), root / "benchmarks")
    write_measured(jobs, root)
    found = {"machine": machine(), "stages": stages_of(jobs), "files": hashes(results, root)}
    write_json(out_json, provenance(seed, config_hash) | found)


def stages_of(jobs: pd.DataFrame) -> list[dict[str, Any]]:
    """What the jobs of each stage took together, the longest stage first.

    By column: ``stage``; ``jobs``, how many; ``seconds`` of all of them, ``median_seconds`` of one;
    ``peak_mb``, the largest resident memory of any, None where all were too short to measure.
    """
    stages = jobs.groupby("stage").agg(
        jobs=("wall_s", "size"),
        seconds=("wall_s", "sum"),
        median_seconds=("wall_s", "median"),
        peak_mb=("peak_mb", "max"),
    )
    stages = stages.reset_index().sort_values(["seconds", "stage"], ascending=[False, True])
    peak_mb = stages.peak_mb.astype(object).where(stages.peak_mb.notna(), None)
    return records_of(stages.assign(peak_mb=peak_mb))


def hashes(results: Iterable[Path], root: Path) -> dict[str, str]:
    """SHA-256 of files, and of all files in directories, by path relative to ``root``."""
    paths = [p for path in results for p in (sorted(path.iterdir()) if path.is_dir() else [path])]
    return {
        path.relative_to(root).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in paths
        if not path.name.startswith(".")
    }


def machine() -> dict[str, Any]:
    """Processor, its usable cores, memory in GiB, and the GPU (None without one)."""
    pages, page_bytes = os.sysconf("SC_PHYS_PAGES"), os.sysconf("SC_PAGE_SIZE")
    return {
        "processor": processor_name(CPU_INFO),
        "usable_cores": len(os.sched_getaffinity(0)),
        "memory_gib": round(pages * page_bytes / 2**30, 1),
        "gpu": cuda.get_device_name() if cuda.is_available() else None,
    }
