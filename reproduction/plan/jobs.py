"""Size of a job, from the name of its measurement and the configuration.

Which jobs there are is Snakemake's to say (``dry_run.py``, or the measurements of a run). A job is
named like the file below ``<root>/benchmarks`` that its measurement is written to.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple

import pandas as pd

from baselines.labels.batches import batches_of
from baselines.labels.methods import frame_methods, graph_methods
from reproduction.config.profile import Config
from reproduction.design.experiments import SHARES, Design, split_init
from reproduction.plan.networks import Work, pretext_work, training_work
from synfeal.dataset.sevenscenes import sequences_of

TRAINING = "training"
NUMBERS = {"other": math.nan, "size": math.nan, "disk_bytes": 0.0, "held_bytes": 0.0}
COLUMNS = ("stage", "job", "law", "unit", *NUMBERS)

# Bytes on disk, of the published small run (docs/cost.md): of a pose in a table, a scored frame, a
# frame's descriptors, matches and observations; per pixel of an image; of a procedural scene.
POSE, SCORED, DESCRIPTORS = 160, 360, 4 * (256 + 192)
MATCHES, TRACKS = 800 * 56, 200 * 32 + 520 * 8
COLOUR_PER_PX, DEPTH_PER_PX, POSE_FILE = 1.6, 0.5, 275
SCENE = 50e6
# Bytes of memory per pixel of a batch: what peaks differ by between profiles; of a SIFT feature.
SFM_PER_PX, RGBD_PER_PX, FEATURE = 10, 26, 128 + 24

Key = tuple[str, str]  # stage and name
Part = Mapping[str, str]
BATCH, RUN = "scene/size/split/batch", "scene/size/labels/init/model/seed"


class Profile(NamedTuple):
    """A configuration and its design."""

    config: Config
    design: Design


class Stage(NamedTuple):
    """Names of the jobs of a stage, and the units they count."""

    parts: str | None = None  # of a job's name; None where all jobs are alike, whatever their names
    unit: str = ""  # of the size
    splits: tuple[str, ...] = ("train", "test")  # whose frames count where the name says no split
    disk: float = 0.0  # bytes that a frame leaves behind
    held_per_px: float = 0.0  # bytes of memory for each pixel of the frames


_FRAME_STAGE = Stage(BATCH, "Mpx", disk=POSE, held_per_px=RGBD_PER_PX)
_REFERENCE = Stage("scene/size/labels", "frames", ("test",), disk=POSE + SCORED)
# From the meshes to the report; others come last.
STAGES: dict[str, Stage] = {
    "scene": Stage("scene"),
    "plan": Stage("scene/split", "frames", disk=POSE),
    "render_packed": Stage("scene/sequence", "Msamples"),
    "pack": Stage("scene/split", "MB"),
    "render": Stage("scene/camera/sequence", "Msamples"),
    "dataset": Stage("scene/camera", "frames"),
    "labels": Stage("scene/size/labels/split", "rows", disk=POSE),
    "sfm": _FRAME_STAGE._replace(held_per_px=SFM_PER_PX),
    "rgbd": _FRAME_STAGE,
    **dict.fromkeys(frame_methods(), _FRAME_STAGE),
    **dict.fromkeys(graph_methods(), Stage(BATCH, "frames", disk=POSE)),
    "chain": Stage("scene/size/labels", "frames", disk=2 * POSE),  # with and without assistance
    "pretrain": Stage("backbone", "TFLOP"),
    "train": Stage(RUN, "TFLOP"),
    "score": Stage(RUN, "frames", ("test",), disk=SCORED),
    "descriptors": Stage("scene", "frames", disk=DESCRIPTORS),
    "features": Stage("scene/size/split", "Mpx"),
    "correspondences": Stage("scene/size", "frames", ("test",), disk=MATCHES),
    "tracks": Stage("scene/size", "frames", ("train",), disk=TRACKS),
    "image_references": _REFERENCE,
    "structure_references": _REFERENCE,
    "adjusted_references": _REFERENCE,
    "views": Stage("scene/size/split", "Mpx"),
    "coordinate_references": _REFERENCE._replace(unit="images"),
    **dict.fromkeys(("external_reference", "coverage", "cell_depth"), Stage()),
    **dict.fromkeys(("light_shares", "cartons"), Stage()),
    "render_varied": Stage("effects/split", "Msamples"),
    "pack_varied": Stage("effects/split", "MB"),
    "train_varied": Stage("model", "TFLOP"),
    "varied_descriptors": Stage("trained_on", "frames", disk=DESCRIPTORS),
    "varied_structure": Stage("effects", "frames", ("test",), disk=POSE),
    "effects_speed": Stage(),
    "render_speed": Stage("scene", "image sizes"),
    **dict.fromkeys(("collection_speed", "tables"), Stage()),
    "claims": Stage("", "frames"),
    **dict.fromkeys(("figures", "summary", "provenance", "report"), Stage()),
}


def jobs_of(profile: Profile, keys: Iterable[Key]) -> pd.DataFrame:
    """Tabulate the jobs of these names that the profile may have, in the order of the stages.

    Columns are ``stage`` and ``job``, folder or file of ``<root>/benchmarks`` and path below that;
    ``law``; ``size`` in ``unit``, and ``other`` in a second one (frames of a rendering, layer steps
    of a training run), NaN where there is none; ``disk_bytes`` left behind; ``held_bytes`` of data
    in memory at once.
    """
    made = [NUMBERS | job for key in keys if (job := job_of(profile, *key)) is not None]
    order = {stage: place for place, stage in enumerate(STAGES)}
    made.sort(key=lambda job: order.get(job["stage"], len(order)))
    return pd.DataFrame(made, columns=list(COLUMNS)).astype(dict.fromkeys(NUMBERS, float))


def job_of(profile: Profile, stage: str, name: str) -> dict[str, Any] | None:
    """Describe the job of this name; None without such a scene, size, sequence or network."""
    kind = STAGES.get(stage, Stage())
    # Stages under one law cost the same per unit.
    law = {"Msamples": "rendering", "TFLOP": TRAINING}.get(kind.unit, stage)
    job: dict[str, Any] = {"stage": stage, "job": name, "law": law, "unit": kind.unit}
    if kind.parts is None:
        return job
    try:
        part = dict(zip(kind.parts.split("/"), name.split("/"), strict=True))
        return job | OWN_SIZES.get(stage, _of_frames)(profile, part, kind)
    except (KeyError, IndexError, ValueError, StopIteration):
        return None  # the name is of another design, or of an older workflow


def _of_frames(profile: Profile, part: Part, kind: Stage) -> dict[str, float]:
    """Measure a job by the frames that it goes through."""
    config, frames = profile.config, _frames(profile, part, kind)
    with_depth = kind.unit == "Mpx" or part.get("camera") == "groundtruth"
    camera = config.groundtruth_camera if with_depth else config.network_camera
    pixels, read = frames * camera.width * camera.height, frames
    if part.get("labels") == "synfeal" and "split" in part:  # the first of the whole plan
        read = config.n_largest(part["scene"], part["split"])
    sizes = {
        "frames": float(frames),
        "rows": float(frames + read),
        "Mpx": pixels / 1e6,
        "Msamples": pixels * config.render.supersampling**2 / 1e6,
        "MB": 3 * frames * config.network.input_px**2 / 1e6,
    }
    job = {"size": sizes[kind.unit], "held_bytes": pixels * kind.held_per_px}
    job["disk_bytes"] = kind.disk * frames
    if kind.unit == "Msamples":
        job["other"] = float(frames)
    if kind.unit == "MB":  # packed frames
        job["disk_bytes"] = 1e6 * job["size"]
    if "camera" in part and "sequence" in part:  # as image files; other parts are joined in arrays
        per_px = COLOUR_PER_PX + DEPTH_PER_PX * with_depth
        job["disk_bytes"] = pixels * per_px + frames * POSE_FILE
    return job


def _frames(profile: Profile, part: Part, kind: Stage) -> int:
    """Count frames of a batch, a sequence, a split or several."""
    config, scene = profile.config, part["scene"]
    sizes = [part["size"]] if "size" in part else list(config.scenes[scene].sizes)
    if part.get("camera") == "groundtruth":
        estimated = profile.design.estimated
        sizes = [size for size in sizes if any((scene, size) == s[:2] for s in estimated)]

    def count(split: str) -> int:
        if scene in config.rooms:
            return config.n_largest(scene, split)
        return max(config.n_frames(scene, size, split) for size in sizes)

    counts = [count(split) for split in ([part["split"]] if "split" in part else kind.splits)]
    if "batch" in part:
        index = int(part["batch"].removeprefix("batch-"))
        return len(batches_of(counts[0], config.groundtruth.batch_frames)[index])
    if "sequence" in part:
        sequences = sequences_of(counts[0], counts[1], config.shard_frames)
        return next(len(s) for s in sequences if s.name == part["sequence"])
    return sum(counts)


def _scene(profile: Profile, part: Part, _: Stage) -> dict[str, float]:
    """Size a scene's preparation by the user's mesh, or as a procedural one."""
    path = profile.config.scenes[part["scene"]].path
    return {"disk_bytes": path.stat().st_size if path and path.is_file() else SCENE}


def _pretrain(profile: Profile, part: Part, _: Stage) -> dict[str, float]:
    config = profile.config
    samples = config.pretraining.samples_seen if config.rooms else 0
    frames = config.pretraining.frames * len(config.rooms)
    work = pretext_work(part["backbone"], config.network)
    return _learning(config, work, samples, config.pretraining.batch_size, 0, frames)


def _train(profile: Profile, part: Part, _: Stage) -> dict[str, float]:
    config = profile.config
    part = {"scene": config.robustness.scene, "size": config.robustness.size, **part}
    size = part["size"]
    train, test = (config.n_frames(part["scene"], size, split) for split in ("train", "test"))
    hyper = config.localizers[part["model"]]
    work = training_work(part["model"], config.network, hyper)
    share = SHARES[split_init(part.get("init", "pretrained"))[1]]
    samples, batch = round(share * config.training.samples_seen[size]), config.training.batch_size
    return _learning(config, work, samples, batch, test, train)


def _learning(
    config: Config, work: Work, samples: int, batch: int, predicted: int, frames: int
) -> dict[str, float]:
    layer_steps, tflop = work.size(samples, batch, predicted)
    held = 3.0 * frames * config.network.input_px**2 + work.held_bytes(batch)
    job = {"other": layer_steps, "size": tflop, "held_bytes": held}
    return job | {"disk_bytes": work.parameter_bytes}


def _features(profile: Profile, part: Part, kind: Stage) -> dict[str, float]:
    held = _frames(profile, part, kind) * profile.config.references.max_features * FEATURE
    return _of_frames(profile, part, kind) | {"held_bytes": held}


def _varied(profile: Profile, part: Part, kind: Stage) -> dict[str, float]:
    """Size a job by frames with effects; motion blur draws each several times."""
    robust = profile.config.robustness
    job = _of_frames(profile, {**part, "scene": robust.scene, "size": robust.size}, kind)
    effects = {**robust.effects, "mixed": robust.mixed}[part["effects"]]
    more = effects.motion_blur.subframes - 1 if effects.motion_blur else 0
    drawn = 1 + effects.share * more if kind.unit == "Msamples" else 1
    return {**job, **{name: job[name] * drawn for name in ("size", "other") if name in job}}


def _varied_tests(profile: Profile, part: Part, kind: Stage) -> dict[str, float]:
    """Size a job by all frames of a training set and of tests, sampled where tests are."""
    robust, config = profile.config.robustness, profile.config
    train, test = (config.n_frames(robust.scene, robust.size, s) for s in ("train", "test"))
    if "effects" in part:
        return {"size": min(test, robust.structure_frames)}
    frames = train + test * (1 + len(robust.effects))
    return {"size": frames, "disk_bytes": kind.disk * frames}


OWN_SIZES: dict[str, Callable[[Profile, Part, Stage], dict[str, float]]] = {
    "scene": _scene,
    "pretrain": _pretrain,
    **dict.fromkeys(("train", "train_varied"), _train),
    "features": _features,
    "coordinate_references": lambda profile, part, kind: {
        "size": profile.config.coordinate_samples(part["size"]),
        "disk_bytes": kind.disk * _frames(profile, part, kind),
    },
    **dict.fromkeys(("render_varied", "pack_varied"), _varied),
    **dict.fromkeys(("varied_descriptors", "varied_structure"), _varied_tests),
    "render_speed": lambda profile, *_: {"size": profile.config.render_speed.sizes},
    "claims": lambda profile, *_: {
        "size": sum(profile.config.n_frames(r.scene, r.size, "test") for r in profile.design.runs)
    },
}
