"""``synfeal train`` as a function: data sets in, ``model.pt`` out."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, NamedTuple

import torch
from pydantic import ValidationError

from baselines.config.learning import (
    SHIPPED_WIDTH,
    AugmentationConfig,
    LocalizerConfig,
    ModelName,
    NetworkConfig,
    TrainingConfig,
    hyper_of,
)
from baselines.localizers.backbones.shipped import shipped_weights_path
from baselines.localizers.registry import backbone_of
from baselines.training.checkpoint import UnseenScore, save_checkpoint
from baselines.training.data import MOST_READ_BYTES
from baselines.training.device import open_device
from baselines.training.fit import FOR_PHOTOGRAPHS
from baselines.training.localize import DEFAULT_TURNS
from baselines.training.memory import free_mb, training_mb
from baselines.training.own_frames import (
    FrameRange,
    OwnFrames,
    PackedFrames,
    check_posed_depth,
    pack_own_frames,
    pack_test_frames,
    read_own_frames,
    read_test_frames,
)
from baselines.training.pictures import refuse_mixed_sizes
from baselines.training.run import Job, step_seconds, train_localizer
from baselines.training.selection import HeldOutErrors, kept_errors
from baselines.training.unseen import MOST_TEST_FRAMES, score_held_out, score_test_split
from synfeal.camera.photograph import PhotographCamera
from synfeal.config.photometric import PhotometricConfig
from synfeal.errors import Argument, InputError, wording
from synfeal.records.files import read_json, refuse_foreign, refuse_inside, write_json, writing_to
from synfeal.records.lock import only_command
from synfeal.records.progress import at_work
from synfeal.records.provenance import provenance

log = logging.getLogger(__name__)

# The network of the default profile, whose backbones are shipped.
NETWORK = NetworkConfig(input_px=64, view="whole", width=0.25)
# That of the paper, which a GPU learns in minutes.
GPU_NETWORK = NetworkConfig(input_px=224, view="whole", width=1.0)
RATE = 1.5e-3
RECIPES: dict[ModelName, LocalizerConfig] = {
    "posenet": LocalizerConfig(learning_rate=RATE, beta=1.0, dropout=0.1),
    "poselstm": LocalizerConfig(learning_rate=RATE, beta=1.0, dropout=0.1),
    "hourglass": LocalizerConfig(learning_rate=RATE, beta=1.0, dropout=0.3, weight_decay=0.1),
    "posenet2resnet": LocalizerConfig(
        learning_rate=RATE, dropout=0.1, s_position=-1.0, s_orientation=-1.0
    ),
    "posenet2": LocalizerConfig(
        learning_rate=RATE, dropout=0.1, s_position=-1.0, s_orientation=-1.0
    ),
}
ROTATIONS = AugmentationConfig(tilt_deg=8.0, roll_deg=15.0)
BATCH = 64
DEFAULT_IMAGES = 30_000
MOST_IMAGES = 10**9  # weeks, on any machine

MODEL, HISTORY, RECORD = "model.pt", "history.csv", "training.json"
LOCK = ".lock"
# What lies there while a run is under way, and what a kill may leave.
PACKED = ("frames.npy", "frames.json", "labels.csv")
TEST_PACKED = tuple(f"test_{name}" for name in PACKED)
TEMPORARY = (*PACKED, *TEST_PACKED, "resume.pt", "budget.json", LOCK)


def recipe_of(localizer: ModelName) -> LocalizerConfig:
    """Return hyper-parameters to train a localizer by; of one without a recipe its defaults."""
    return RECIPES.get(localizer) or hyper_of(localizer)(learning_rate=RATE)


@dataclass(frozen=True)
class TrainJob:
    """A call of ``synfeal train``: localizer, data sets, length.

    Attributes:
        datasets: Data sets of ``synfeal collect`` or sequences of photographs, one or more.
        out: Directory of the model.
        localizer: Name of the localizer.
        images: Images to show in all; None to go by ``minutes``.
        minutes: Approximate length of the training, minutes.
        ranges: Frames to take of photographs; none: all.
        photographs: Camera of photographs.
        held_out: Share of the paths that are not learned from and tell the error, a stretch of
            paths that follow each other.
        randomisation: Ranges of light, lens and sensor; None to show images as they are.
        rotations: Rotations of images; they need a known camera without distortion.
        input_px: Side of the network's image; None: 64 on a processor, 224 on a GPU.
        width: Factor on the network's channels; None: 0.25 on a processor, 1 on a GPU.
        batch: Images per step.
        start: State dict that the backbone starts from; None: the shipped weights where they fit,
            otherwise from scratch.
        device: Device to train on.
        seed: Seed of all that is drawn.
    """

    datasets: Sequence[Path]
    out: Path
    localizer: ModelName = "posenet2"
    images: int | None = DEFAULT_IMAGES
    minutes: float | None = None
    ranges: Sequence[FrameRange] = ()
    photographs: PhotographCamera = field(default_factory=PhotographCamera)
    held_out: float = 0.1
    randomisation: PhotometricConfig | None = field(default_factory=PhotometricConfig)
    rotations: AugmentationConfig = ROTATIONS
    input_px: int | None = None
    width: float | None = None
    batch: int = BATCH
    start: Path | None = None
    device: Literal["auto", "cpu", "cuda"] = "auto"
    seed: int = 0


class TrainedModel(NamedTuple):
    """Result of a training run.

    Attributes:
        model: Checkpoint.
        images: Images shown.
        n_frames: Frames of all data sets.
        n_paths: Paths they are of.
        errors: On the held-out frames; None where nothing was held out.
        unseen: On the test split, answered as ``localize`` answers; on the held-out frames where
            there is no such split; None where there is neither.
        finished_before: The same run had ended before, so nothing was done.
    """

    model: Path
    images: int
    n_frames: int
    n_paths: int
    errors: HeldOutErrors | None
    unseen: UnseenScore | None = None
    finished_before: bool = False


class Sets(NamedTuple):
    """Frames of the data sets of a training run.

    Attributes:
        learned: Frames to learn from, of each data set.
        test: Test frames, of those that have any.
    """

    learned: list[OwnFrames]
    test: list[OwnFrames]

    @classmethod
    def read(cls, job: TrainJob) -> Sets:
        """Find the frames of all data sets; images are not opened."""
        learned = [read_own_frames(folder, job.ranges) for folder in job.datasets]
        found = [read_test_frames(folder) for folder in job.datasets]
        most = MOST_TEST_FRAMES // len(job.datasets)
        return cls(learned, [own.spread(most) for own in found if own is not None])

    def sha256(self) -> dict[str, list[str]]:
        """Hash the frames, in the order of the data sets."""
        return {name: [own.sha256() for own in part] for name, part in self._asdict().items()}


def train(job: TrainJob) -> TrainedModel:
    """Train a localizer on data sets and write ``model.pt``, ``history.csv``, ``training.json``.

    A run that was stopped goes on when it is started again with the same settings, and ends with
    the same bytes. One that has ended is not made again.

    Raises:
        InputError: A data set cannot be used, or ``out`` holds something else.
        MemoryError: There is too little memory; no model is written.
    """
    _check(job)
    device = open_device(job.device)
    network = _network(job, device)
    settings = _settings(job, network)
    with at_work("train", "reading the data sets"):
        sets = Sets.read(job)
        if (job.out / RECORD).exists():
            return _finished(job, settings, sets.sha256())
    _refuse_useless(job, sets.learned)
    _refuse_what_does_not_fit(job, network, sum(len(own.color) for own in sets.learned), device)
    photographs = [own for own in (*sets.learned, *sets.test) if own.camera is None]
    refuse_mixed_sizes(job.photographs, (file for own in photographs for file in own.color))
    for own in sets.learned:
        check_posed_depth(own, job.photographs)
    with at_work("train", "reading the data sets"):
        hashes = sets.sha256()  # reads every image, so after all that refuses a run
    is_new = not job.out.exists()
    try:
        with writing_to(job.out, lambda: "run the same command again when that is mended"):
            job.out.mkdir(parents=True, exist_ok=True)
            with only_command(job.out, job.out / LOCK):
                if (job.out / RECORD).exists():  # by a command that has just ended
                    return _finished(job, settings, hashes)
                packed = pack_own_frames(sets.learned, job.photographs, network, job.out)
                run = _job_of(job, network, packed)
                return _trained(job, run, sets, packed, {"settings": settings, "sha256": hashes})
    except InputError:
        if is_new and job.out.is_dir() and not any(job.out.iterdir()):
            job.out.rmdir()
        raise


def _trained(
    job: TrainJob,
    run: Job,
    sets: Sets,
    packed: PackedFrames,
    known_by: dict[str, Any],
) -> TrainedModel:
    """Train, score the test split, write the record last, remove what was needed on the way.

    Args:
        job: The call.
        run: The run that it comes to.
        sets: Frames of its data sets.
        packed: Those to learn from, packed.
        known_by: Entries of the record that tell this run from others.
    """
    began = time.monotonic()
    trained = train_localizer(
        run,
        packed.frames,
        packed.labels,
        job.out / MODEL,
        job.out / HISTORY,
        weights=_start_of(job, run),
        sequence_from_world=packed.sequence_from_world,
        scene=" + ".join(dict.fromkeys(own.scene for own in sets.learned)),
        calibrated=True,
    )
    localizer = trained.localizer
    errors, unseen = kept_errors(trained.rows), None
    if sets.test:
        network = localizer.description.network
        test = pack_test_frames(sets.test, job.photographs, network, job.out, packed)
        unseen = score_test_split(localizer, packed, test, DEFAULT_TURNS)
    elif errors is not None:
        unseen = score_held_out(errors, packed, job.held_out, job.seed)
    described = localizer.description.model_copy(update={"unseen": unseen})
    save_checkpoint(
        job.out / MODEL,
        localizer.network,
        localizer.statistics,
        described,
        localizer.calibration,
    )
    n_frames = sum(map(len, sets.learned))
    origin = provenance(job.seed, "")
    write_json(
        job.out / RECORD,
        {
            **known_by,
            "images": run.samples_seen,
            "frames": {str(own.folder): len(own) for own in sets.learned},
            "paths": packed.n_paths,
            "held_out": None if errors is None else errors._asdict(),
            "unseen": None if unseen is None else unseen.model_dump(),
            "seconds": round(time.monotonic() - began, 1),
            **{key: origin[key] for key in ("commit", "packages", "platform")},
        },
    )
    for name in set(TEMPORARY) - {LOCK}:
        (job.out / name).unlink(missing_ok=True)
    return TrainedModel(job.out / MODEL, run.samples_seen, n_frames, packed.n_paths, errors, unseen)


def _check(job: TrainJob) -> None:
    if job.images is not None and not 1 <= job.images <= MOST_IMAGES:
        raise InputError(Argument("images"), f"must be 1 to {MOST_IMAGES:,}, found {job.images}")
    if job.minutes is not None and not 0 < job.minutes < 1e6:
        raise InputError(
            Argument("minutes"), f"must be above 0 and below 1e6, found {job.minutes:g}"
        )
    if job.batch < 1:
        raise InputError(Argument("batch"), f"must be at least 1, found {job.batch}")
    if job.start is not None and not job.start.is_file():
        raise InputError(Argument("start"), f"{job.start} is no file", "name a backbone's weights")
    if not 0 <= job.held_out < 1:
        raise InputError(
            Argument("held_out"), f"must be a share from 0 to below 1, found {job.held_out:g}"
        )
    named = [path.resolve() for path in job.datasets]
    if len(set(named)) < len(named):
        raise InputError(job.datasets[0], "one data set is named twice", "name each once")
    own = (MODEL, HISTORY, RECORD, *TEMPORARY)
    present = sorted(p.name for p in job.out.glob("*")) if job.out.is_dir() else []
    left = [name for name in present if name.startswith(".") and _is_left(name)]
    for dataset in job.datasets:
        refuse_inside(job.out, dataset)
    refuse_foreign(job.out, (*own, *left), "synfeal train")


def _refuse_useless(job: TrainJob, sets: Sequence[OwnFrames]) -> None:
    """Refuse what is said of photographs where there are none."""
    camera = {"file": "camera", "focal": "focal_px"}.get(str(job.photographs.source))
    for name in ("range" if job.ranges else None, camera):
        if name and all(own.is_rendered for own in sets):
            raise InputError(
                Argument(name),
                f"is of photographs, and {sets[0].folder} is a data set of synfeal collect, which"
                " says its own",
                "leave it out",
            )


def _is_left(name: str) -> bool:
    """Check for a file under the temporary name that one of ours has while it is written."""
    stems = {Path(own).stem for own in (MODEL, HISTORY, RECORD, *TEMPORARY)}
    return any(name.startswith(f".{stem}-") for stem in stems)


def _network(job: TrainJob, device: torch.device) -> NetworkConfig:
    """Return the shape of the network that is asked for, or suits the device."""
    usual = NETWORK if device.type == "cpu" else GPU_NETWORK
    asked = {"input_px": job.input_px, "width": job.width}
    chosen = {name: value for name, value in asked.items() if value is not None}
    try:
        return NetworkConfig.model_validate(usual.model_dump() | chosen)
    except ValidationError as error:
        field = str(error.errors()[0]["loc"][0])
        raise InputError(
            Argument(field), f"{wording(error.errors()[0])}, found {asked[field]}"
        ) from error


def _refuse_what_does_not_fit(
    job: TrainJob, network: NetworkConfig, n_frames: int, device: torch.device
) -> None:
    """Refuse a network and a batch for which the device has too little memory."""
    n_held = n_frames
    if device.type == "cpu":
        free = free_mb()
        n_bytes = 3 * network.input_px**2 * n_frames
        n_held = 0 if n_bytes > MOST_READ_BYTES else n_frames  # others stay on the disk
    else:
        free = torch.cuda.mem_get_info(device)[0] / 1e6
    needed = training_mb(n_held, network, job.batch)
    if free is not None and needed > free:
        raise InputError(
            Argument("batch"),
            f"{job.batch} images of {network.input_px} pixels and width {network.width:g} take"
            f" about {needed / 1e3:.1f} GB, and {free / 1e3:.1f} GB are free on {device.type}",
            "lower `batch`, `input_px` or `width`",
        )


# Of runs whose record does not say it: earlier versions knew one network.
SETTINGS_BEFORE = {"input_px": 64, "width": 0.25, "batch": 64, "start": None}


def _settings(job: TrainJob, network: NetworkConfig) -> dict[str, Any]:
    """Collect all that decides the weights but the frames themselves, ready for JSON."""
    camera = job.photographs
    return {
        "datasets": [str(path) for path in job.datasets],
        "localizer": job.localizer,
        "images": job.images,
        "minutes": job.minutes,
        "frames": [[r.start, r.stop] for r in job.ranges],
        "camera": None if camera.calibration is None else repr(camera.calibration),
        "focal_px": camera.focal_px,
        "held_out": job.held_out,
        "randomisation": (
            None if job.randomisation is None else job.randomisation.model_dump(mode="json")
        ),
        "rotations": job.rotations.model_dump(mode="json"),
        "input_px": network.input_px,
        "width": network.width,
        "batch": job.batch,
        "start": None if job.start is None else str(job.start),
        "seed": job.seed,
    }


def _finished(
    job: TrainJob, settings: dict[str, Any], hashes: dict[str, list[str]]
) -> TrainedModel:
    """Return the run that ended here, or refuse one that was trained otherwise."""
    record = read_json(job.out / RECORD)
    if problem := _not_this_run(job, record, settings, hashes):
        remedy = "delete it or choose another directory with `out`"
        raise InputError(job.out, f"holds a localizer trained {problem}", remedy)
    errors = None if record["held_out"] is None else HeldOutErrors(**record["held_out"])
    unseen = record.get("unseen") if record.get("sha256") == hashes else None
    return TrainedModel(
        model=job.out / MODEL,
        images=record["images"],
        n_frames=sum(record["frames"].values()),
        n_paths=record["paths"],
        errors=errors,
        unseen=None if unseen is None else UnseenScore.model_validate(unseen),
        finished_before=True,
    )


def _not_this_run(
    job: TrainJob, record: dict[str, Any], settings: dict[str, Any], hashes: dict[str, list[str]]
) -> str | None:
    """Say in what a run that has ended differs from the one that is asked for, if it does."""
    before = SETTINGS_BEFORE | record["settings"]
    learned = record.get("sha256", {}).get("learned")
    if learned == hashes["learned"]:  # data sets are known by their content, wherever they lie
        before["datasets"] = settings["datasets"]
    differing = [key for key in settings if before.get(key) != settings[key]]
    if differing:
        return f"with another {differing[0]}"
    if learned is not None and learned != hashes["learned"]:
        changed = [
            str(folder)
            for folder, old, new in zip(job.datasets, learned, hashes["learned"], strict=False)
            if old != new
        ]
        return f"on other frames, {', '.join(changed)} has changed since"
    return None if (job.out / MODEL).is_file() else "and its model.pt is gone"


def _job_of(job: TrainJob, network: NetworkConfig, packed: PackedFrames) -> Job:
    """Describe the training run as the benchmark's are described."""
    training = TrainingConfig(
        samples_seen={},
        batch_size=job.batch,
        validation_share=job.held_out,
        augmentation=_rotations(job, packed),
        randomisation=job.randomisation,
        device=job.device,
    )
    run = Job(
        name=job.localizer,
        network=network,
        hyper=recipe_of(job.localizer),
        training=training,
        samples_seen=job.images or job.batch,
        seed=job.seed,
        exchanged=FOR_PHOTOGRAPHS,
    )
    if job.minutes is None:
        return run
    return run._replace(samples_seen=_images_in(job.minutes, job, run, packed))


