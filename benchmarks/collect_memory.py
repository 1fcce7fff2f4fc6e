"""A long collection needs no more memory at its end than at its beginning.

``python -m benchmarks.collect_memory`` renders and writes small frames of a small room, as
``synfeal collect`` does, and prints the resident memory of the process on the way.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks.collect_faults import save_room
from synfeal.config.models import CameraConfig, CollectionConfig, RenderConfig, SceneConfig
from synfeal.dataset.collect import missing_tasks, plan_splits
from synfeal.dataset.collect_job import CollectJob, record_of
from synfeal.dataset.progress import Progress
from synfeal.dataset.render_pieces import Studio, render_tasks
from synfeal.dataset.shards import Shard
from synfeal.dataset.unfinished import DATA, open_unfinished, read_plans, scratch
from synfeal.mesh.load import load_mesh

EVERY = 2000
PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")


def resident_mb() -> float:
    """Resident memory of this process, MB."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * PAGE_BYTES / 1e6


class Watching(Progress):
    """Notes the resident memory every so many frames."""

    def __init__(self, n_frames: int, name: str) -> None:
        super().__init__(n_frames, name)
        self.count = 0
        self.resident_mb: dict[int, float] = {}
        self.begin = time.perf_counter()

    def update(self, n_frames: int = 1) -> None:
        """Some more frames are done."""
        before, self.count = self.count, self.count + n_frames
        if before // EVERY != self.count // EVERY:
            seconds = time.perf_counter() - self.begin
            self.resident_mb[self.count] = resident_mb()
            print(f"frame {self.count:,}: {resident_mb():.1f} MB, {seconds:.1f} s", flush=True)

    def shard_done(self, name: str, n_frames: int, seconds: float) -> None:
        """Said elsewhere."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Collect and print."""
    name = "python -m benchmarks.collect_memory"
    parser = argparse.ArgumentParser(prog=name, description=__doc__)
    parser.add_argument("--frames", type=int, default=20_000)
    n_frames = parser.parse_args(arguments).frames
    with tempfile.TemporaryDirectory() as folder:
        mesh_path = Path(folder) / "room.glb"
        save_room(mesh_path)
        job = CollectJob(
            scene=SceneConfig(source="mesh", path=mesh_path),
            collection=CollectionConfig(),
            camera=CameraConfig(width=64, height=48),
            render=RenderConfig(),
            n_train=n_frames,
            n_test=0,
            seed=0,
            with_depth=True,
            packed_px=None,
            out=Path(folder) / "set",
        )
        mesh = load_mesh(mesh_path)
        part = open_unfinished(job.out, record_of(job, mesh), lambda: plan_splits(mesh, job))
        tasks = missing_tasks(part / DATA, job, read_plans(part, job.counts), Shard(1, 1))
        with scratch(part) as temporary, Watching(n_frames, "collect") as progress:
            studio = Studio(mesh, job.camera, job.render, True, part / DATA, temporary)
            render_tasks(studio, tasks, 1, progress, lambda _: None)
    last = max(progress.resident_mb)
    early, late = progress.resident_mb[EVERY], progress.resident_mb[last]
    print(f"{early:.1f} MB at frame {EVERY:,}, {late:.1f} MB at frame {last:,}", end="")
    print(f": {late / early - 1:+.2%}")


if __name__ == "__main__":
    main()
