"""A whole data set from one mesh: what ``synfeal collect`` does."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import cast

from tqdm import tqdm

from synfeal.config.models import CameraConfig, CollectionConfig, SceneConfig
from synfeal.dataset.contact_sheet import write_contact_sheet
from synfeal.dataset.directories import atomic_directory, refuse_existing
from synfeal.dataset.manifest import write_manifest
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.dataset.sequences import Sequence, sequences_of
from synfeal.dataset.sevenscenes import frame_paths, write_sequence, write_splits
from synfeal.errors import InputError
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.planning.plan import plan_split, sampling_box_of
from synfeal.render import open_renderer
from synfeal.render.base import Renderer
from synfeal.seeds import generator_of

SEQUENCE_FRAMES = 1000  # as in 7-Scenes

log = logging.getLogger("synfeal")


@dataclass(frozen=True)
class CollectJob:
    """Everything a collection depends on; ``scene.source`` is ``mesh``."""

    scene: SceneConfig
    collection: CollectionConfig
    camera: CameraConfig
    n_train: int
    n_test: int
    seed: int
    with_depth: bool
    out: Path


def collect(job: CollectJob) -> None:
    """Plan and render a data set into ``job.out``, which appears when it is complete.

    Besides the 7-Scenes files it holds the poses as tables (``train.csv``, ``test.csv``), the
    manifest and ``preview.png``.

    Raises:
        InputError: no frames asked for, ``out`` is not empty, the mesh cannot be used, or no
            admissible pose is found.
    """
    if job.n_train < 1 or job.n_test < 0:
        raise InputError(
            f"collect: {job.n_train} training and {job.n_test} test frames asked for;"
            " --frames must be at least 1 and --test-frames at least 0"
        )
    refuse_existing(job.out)
    mesh = load_mesh(cast(Path, job.scene.path), job.scene.up_axis, job.scene.unit_m)
    plans = plan_splits(mesh, job)
    sequences = sequences_of(job.n_train, job.n_test, SEQUENCE_FRAMES)
    with atomic_directory(job.out) as directory:
        for split, plan in plans.items():
            write_pose_table(directory / f"{split}.csv", plan)
        with open_renderer(mesh, job.camera) as renderer:
            render_sequences(renderer, plans, sequences, directory, job.with_depth)
        write_splits(directory, sequences)
        write_manifest(directory, sequences, job.camera, _origin(job))
        directories = [directory / sequence.name for sequence in sequences]
        write_contact_sheet(frame_paths(directories, "color.png"), directory / "preview.png")


def plan_splits(mesh: TexturedMesh, job: CollectJob) -> dict[str, PoseTable]:
    """Plans of the splits that have frames, each with random numbers of its own."""
    box = sampling_box_of(job.scene, mesh.bounds_m, str(job.scene.path))
    caster = RayCaster(*mesh.merged())
    counts = {"train": job.n_train, "test": job.n_test}
    return {
        split: plan_split(
            caster, box, job.scene, job.collection, count, generator_of(job.seed, "plan", split)
        )
        for split, count in counts.items()
        if count
    }


def render_sequences(
    renderer: Renderer,
    plans: dict[str, PoseTable],
    sequences: Iterable[Sequence],
    directory: Path,
    with_depth: bool,
) -> None:
    """Render all sequences with one progress bar: rate and time left."""
    with tqdm(total=sum(map(len, plans.values())), unit="frame", desc="collect") as progress:
        for sequence in sequences:
            poses = plans[sequence.split].between(sequence.start, sequence.stop)
            out = directory / sequence.name
            write_sequence(renderer, poses, out, with_depth, progress.update)


def _origin(job: CollectJob) -> dict[str, object]:
    """Where the data set comes from, for the manifest."""
    return {
        "scene": job.scene.model_dump(mode="json", exclude={"sizes"}),
        "collection": job.collection.model_dump(mode="json"),
        "seed": job.seed,
    }