def _rotations(job: TrainJob, packed: PackedFrames) -> AugmentationConfig:
    """Choose rotations of images: none through a camera that is unknown or bends lines."""
    camera = packed.camera
    if camera is not None and not any(camera.distortion):
        return job.rotations
    if job.rotations.turns:
        reason = "the camera is not known" if camera is None else "the lens has distortion"
        log.warning("%s: images are not rotated, because %s", job.datasets[0], reason)
    return AugmentationConfig()


def _images_in(minutes: float, job: TrainJob, run: Job, packed: PackedFrames) -> int:
    """Settle how many images to show, once: a run that goes on must not change it."""
    path = job.out / "budget.json"
    shape = {"input_px": run.network.input_px, "width": run.network.width, "batch": job.batch}
    asked = {"minutes": minutes, "localizer": run.name, **shape}
    if path.is_file():
        settled = SETTINGS_BEFORE | read_json(path)
        if {key: settled.get(key) for key in asked} == asked:
            return int(settled["images"])
    seconds = step_seconds(run, packed.frames, packed.labels, _start_of(job, run))
    images = max(1, round(60 * minutes / seconds)) * run.training.batch_size
    write_json(path, asked | {"images": images})
    return images


def _start_of(job: TrainJob, run: Job) -> Path | None:
    """Return the weights that its backbone starts from; None to start from scratch."""
    if job.start is not None:
        return job.start
    if run.network.width != SHIPPED_WIDTH:
        log.info("the backbone starts from scratch: shipped weights are of width %g", SHIPPED_WIDTH)
        return None
    return shipped_weights_path(backbone_of(run.name, run.network))
