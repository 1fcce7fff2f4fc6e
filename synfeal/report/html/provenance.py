"""``provenance.json``: commit, configuration, versions and machine of a run, and what it cost."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from torch import cuda

from synfeal.files import write_json
from synfeal.provenance import CPU_INFO, processor_name, provenance
from synfeal.report.html.stages import read_stages


def write_provenance(
    seed: int,
    config_hash: str,
    measured: Iterable[Path],
    results: Iterable[Path],
    out_json: Path,
) -> None:
    """Write the record.

    Args:
        seed: root of all seeds.
        config_hash: :func:`synfeal.provenance.config_hash` of the configuration.
        measured: what the jobs took, files below ``benchmarks`` beside the record.
        results: files, and directories of files, whose SHA-256 is recorded.
        out_json: ``synfeal.provenance.provenance``, ``machine``, ``stages`` and ``files``: hashes
            by path relative to the record.

    Raises:
        InputError: a measurement cannot be read.
    """
    stages = [asdict(stage) for stage in read_stages(measured, out_json.parent / "benchmarks")]
    record = provenance(seed, config_hash)
    files = hashes(results, out_json.parent)
    write_json(out_json, record | {"machine": machine(), "stages": stages, "files": files})


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
