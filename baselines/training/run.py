"""Train one localizer on one label set, record its inputs, predict poses."""

from __future__ import annotations

import logging
import time
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from baselines.config.learning import (
    LOCALIZERS,
    LocalizerConfig,
    ModelName,
    NetworkConfig,
    TrainingConfig,
    hyper_of,
)
from baselines.localizers.backbones.weights import load_backbone_weights
from baselines.localizers.base import Localizer
from baselines.localizers.memory import memory_errors
from baselines.localizers.registry import build_localizer
from baselines.training.checkpoint import (
    ModelDescription,
    TrainedLocalizer,
    frame_camera,
    save_checkpoint,
)
from baselines.training.data import (
    ImageStatistics,
    LabelledFrames,
    held_out_paths,
    held_out_stretch,
    image_statistics,
    read_labelled_frames,
)
from baselines.training.device import open_device, precision_on
from baselines.training.fit import (
    NOT_KEPT,
    PROTOCOLS,
    Protocol,
    fit,
)
from baselines.training.optimizer import Schedule
from baselines.training.photometric import PhotometricRandomisation
from baselines.training.predict import Predictions, write_predictions
from baselines.training.record import write_training_record
from baselines.training.resume import ResumeFile, digest
from baselines.training.rotation import RandomRotation, random_rotation
from baselines.training.selection import HistoryRow, write_history
from baselines.training.step import Augmentation
from baselines.training.typicality import calibrate

log = logging.getLogger(__name__)

# Images that tell the frames of this run from others, beside the statistics of all of them.
FINGERPRINT_IMAGES = 64

FramesAndLabels = tuple[Path, Path] | None


class Job(NamedTuple):
    """A training run: localizer, settings, seed.

    Attributes:
        hyper: Hyper-parameters of this localizer.
        samples_seen: Images shown in all.
        seed: Seed of first weights, paths held out, order of frames, rotations and dropout.
        exchanged: In place of the protocol that ``training`` names.
    """

    name: ModelName
    network: NetworkConfig
    hyper: LocalizerConfig
    training: TrainingConfig
    samples_seen: int
    seed: int
    exchanged: Protocol | None = None

    @property
    def protocol(self) -> Protocol:
        """Its parts."""
        return self.exchanged or PROTOCOLS[self.training.protocol]

    @property
    def schedule(self) -> Schedule:
        """Length and learning rates of the run."""
        step, epochs = LOCALIZERS[self.name].halve_every
        return Schedule(
            samples_seen=self.samples_seen,
            batch_size=self.training.batch_size,
            learning_rate=self.hyper.learning_rate,
            weight_decay=self.hyper.weight_decay,
            halve_every=step / epochs,
        )


