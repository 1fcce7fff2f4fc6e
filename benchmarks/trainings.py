"""One training in a process of its own, and what it took and gave."""

from __future__ import annotations

import csv
import multiprocessing
import tempfile
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from tqdm import tqdm

from baselines.localizers.names import backbone_of
from baselines.training.checkpoint import read_checkpoint
from baselines.training.data import read_images
from baselines.training.loop import train_localizer
from baselines.training.predict import BATCH, predict, predict_poses
from baselines.training.protocol import Protocol
from baselines.training.score import pose_errors
from benchmarks.rgbd_settings.results import append_row
from synfeal.config.models import Config, LocalizerConfig, ModelName, NetworkConfig
from synfeal.dataset.pose_table import read_pose_table
from synfeal.errors import InputError
from synfeal.seeds import seed_of

SCENE, LARGEST = "large_room", "80k"
# Calls of a prediction that is timed; the first, which builds what is built on demand, is left out.
PREDICTIONS = 11

Row = dict[str, str]
Key = Mapping[str, str | float]


class Training(NamedTuple):
    """A training of a benchmark, from true poses of the Large Room.

    Attributes:
        key: columns that tell it from the others.
        model: the localizer.
        size: of the data set.
        init: ``pretrained`` or ``scratch``.
        repetition: seeds are those of the profile's own trainings of this repetition.
        samples_seen: images shown in all.
        network: shape of the network.
        hyper: of the localizer.
        frames: directory of ``train.npy`` and ``test.npy``, of the network's side.
        protocol: in place of the profile's.
    """

    key: Key
    model: ModelName
    size: str
    init: str
    repetition: int
    samples_seen: int
    network: NetworkConfig
    hyper: LocalizerConfig
    frames: Path
    protocol: Protocol | None = None


def training_of(
    config: Config,
    root: Path,
    model: ModelName,
    size: str,
    init: str,
    repetition: int,
    samples_seen: int | None = None,
) -> Training:
    """A training as the profile has it, of its frames below ``root``."""
    samples_seen = samples_seen or config.training.samples_seen[size]
    key: Key = {
        "model": model,
        "size": size,
        "init": init,
        "samples_seen": samples_seen,
        "repetition": repetition,
    }
    return Training(
        key,
        model,
        size,
        init,
        repetition,
        samples_seen,
        config.network,
        config.localizers[model],
        root / "frames" / SCENE,
    )


def measure(training: Training, config: Config, root: Path) -> dict[str, str | float]:
    """Train, predict and score: the row of a training.

    ``train_cpu_s`` and ``train_wall_s`` are of the training alone, without imports;
    ``predict_ms_1`` and ``predict_ms_100`` are wall-clock milliseconds per image, one by one and in
    batches; ``position_m`` and ``orientation_deg`` are median errors against the true poses of the
    largest test set, of which the smaller sizes' are the first frames: hundreds of frames say more.

    Raises:
        InputError: a file of the results tree cannot be used.
    """
    labels = root / "labels" / SCENE
    test = (training.frames / "test.npy", labels / LARGEST / "synfeal" / "test.csv")
    with tempfile.TemporaryDirectory(prefix="training-") as folder:
        model, predictions = Path(folder) / "model.pt", Path(folder) / "predictions.csv"
        wall_s, cpu_s = time.perf_counter(), time.process_time()
        train_localizer(
            training.model,
            training.frames / "train.npy",
            labels / training.size / "synfeal" / "train.csv",
            training.network,
            training.hyper,
            config.training,
            training.samples_seen,
            _weights(training, root),
            _seed(training, config),
            model,
            Path(folder) / "history.csv",
            test=test,
            protocol=training.protocol,
        )
        wall_s, cpu_s = time.perf_counter() - wall_s, time.process_time() - cpu_s
        predict_poses(model, *test, predictions)
        errors = pose_errors(read_pose_table(predictions), read_pose_table(test[1]))
        one, many = (predict_ms(model, test[0], count) for count in (1, BATCH))
    return {
        **training.key,
        "train_cpu_s": cpu_s,
        "train_wall_s": wall_s,
        "predict_ms_1": one,
        f"predict_ms_{BATCH}": many,
        **{name: float(np.median(values)) for name, values in errors.items()},
    }


def _weights(training: Training, root: Path) -> Path | None:
    if training.init == "scratch":
        return None
    path = root / "pretrained" / f"{backbone_of(training.model, training.network)}.pt"
    if not path.exists():
        raise InputError(f"{path}: there is no such file; make it with `snakemake {path}`")
    return path


def _seed(training: Training, config: Config) -> int:
    names = (SCENE, training.size, "synfeal", training.init, training.model)
    return seed_of(config.seed, "train", *names, training.repetition)


def predict_ms(model: Path, frames: Path, count: int) -> float:
    """Median milliseconds per image of predicting ``count`` images at once."""
    trained = read_checkpoint(model, torch.device("cpu"))
    images = read_images(frames, count, trained.description.network.input_px, trained.device)
    taken_s = []
    for _ in range(PREDICTIONS):
        begin = time.perf_counter()
        predict(trained, images)
        taken_s.append(time.perf_counter() - begin)
    return 1e3 * float(np.median(taken_s[1:])) / count


def measure_missing(
    trainings: Sequence[Training], config: Config, root: Path, table: Path, jobs: int
) -> list[Row]:
    """Their rows of the table, after what it lacks was made, ``jobs`` side by side."""
    known = {key_of(row, trainings[0].key) for row in read_rows(table)}
    missing = [t for t in trainings if key_of(t.key, t.key) not in known]
    table.parent.mkdir(parents=True, exist_ok=True)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, mp_context=context, max_tasks_per_child=1) as pool:
        futures = [pool.submit(measure, training, config, root) for training in missing]
        try:
            for future in tqdm(as_completed(futures), total=len(futures), desc=table.stem):
                append_row(table, future.result())
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
    wanted = {key_of(training.key, training.key) for training in trainings}
    return [row for row in read_rows(table) if key_of(row, trainings[0].key) in wanted]


def key_of(row: Key, names: Key) -> tuple[str, ...]:
    """What tells a row from others, as the table writes it."""
    return tuple(str(row[name]) for name in names)


def read_rows(table: Path) -> list[Row]:
    """All rows of a table; none where there is none."""
    if not table.exists():
        return []
    with table.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))
