"""The jobs of a run and how large each is, from its configuration alone.

Names and counts come from the functions that ``workflow/rules/common.smk`` asks too; a job is named
like the file below ``<root>/benchmarks`` that its measurement is written to.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from baselines.groundtruth.batches import batches_of
from baselines.groundtruth.methods import METHODS, frame_methods, graph_methods, stages_of
from baselines.localizers.names import backbone_of
from baselines.references.registry import answered_by, data_sets, has_structure
from synfeal.config import Config, Design, Experiment, Run
from synfeal.config.experiments import FROM_SCRATCH, INJECTED
from synfeal.config.models import CameraConfig
from synfeal.dataset.sequences import sequences_of
from synfeal.report.cost.disk import (
    packed_bytes,
    picture_bytes,
    pose_bytes,
    scene_bytes,
    score_bytes,
)
from synfeal.report.cost.networks import pretext_work, training_work

SPLITS = ("train", "test")
# What the size of a job counts; stages under one law cost the same per unit.
RENDERING, TRAINING = "rendering", "training"
UNITS: dict[str, tuple[str, ...]] = {
    RENDERING: ("frames", "Msamples"),
    TRAINING: ("layer steps", "TFLOP"),
    "render_speed": ("image sizes",),
    "plan": ("frames",),
    "pack": ("MB",),
    "dataset": ("frames",),
    "labels": ("rows",),
    "sfm": ("Mpx",),
    "rgbd": ("Mpx",),
    **dict.fromkeys(frame_methods(), ("Mpx",)),
    **dict.fromkeys(graph_methods(), ("frames",)),
    "chain": ("frames",),
    "score": ("frames",),
    "descriptors": ("frames",),
    "features": ("Mpx",),
    "correspondences": ("frames",),
    "image_references": ("frames",),
    "structure_references": ("frames",),
    "claims": ("frames",),
}
# Stages from the meshes to the report.
STAGES = (
    *("scene", "plan", "render_packed", "pack", "render", "dataset", "labels", "sfm"),
    *("rgbd", *frame_methods(), *graph_methods(), "chain", "pretrain", "train", "score"),
    *("descriptors", "features", "correspondences", "image_references", "structure_references"),
    "external_reference",
    *(
        "coverage",
        "cell_depth",
        "render_speed",
        "tables",
        "claims",
        "figures",
        "summary",
        "provenance",
        "report",
        "report_document",
    ),
)
SIDE_TABLES = (
    *("recall", "assistance", "label_error", "speed_vs_error", "hard_cases"),
    *("references", "document"),
)
LAW_OF = {
    "render": RENDERING,
    "render_packed": RENDERING,
    "pretrain": TRAINING,
    "train": TRAINING,
}
# Bytes of memory per pixel of a batch: what peaks differ by between profiles (docs/cost.md).
HELD_PER_PX = {"sfm": 10, "rgbd": 26, **dict.fromkeys(frame_methods(), 26)}

# Of a frame's global descriptors, of one SIFT feature, of a test frame's matches (measured: 800).
DESCRIPTOR_BYTES, FEATURE_BYTES, MATCHES_BYTES = 4 * (256 + 192), 128 + 24, 800 * 56


@dataclass(frozen=True)
class Job:
    """One job.

    Attributes:
        stage: folder or file of ``<root>/benchmarks`` that measures it.
        name: path below that, without ``.tsv``; empty where the stage is a file.
        size: in the units of its law, the main one last; empty where all jobs are alike.
        disk_bytes: what it leaves behind.
        held_bytes: data it holds in memory at once.
    """

    stage: str
    name: str
    size: tuple[float, ...] = ()
    disk_bytes: float = 0.0
    held_bytes: float = 0.0

    @property
    def key(self) -> tuple[str, str]:
        """Stage and name."""
        return self.stage, self.name

    @property
    def law(self) -> str:
        """The law that its cost follows."""
        return LAW_OF.get(self.stage, self.stage)


def run_jobs(config: Config, experiments: tuple[Experiment, ...]) -> list[Job]:
    """Every job of the target ``all``, in the order of the stages."""
    runs = _design(config, experiments).runs
    jobs = [
        *experiment_jobs(config, experiments, runs),
        *_references(config, experiments),
        *_evidence(config, experiments, runs),
    ]
    return sorted(jobs, key=lambda job: STAGES.index(job.stage))


def known_jobs(config: Config, experiments: tuple[Experiment, ...]) -> list[Job]:
    """The same, and those that only the target ``datasets`` adds: network frames as image files."""
    counts = _largest(config, _scenes(config, experiments))
    extra = [job for scene in counts for job in _image_files(config, scene, "network", counts)]
    return [*run_jobs(config, experiments), *extra]


def table_keys(
    config: Config, experiments: tuple[Experiment, ...]
) -> dict[str, frozenset[tuple[str, str]]]:
    """The jobs each table needs; table 5 is read against the pretrained runs of the same sizes."""
    scenes = sorted({e.scene for e in experiments})
    needed = {"table1_meshes": {("scene", scene) for scene in scenes}}
    design = _design(config, experiments)
    for table in design.tables:
        rows = design.rows_of(table)
        if table == FROM_SCRATCH:
            rows += [row.pretrained for row in rows]
        jobs = experiment_jobs(config, tuple(rows), design.table_runs(table))
        needed[table] = {job.key for job in jobs}
    return {table: frozenset(keys | {("tables", table)}) for table, keys in needed.items()}


def experiment_jobs(
    config: Config, experiments: tuple[Experiment, ...], runs: Sequence[Run]
) -> list[Job]:
    """Every job from the meshes to the scores of some table rows and their runs, each once."""
    jobs = [
        *_collection(config, experiments),
        *_label_sets(config, experiments),
        *_trainings(config, runs),
    ]
    return list({job.key: job for job in jobs}.values())


def _design(config: Config, experiments: tuple[Experiment, ...]) -> Design:
    return Design(rows=experiments, repetitions=config.training.repetitions)


def _scenes(config: Config, experiments: Iterable[Experiment]) -> dict[str, tuple[str, ...]]:
    """Scenes and the splits of them that are needed: of rooms to pretrain on just the training."""
    experiments = tuple(experiments)
    scenes: dict[str, tuple[str, ...]] = {e.scene: SPLITS for e in experiments}
    if any(e.init == "pretrained" for e in experiments):
        scenes |= dict.fromkeys(config.rooms, ("train",))
    return dict(sorted(scenes.items()))


def _largest(config: Config, scenes: Iterable[str]) -> dict[str, dict[str, int]]:
    """Frames that are rendered for the localizers, by scene and split."""
    return {s: {split: config.n_largest(s, split) for split in SPLITS} for s in scenes}


def _collection(config: Config, experiments: tuple[Experiment, ...]) -> Iterator[Job]:
    scenes = _scenes(config, experiments)
    largest = _largest(config, scenes)
    for scene, splits in scenes.items():
        yield Job("scene", scene, (), scene_bytes(config.scenes[scene].path))
        for split in splits:
            frames = largest[scene][split]
            yield Job("plan", f"{scene}/{split}", (frames,), pose_bytes(frames))
            frame_bytes = packed_bytes(frames, config.network.input_px)
            yield Job("pack", f"{scene}/{split}", (frame_bytes / 1e6,), frame_bytes)
        yield from _packed_shards(config, scene, splits, largest[scene])
    counts = _groundtruth_frames(config, experiments)
    for scene in counts:
        yield from _image_files(config, scene, "groundtruth", counts)


def _packed_shards(
    config: Config, scene: str, splits: tuple[str, ...], counts: dict[str, int]
) -> Iterator[Job]:
    """Rendering straight into arrays; the parts are removed once they are joined."""
    for s in sequences_of(counts["train"], counts["test"], config.shard_frames):
        if s.split in splits:
            size = _rendering(config, config.network_camera, len(s))
            yield Job("render_packed", f"{scene}/{s.name}", size)


def _groundtruth_frames(
    config: Config, experiments: Iterable[Experiment]
) -> dict[str, dict[str, int]]:
    """Frames of the ground-truth camera by scene and split: those of the largest set estimated."""
    counts: dict[str, dict[str, int]] = {}
    for e in experiments:
        if e.labels in METHODS:
            frames = counts.setdefault(e.scene, dict.fromkeys(SPLITS, 0))
            for split in SPLITS:
                frames[split] = max(frames[split], config.n_frames(e.scene, e.size, split))
    return counts


def _image_files(
    config: Config, scene: str, camera_name: str, counts: dict[str, dict[str, int]]
) -> Iterator[Job]:
    """A data set as image files, with depth from the ground-truth camera."""
    depth = camera_name == "groundtruth"
    camera = config.groundtruth_camera if depth else config.network_camera
    train, test = (counts[scene][split] for split in SPLITS)
    for s in sequences_of(train, test, config.shard_frames):
        size = _rendering(config, camera, len(s))
        disk = picture_bytes(camera, len(s), depth)
        yield Job("render", f"{scene}/{camera_name}/{s.name}", size, disk)
    yield Job("dataset", f"{scene}/{camera_name}", (float(train + test),))


def _rendering(config: Config, camera: CameraConfig, frames: int) -> tuple[float, float]:
    samples = camera.width * camera.height * config.render.supersampling**2
    return frames, frames * samples / 1e6


def _label_sets(config: Config, experiments: tuple[Experiment, ...]) -> Iterator[Job]:
    for e in experiments:
        counts = {split: config.n_frames(e.scene, e.size, split) for split in SPLITS}
        names = ("synfeal", e.label_id) if e.labels in INJECTED else ("synfeal",)
        for split, frames in counts.items():
            for name in names:
                path = f"{e.scene}/{e.size}/{name}/{split}"
                # True labels are the first rows of the whole plan.
                read = config.n_largest(e.scene, split) if name == "synfeal" else frames
                yield Job("labels", path, (read + frames,), pose_bytes(frames))
        if e.labels in METHODS:
            yield from _estimated(config, e, counts)


def _estimated(config: Config, e: Experiment, counts: dict[str, int]) -> Iterator[Job]:
    camera = config.groundtruth_camera
    for split, n_frames in counts.items():
        for batch in batches_of(n_frames, config.groundtruth.batch_frames):
            name = f"{e.scene}/{e.size}/{split}/batch-{batch.index:03d}"
            pixels = len(batch) * camera.width * camera.height
            for stage in stages_of(e.labels):
                size = len(batch) if UNITS[stage] == ("frames",) else pixels / 1e6
                held = pixels * HELD_PER_PX.get(stage, 0)
                yield Job(stage, name, (size,), pose_bytes(len(batch)), held)
    frames = sum(counts.values())
    # Assisted and unassisted labels.
    yield Job("chain", f"{e.scene}/{e.size}/{e.labels}", (frames,), 2 * pose_bytes(frames))


def _trainings(config: Config, runs: Sequence[Run]) -> Iterator[Job]:
    hypers = {str(name): hyper for name, hyper in config.localizers.items()}
    pretrained = {backbone_of(r.model, config.network) for r in runs if r.init == "pretrained"}
    for backbone in sorted(pretrained):
        work = pretext_work(backbone, config.network)
        samples = config.pretraining.samples_seen if config.rooms else 0
        held = config.pretraining.frames * len(config.rooms)
        batch = config.pretraining.batch_size
        size = work.size(samples, batch, 0)
        memory = packed_bytes(held, config.network.input_px) + work.held_bytes(batch)
        yield Job("pretrain", backbone, size, work.parameter_bytes, memory)
    for run in runs:
        train, test = (config.n_frames(run.scene, run.size, split) for split in SPLITS)
        work = training_work(run.model, config.network, hypers[run.model])
        batch = config.training.batch_size
        size = work.size(config.training.samples_seen[run.size], batch, test)
        memory = packed_bytes(train, config.network.input_px) + work.held_bytes(batch)
        yield Job("train", run.directory, size, work.parameter_bytes, memory)
        yield Job("score", run.directory, (test,), score_bytes(test))


def _references(config: Config, experiments: tuple[Experiment, ...]) -> Iterator[Job]:
    """What the localizers are compared with: once per scene, per size, and per data set."""
    external = config.references.external
    for scene, largest in _largest(config, sorted({e.scene for e in experiments})).items():
        frames = sum(largest.values())
        yield Job("descriptors", scene, (frames,), frames * DESCRIPTOR_BYTES)
    for scene, size in sorted({(e.scene, e.size) for e in experiments}):
        if has_structure(experiments, scene, size):
            counts = {split: config.n_frames(scene, size, split) for split in SPLITS}
            camera = config.groundtruth_camera
            for split, frames in counts.items():
                pixels = frames * camera.width * camera.height
                held = frames * config.references.max_features * FEATURE_BYTES
                yield Job("features", f"{scene}/{size}/{split}", (pixels / 1e6,), 0, held)
            matches = counts["test"] * MATCHES_BYTES
            yield Job("correspondences", f"{scene}/{size}", (counts["test"],), matches)
    for scene, size, labels in data_sets(experiments):
        n_test = config.n_frames(scene, size, "test")
        groups = ["image", *(["structure"] if has_structure(experiments, scene, size) else [])]
        for group in groups:
            disk = pose_bytes(n_test) + score_bytes(n_test)
            yield Job(f"{group}_references", f"{scene}/{size}/{labels}", (n_test,), disk)
        for name in answered_by(experiments, (scene, size, labels), external):
            if name in external:
                yield Job("external_reference", f"{scene}/{size}/{labels}/{name}", (), disk)


def _evidence(
    config: Config, experiments: tuple[Experiment, ...], runs: Sequence[Run]
) -> Iterator[Job]:
    tables = ["table1_meshes", *sorted({e.table for e in experiments})]
    for name in (*tables, *SIDE_TABLES):
        yield Job("tables", name)
    for scene in sorted({e.scene for e in experiments}):
        yield Job("cell_depth", scene)
        yield Job("render_speed", scene, (config.render_speed.sizes,))
        for split in SPLITS:
            yield Job("coverage", f"{scene}/{split}")
    scored = sum(config.n_frames(run.scene, run.size, "test") for run in runs)
    yield Job("claims", "", (scored,))
    for stage in ("figures", "summary", "provenance", "report", "report_document"):
        yield Job(stage, "")