class Material(NamedTuple):
    """Network and frames that a training run begins with.

    Attributes:
        localizer: Localizer with its first weights, on the device of the frames.
        statistics: Statistics of all images.
        learned: Frames to learn from.
        held_out: Frames that decide which weights are kept, if any.
    """

    localizer: Localizer
    statistics: ImageStatistics
    learned: LabelledFrames
    held_out: LabelledFrames | None

    @property
    def device(self) -> torch.device:
        """Device that the run is on."""
        return self.learned.images.device

    def fingerprints(self) -> list[object]:
        """List everything a run depends on beside its settings; of its images, samples."""
        learned = self.learned
        values: list[object] = [torch.__version__, self.localizer.state_dict()]
        values += [self.statistics.mean, self.statistics.deviation, learned.images.device.type]
        for part in (learned, self.held_out):
            if part is not None:
                some = torch.arange(0, len(part), max(1, len(part) // FINGERPRINT_IMAGES))
                values += [*part.batch(some.to(part.rows.device)), part.position_m, part.quat_wxyz]
        return values


class Trained(NamedTuple):
    """A trained localizer and the history of its training.

    Attributes:
        localizer: Localizer as its checkpoint has it, ready for prediction.
        rows: History of the run.
    """

    localizer: TrainedLocalizer
    rows: list[HistoryRow]


@memory_errors()
def train_localizer(
    job: Job,
    frames: Path,
    labels: Path,
    out_model: Path,
    out_history: Path,
    *,
    weights: Path | None = None,
    test: FramesAndLabels = None,
    augment: Augmentation | None = None,
    sequence_from_world: NDArray[np.float64] | None = None,
    scene: str | None = None,
    calibrated: bool = False,
) -> Trained:
    """Train a localizer and write its checkpoint and its history (columns of ``HistoryRow``).

    Beside the checkpoint lies ``resume.pt`` until the run is finished.

    Args:
        job: Localizer, settings, length and seed.
        frames: Packed frames (N, px, px, 3); the first ones are those of ``labels``.
        labels: Pose table of the training set.
        out_model: Checkpoint to write.
        out_history: CSV to write, one row per evaluation.
        weights: State dict the backbone starts from; without, from scratch.
        test: Packed frames and labels of the test set, read only where weights are chosen by it.
        augment: Augmentation in place of the rotations that ``training`` asks for.
        sequence_from_world: Motion (4, 4) from the world of ``labels`` to that of the sequence
            scanned, where they differ.
        scene: Name of the place.
        calibrated: Store what tells pictures of another place from those of this one.

    Returns:
        The localizer and its history.

    Raises:
        InputError: one of the files cannot be used.
        MemoryError: there is too little memory; no checkpoint is written.
    """
    material = _material(job, frames, labels, weights, test)
    if augment is None and job.protocol.images == "rotated":
        augment = _rotation(job, frames, material.device)
    identity = digest(*job, augment and augment.state_dict(), *material.fingerprints())
    resume = ResumeFile(out_model.with_name("resume.pt"), identity)
    rows = _fit(job, material, augment, resume)
    turns = job.training.augmentation
    description = ModelDescription(
        localizer=job.name,
        network=job.network,
        hyper=job.hyper,
        camera=frame_camera(frames),
        sequence_from_world=_rows_of(sequence_from_world),
        bounds_m=_bounds_m(job, material),
        rotations=turns if job.protocol.images == "rotated" and turns.turns else None,
        scene=scene,
    )
    localizer, statistics, learned, held_out = material
    calibration = None
    if calibrated:
        randomise = _randomisation(job, material.device)
        calibration = calibrate(localizer, statistics, learned, held_out, randomise)
    save_checkpoint(out_model, localizer, statistics, description, calibration)
    write_history(out_history, rows)
    resume.remove()
    trained = TrainedLocalizer(description, localizer.eval(), statistics, calibration)
    return Trained(trained, rows)


# Steps of two runs whose difference tells the time of a step without that of the start. A GPU's
# first steps are not captured, and it takes hundreds in the time of a processor's ten.
TIMED_STEPS = {"cpu": (2, 10), "cuda": (20, 220)}


def step_seconds(job: Job, frames: Path, labels: Path, weights: Path | None) -> float:
    """Measure the seconds that one step of a training run takes here; nothing is written.

    Args:
        job: The run; how many images it shows does not matter.
        frames: Packed frames.
        labels: Pose table.
        weights: State dict that the backbone starts from.

    Returns:
        Seconds of a step, at least a microsecond.
    """
    material = _material(job, frames, labels, weights, test=None)._replace(held_out=None)
    augment = _rotation(job, frames, material.device)
    few, many = TIMED_STEPS[material.device.type]
    seconds = []
    for steps in (few, few, many):  # the first run is not counted: it loads and chooses
        began = time.perf_counter()
        short = job._replace(samples_seen=steps * job.training.batch_size)
        _fit(short, material, augment, NOT_KEPT)
        seconds.append(time.perf_counter() - began)
    return max((seconds[2] - seconds[1]) / (many - few), 1e-6)


def _rows_of(matrix: NDArray[np.float64] | None) -> Any:
    """Format a matrix as the description of a model holds it."""
    return None if matrix is None else tuple(tuple(row) for row in matrix.tolist())


def _bounds_m(job: Job, material: Material) -> Any:
    """Return the corners of the box that the positions of the training set lie in."""
    parts = [material.learned]
    if material.held_out is not None and job.protocol.selection != "test":
        parts.append(material.held_out)
    position_m = torch.cat([part.position_m for part in parts])
    return tuple(position_m.amin(0).tolist()), tuple(position_m.amax(0).tolist())


def _material(
    job: Job, frames: Path, labels: Path, weights: Path | None, test: FramesAndLabels
) -> Material:
    """Load the network and the frames of a run onto its device."""
    device = open_device(job.training.device)
    data = read_labelled_frames(frames, labels, job.network.input_px, device)
    learned, held_out = _split(job, data, test)
    torch.manual_seed(job.seed)  # dropout draws from this generator, too
    localizer = build_localizer(job.name, job.network, job.hyper)
    if weights is not None:
        load_backbone_weights(localizer.backbone, weights)
    localizer.place_on(device)
    localizer.set_pose_prior(learned.position_m.mean(0))
    log.info("%s: %d frames, %d samples, on %s", job.name, len(learned), job.samples_seen, device)
    return Material(localizer, image_statistics(data.images), learned, held_out)


def _fit(
    job: Job, material: Material, augment: Augmentation | None, resume: ResumeFile
) -> list[HistoryRow]:
    """Train the network in place and return the history."""
    localizer, statistics, learned, held_out = material
    if job.protocol.selection == "averaged":
        aside = 0 if held_out is None else len(held_out)
        log.info("the last weights are averaged; %d frames are held out", aside)
    elif held_out is None:
        log.info("no frames are held out: the last weights are kept")
    else:
        log.info("weights are chosen on %d frames (%s)", len(held_out), job.protocol.selection)
    return fit(
        localizer=localizer,
        frames=learned,
        statistics=statistics,
        schedule=job.schedule,
        seed=job.seed,
        protocol=job.protocol,
        held_out=held_out,
        patience=job.training.patience,
        precision=precision_on(material.device, job.training.precision),
        randomise=_randomisation(job, material.device),
        augment=augment,
        resume=resume,
    )


def _randomisation(job: Job, device: torch.device) -> PhotometricRandomisation | None:
    """Make the randomisation of images, where one is configured."""
    config = job.training.randomisation
    return None if config is None else PhotometricRandomisation(config, job.seed, device)


def _rotation(job: Job, frames: Path, device: torch.device) -> RandomRotation | None:
    """Make the rotations of images, where some are configured."""
    return random_rotation(frames, job.network, job.training.augmentation, job.seed, device)


def _split(
    job: Job, data: LabelledFrames, test: FramesAndLabels
) -> tuple[LabelledFrames, LabelledFrames | None]:
    """Divide frames into those to learn from and those that choose the weights."""
    if job.protocol.selection == "test":
        if test is None:
            raise ValueError("this protocol chooses weights by the test set, which is not given")
        frames, labels = test
        return data, read_labelled_frames(frames, labels, data.images.shape[-1], data.images.device)
    if job.protocol.selection == "last":
        return data, None
    hold_out = held_out_stretch if job.protocol.selection == "averaged" else held_out_paths
    mask = hold_out(data.path, job.training.validation_share, job.seed)
    return (data.part(~mask), data.part(mask)) if mask.any() else (data, None)


class Answers(NamedTuple):
    """Predictions of a training run.

    Attributes:
        test: Those of the test frames.
        common: Those of the common test set, where they were asked for.
    """

    test: Predictions
    common: Predictions | None = None


class SplitFiles(NamedTuple):
    """Packed frames of a split, and their poses as the data set labels them.

    Attributes:
        frames: Packed frames, the first of which are those of ``labels``.
        labels: Pose table.
    """

    frames: Path
    labels: Path


class CommonTest(NamedTuple):
    """Test frames that localizers of all sizes answer, beside their own.

    Attributes:
        truth: Their true poses, a pose table.
        every: The first of each so many of its frames is predicted.
        out: Predicted poses to write.
    """

    truth: Path
    every: int
    out: Path


class RunFiles(NamedTuple):
    """Files that a training run writes.

    Attributes:
        model: Checkpoint.
        history: CSV of the losses.
        record: JSON of what the run was trained from.
        predictions: Predicted poses of the test frames.
    """

    model: Path
    history: Path
    record: Path
    predictions: Path


def train_and_predict(
    model: ModelName,
    train: SplitFiles,
    test: SplitFiles,
    run: dict[str, Any],
    out: RunFiles,
    weights: Path | None = None,
    common: CommonTest | None = None,
) -> Answers:
    """Train a localizer, and predict the test frames it is scored on.

    Args:
        model: Name of the localizer.
        train: Frames to learn from.
        test: Frames to predict; of their labels only the frames are read, but by a published
            protocol.
        run: Settings of the run: ``training``, ``network``, ``localizer``, ``samples_seen`` and
            ``seed``, ready for JSON.
        out: Files to write.
        weights: State dict that the backbone starts from; without, from scratch.
        common: Common test set to predict as well.

    Returns:
        The predictions.
    """
    inputs = {"frames": train.frames, "labels": train.labels}
    inputs |= {"test_frames": test.frames, "test_labels": test.labels}
    inputs |= {"weights": weights} if weights else {}
    training = TrainingConfig(**run["training"], samples_seen={})
    network, hyper = NetworkConfig(**run["network"]), hyper_of(model)(**run["localizer"])
    job = Job(model, network, hyper, training, run["samples_seen"], run["seed"])
    trained = train_localizer(
        job=job,
        frames=train.frames,
        labels=train.labels,
        out_model=out.model,
        out_history=out.history,
        weights=weights,
        test=test,
    )
    write_training_record(out.record, run, inputs)
    own = write_predictions(trained.localizer, test.frames, test.labels, out.predictions)
    if common is None:
        return Answers(own)
    return Answers(
        own,
        write_predictions(trained.localizer, test.frames, common.truth, common.out, common.every),
    )
