"""A whole data set from one mesh, in three steps that can be interrupted: what ``collect`` does.

Plan, frames, finish: all write into one unfinished directory (``unfinished.py``), and every step
does only what is missing there. The bytes of the data set are the same in however many shards,
processes and attempts it was made.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.blank import refuse_blank, refuse_invisible
from synfeal.dataset.collect_job import CollectJob, record_of
from synfeal.dataset.directories import refuse_existing, writing_to
from synfeal.dataset.finish import archive_whole, complete
from synfeal.dataset.progress import Progress
from synfeal.dataset.render_pieces import Studio, Task, render_tasks
from synfeal.dataset.render_sequence import resolved
from synfeal.dataset.sequences import Sequence
from synfeal.dataset.shards import Shard, pieces_of, sequences_within
from synfeal.dataset.unfinished import (
    DATA,
    Plans,
    finish,
    locked,
    open_unfinished,
    read_plans,
    remove_remains,
    remove_temporary,
    scratch,
    unfinished_of,
)
from synfeal.errors import InputError
from synfeal.files import write_json
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import Triangles
from synfeal.planning.coverage import plan_coverage
from synfeal.planning.plan import plan_split, sampling_box_of
from synfeal.seeds import generator_of


def collect(job: CollectJob, workers: int = 1, shard: Shard | None = None) -> None:
    """Plan and render a data set into ``job.out``, which appears when it is complete.

    Besides the 7-Scenes files it holds the poses as tables (``train.csv``, ``test.csv``), the
    manifest, ``coverage.json`` and ``preview.png``. What an earlier attempt made is kept and not
    made again.

    Args:
        job: what to collect.
        workers: processes that render.
        shard: render only these frames, and leave the rest and the end to other commands.

    Raises:
        InputError: no frames asked for, ``out`` is not empty, the mesh cannot be used, no
            admissible pose is found, an attempt of another job stands in the way, or a file cannot
            be written.
    """
    job.check()
    if workers < 1:
        raise InputError(f"--workers: {workers} processes cannot render; at least 1 is needed")
    if remove_remains(job.out.resolve()):
        return
    refuse_existing(job.out)
    part = unfinished_of(job.out)
    with resumable(part):
        job = replace(job, render=resolved(job.render))  # machines that share must draw alike
        mesh = load_mesh(cast(Path, job.scene.path), job.scene.up_axis, job.scene.unit_m)
        open_unfinished(job.out, record_of(job, mesh), lambda: plan_splits(mesh, job))
        with locked(part, alone=shard is None):
            if shard is None:
                remove_temporary(part)
            record_coverage(part / DATA, mesh, job, read_plans(part, job.counts))
            render_missing(part, job, mesh, workers, shard or Shard(1, 1))
            if shard is None:
                complete(part / DATA, job)
                finish(part, job.out.resolve())


@contextmanager
def resumable(part: Path) -> Iterator[None]:
    """Say in one line what stopped a collection, and that what is done is not lost.

    Raises:
        InputError: a file could not be written.
        KeyboardInterrupt: with a message.
    """
    try:
        with writing_to(part, lambda: _kept(part)):
            yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(_kept(part)) from None


def _kept(part: Path) -> str:
    if not part.is_dir():
        return "nothing was kept"
    return f"what is done is kept in {part}; run the same command again to go on"


def plan_splits(mesh: TexturedMesh, job: CollectJob) -> Plans:
    """Plans of the splits that have frames, each with random numbers of its own.

    Raises:
        InputError: nothing can be planned, or images would be blank.
    """
    name = str(job.scene.path)
    refuse_invisible(mesh, job.camera, name)
    caster = RayCaster(*mesh.merged())
    box = sampling_box_of(job.scene, mesh.bounds_m, name)
    plans = {
        split: plan_split(
            caster,
            box,
            job.scene,
            job.collection,
            count,
            generator_of(job.seed, "plan", split),
            split,
        )
        for split, count in job.counts.items()
    }
    refuse_blank(caster, plans, job.camera, name)
    return plans


def record_coverage(data: Path, mesh: TexturedMesh, job: CollectJob, plans: Plans) -> None:
    """Write ``coverage.json``, what the plans of each split cover, unless it is there."""
    path = data / "coverage.json"
    if path.is_file():
        return
    box = sampling_box_of(job.scene, mesh.bounds_m, str(job.scene.path))
    surface = Triangles(*mesh.merged())
    write_json(
        path,
        {
            split: plan_coverage(surface, box, job.scene, plan, job.camera)
            for split, plan in plans.items()
        },
    )


def render_missing(
    part: Path, job: CollectJob, mesh: TexturedMesh, workers: int, shard: Shard
) -> None:
    """Render what is missing of a shard; with ``job.archived``, pack each sequence that is whole.

    Sequences that shards share are left to the command that finishes the data set.
    """
    data = part / DATA
    tasks = missing_tasks(data, job, read_plans(part, job.counts), shard)
    n_frames = sum(len(task.numbers) for task in tasks)
    own = sequences_within(job.sequences, *shard.bounds(job.n_train + job.n_test))

    def on_done(task: Task) -> None:
        if job.archived and task.piece.sequence in own:
            archive_whole(data, [task.piece.sequence], job.kinds)

    with scratch(part) as temporary, Progress(n_frames, "collect") as progress:
        studio = Studio(mesh, job.camera, job.render, job.with_depth, data, temporary)
        render_tasks(studio, tasks, workers, progress, on_done)


def missing_tasks(data: Path, job: CollectJob, plans: Plans, shard: Shard) -> list[Task]:
    """The pieces of a shard that miss frames, with what they miss."""
    pieces = pieces_of(job.sequences, *shard.bounds(job.n_train + job.n_test))
    tasks = []
    for index, piece in enumerate(pieces, start=1):
        numbers = piece.missing(data, job.kinds)
        if numbers:
            name = f"shard {index}/{len(pieces)}: {piece.name}"
            tasks.append(Task(name, piece, numbers, _poses(plans, piece.sequence, numbers)))
    return tasks


def _poses(plans: Plans, sequence: Sequence, numbers: list[int]) -> NDArray[np.float64]:
    """Poses (len(numbers), 4, 4) of frames counted within a sequence."""
    plan = plans[sequence.split].between(sequence.start, sequence.stop)
    return plan.world_from_cam[numbers]
