"""How large a job is, from the name of its measurement and the configuration.

Which jobs there are is Snakemake's to say (``dry_run.py``, or the measurements of a run). A job is
named like the file below ``<root>/benchmarks`` that its measurement is written to.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from baselines.groundtruth.batches import batches_of
from baselines.groundtruth.methods import METHODS, frame_methods, graph_methods
from baselines.localizers.names import BackboneName
from synfeal.config import Config, Design, Experiment
from synfeal.config.models import CameraConfig, ModelName
from synfeal.dataset.sequences import sequences_of
from synfeal.report.cost.disk import (
    packed_bytes,
    picture_bytes,
    pose_bytes,
    scene_bytes,
    score_bytes,
)
from synfeal.report.cost.networks import Work, pretext_work, training_work

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
    "tracks": ("frames",),
    "image_references": ("frames",),
    "structure_references": ("frames",),
    "claims": ("frames",),
}
# Stages from the meshes to the report; others come last.
STAGES = (
    *("scene", "plan", "render_packed", "pack", "render", "dataset", "labels", "sfm"),
    *("rgbd", *frame_methods(), *graph_methods(), "chain", "pretrain", "train", "score"),
    *("descriptors", "features", "correspondences", "tracks"),
    *("image_references", "structure_references"),
    "external_reference",
    *(
        "coverage",
        "cell_depth",
        "render_speed",
        "collection_speed",
        "tables",
        "claims",
        "figures",
        "summary",
        "provenance",
    ),
    *("report", "report_document"),
)
LAW_OF = {
    **dict.fromkeys(("render", "render_packed"), RENDERING),
    **dict.fromkeys(("pretrain", "train"), TRAINING),
}
# Bytes of memory per pixel of a batch: what peaks differ by between profiles (docs/cost.md).
HELD_PER_PX = {"sfm": 10, "rgbd": 26, **dict.fromkeys(frame_methods(), 26)}

# Of a frame: global descriptors, one of its SIFT features, its matches, its observations.
DESCRIPTOR_BYTES, FEATURE_BYTES = 4 * (256 + 192), 128 + 24
MATCHES_BYTES, TRACKS_BYTES = 800 * 56, 200 * 32 + 520 * 8


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


@dataclass(frozen=True)
class Profile:
    """A configuration and its design."""

    config: Config
    experiments: tuple[Experiment, ...]


Size = tuple[tuple[float, ...], float, float]  # of a Job: size, disk_bytes, held_bytes


def jobs_of(profile: Profile, keys: Iterable[tuple[str, str]]) -> list[Job]:
    """The jobs of these names that the profile may have, in the order of the stages."""
    made = [job for key in keys if (job := job_of(profile, *key)) is not None]
    order = {stage: place for place, stage in enumerate(STAGES)}
    return sorted(made, key=lambda job: order.get(job.stage, len(order)))


def job_of(profile: Profile, stage: str, name: str) -> Job | None:
    """The job of this name; None if the profile has no such scene, size, sequence or network."""
    size_of = SIZES.get(stage)
    if size_of is None:
        return Job(stage, name)
    try:
        return Job(stage, name, *size_of(profile, *name.split("/")))
    except (KeyError, IndexError, TypeError, ValueError, StopIteration):
        return None  # the name is of another design, or of an older workflow


def _scene(profile: Profile, scene: str) -> Size:
    return (), scene_bytes(profile.config.scenes[scene].path), 0.0


def _plan(profile: Profile, scene: str, split: str) -> Size:
    frames = profile.config.n_largest(scene, split)
    return (frames,), pose_bytes(frames), 0.0


def _pack(profile: Profile, scene: str, split: str) -> Size:
    frames = profile.config.n_largest(scene, split)
    n_bytes = packed_bytes(frames, profile.config.network.input_px)
    return (n_bytes / 1e6,), n_bytes, 0.0


def _render_packed(profile: Profile, scene: str, sequence: str) -> Size:
    """Rendering straight into arrays; the parts are removed once they are joined."""
    frames = _frames_of(profile, _largest(profile, scene), sequence)
    return _rendering(profile.config, profile.config.network_camera, frames), 0.0, 0.0


def _render(profile: Profile, scene: str, camera_name: str, sequence: str) -> Size:
    """Image files, with depth from the ground-truth camera."""
    depth = camera_name == "groundtruth"
    camera = profile.config.groundtruth_camera if depth else profile.config.network_camera
    frames = _frames_of(profile, _written(profile, scene, camera_name), sequence)
    return _rendering(profile.config, camera, frames), picture_bytes(camera, frames, depth), 0.0


def _dataset(profile: Profile, scene: str, camera_name: str) -> Size:
    return (float(sum(_written(profile, scene, camera_name))),), 0.0, 0.0


def _largest(profile: Profile, scene: str) -> tuple[int, int]:
    """Training and test frames of the largest set."""
    train, test = (profile.config.n_largest(scene, split) for split in SPLITS)
    return train, test


def _written(profile: Profile, scene: str, camera_name: str) -> tuple[int, int]:
    """The same as image files: of the ground-truth camera those of the largest set estimated."""
    if camera_name == "network":
        return _largest(profile, scene)
    config = profile.config
    sizes = [e.size for e in profile.experiments if e.scene == scene and e.labels in METHODS]
    train, test = (max(config.n_frames(scene, s, split) for s in sizes) for split in SPLITS)
    return train, test


def _frames_of(profile: Profile, counts: tuple[int, int], name: str) -> int:
    return next(
        len(s) for s in sequences_of(*counts, profile.config.shard_frames) if s.name == name
    )


def _rendering(config: Config, camera: CameraConfig, frames: int) -> tuple[float, float]:
    samples = camera.width * camera.height * config.render.supersampling**2
    return frames, frames * samples / 1e6


def _labels(profile: Profile, scene: str, size: str, labels: str, split: str) -> Size:
    """True labels are the first rows of the whole plan."""
    frames = profile.config.n_frames(scene, size, split)
    read = profile.config.n_largest(scene, split) if labels == "synfeal" else frames
    return (read + frames,), pose_bytes(frames), 0.0


def _batch(stage: str) -> Callable[..., Size]:
    def size_of(profile: Profile, scene: str, size: str, split: str, batch: str) -> Size:
        config, camera = profile.config, profile.config.groundtruth_camera
        frames = config.n_frames(scene, size, split)
        index = int(batch.removeprefix("batch-"))
        length = len(batches_of(frames, config.groundtruth.batch_frames)[index])
        pixels = length * camera.width * camera.height
        amount = length if UNITS[stage] == ("frames",) else pixels / 1e6
        return (amount,), pose_bytes(length), pixels * HELD_PER_PX.get(stage, 0)

    return size_of


def _chain(profile: Profile, scene: str, size: str, labels: str) -> Size:
    frames = sum(profile.config.n_frames(scene, size, split) for split in SPLITS)
    return (frames,), 2 * pose_bytes(frames), 0.0  # assisted and unassisted labels


def _pretrain(profile: Profile, backbone: BackboneName) -> Size:
    config = profile.config
    samples = config.pretraining.samples_seen if config.rooms else 0
    frames = config.pretraining.frames * len(config.rooms)
    work = pretext_work(backbone, config.network)
    return _learning(config, work, samples, config.pretraining.batch_size, 0, frames)


def _train(profile: Profile, scene: str, size: str, *run: str) -> Size:
    config, model = profile.config, _model(run)
    train, test = (config.n_frames(scene, size, split) for split in SPLITS)
    work = training_work(model, config.network, config.localizers[model])
    samples, batch = config.training.samples_seen[size], config.training.batch_size
    return _learning(config, work, samples, batch, test, train)


def _model(run: tuple[str, ...]) -> ModelName:
    _, _, model, _ = run  # labels, init, model, seed
    return model  # type: ignore[return-value]


def _learning(
    config: Config, work: Work, samples: int, batch: int, predicted: int, frames: int
) -> Size:
    held = packed_bytes(frames, config.network.input_px) + work.held_bytes(batch)
    return work.size(samples, batch, predicted), work.parameter_bytes, held


def _score(profile: Profile, scene: str, size: str, *run: str) -> Size:
    frames = profile.config.n_frames(scene, size, "test")
    return (frames,), score_bytes(frames), 0.0


def _descriptors(profile: Profile, scene: str) -> Size:
    frames = sum(_largest(profile, scene))
    return (frames,), frames * DESCRIPTOR_BYTES, 0.0


def _features(profile: Profile, scene: str, size: str, split: str) -> Size:
    config, camera = profile.config, profile.config.groundtruth_camera
    frames = config.n_frames(scene, size, split)
    held = frames * config.references.max_features * FEATURE_BYTES
    return (frames * camera.width * camera.height / 1e6,), 0.0, held


def _correspondences(profile: Profile, scene: str, size: str) -> Size:
    frames = profile.config.n_frames(scene, size, "test")
    return (frames,), frames * MATCHES_BYTES, 0.0


def _tracks(profile: Profile, scene: str, size: str) -> Size:
    frames = profile.config.n_frames(scene, size, "train")
    return (frames,), frames * TRACKS_BYTES, 0.0


def _reference(profile: Profile, scene: str, size: str, labels: str) -> Size:
    frames = profile.config.n_frames(scene, size, "test")
    return (frames,), pose_bytes(frames) + score_bytes(frames), 0.0


def _render_speed(profile: Profile, scene: str) -> Size:
    return (profile.config.render_speed.sizes,), 0.0, 0.0


def _claims(profile: Profile, _: str) -> Size:
    config = profile.config
    runs = Design(rows=profile.experiments, repetitions=config.training.repetitions).runs
    return (sum(config.n_frames(run.scene, run.size, "test") for run in runs),), 0.0, 0.0


SIZES: dict[str, Callable[..., Size]] = {
    "scene": _scene,
    "plan": _plan,
    "pack": _pack,
    "render_packed": _render_packed,
    "render": _render,
    "dataset": _dataset,
    "labels": _labels,
    **{stage: _batch(stage) for stage in ("sfm", "rgbd", *frame_methods(), *graph_methods())},
    "chain": _chain,
    "pretrain": _pretrain,
    "train": _train,
    "score": _score,
    "descriptors": _descriptors,
    "features": _features,
    "correspondences": _correspondences,
    "tracks": _tracks,
    **dict.fromkeys(("image_references", "structure_references"), _reference),
    "render_speed": _render_speed,
    "claims": _claims,
}
