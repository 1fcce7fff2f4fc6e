"""One training run: what it takes, and how wrong its predictions are on other frames."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Self

import numpy as np
import torch
from pydantic import Field, TypeAdapter, model_validator

from baselines.config.learning import Localizers, ModelName, NetworkConfig
from baselines.localizers.registry import backbone_of
from baselines.training.checkpoint import read_checkpoint
from baselines.training.data import read_images
from baselines.training.fit import PROTOCOLS, Protocol
from baselines.training.predict import BATCH, predict_ms, predict_poses
from baselines.training.run import Job, train_localizer
from reproduction.config.tables import RepeatedTraining
from synfeal.config.types import Strict
from synfeal.dataset.packed import read_packed
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.evaluation.metrics import pose_errors
from synfeal.records.provenance import seed_of

PROTOCOL = TypeAdapter(Protocol)


class Case(Strict):
    """Localizer to train, and the frames and labels it learns from."""

    model: ModelName = Field(description="the localizer")
    train_frames: Path = Field(description="packed frames to learn from")
    train_labels: Path = Field(description="pose table of them, or of the first of them")
    test_frames: Path = Field(description="packed frames that are held out")
    test_labels: Path = Field(description="pose table of them")
    test_rows: str | None = Field(
        None, pattern=r"^\d+-\d+$", description="which of them, first and last, if not all"
    )
    weights: str | None = Field(
        None, description="of the backbone, whose name stands for {backbone}; none: from scratch"
    )
    samples_seen: int = Field(description="images shown in all")
    protocol: dict[str, str] = Field(
        default_factory=dict, description="parts exchanged in the protocol of `training`"
    )
    network: NetworkConfig = Field(description="shape of the network")
    localizers: Localizers = Field(description="settings of each localizer")
    training: RepeatedTraining = Field(description="settings of all")

    @model_validator(mode="after")
    def _check_protocol(self) -> Self:
        _ = self.exchanged
        return self

    @property
    def start(self) -> Path | None:
        """The file of the weights, if any."""
        if self.weights is None:
            return None
        return Path(self.weights.replace("{backbone}", backbone_of(self.model, self.network)))

    @property
    def exchanged(self) -> Protocol:
        """The protocol with its parts exchanged."""
        parts = PROTOCOLS[self.training.protocol]._asdict()
        return PROTOCOL.validate_python({**parts, **self.protocol})


def run(case: Case, seed: int) -> dict[str, float]:
    """Train, predict and score; the same seed means the same initial weights and held-out paths.

    ``train_cpu_s`` and ``train_wall_s`` are of the training alone, without imports;
    ``predict_ms_1`` and ``predict_ms_100`` are wall-clock milliseconds per image, one by one and in
    batches; ``position_m`` and ``orientation_deg`` are medians over the test frames, against their
    labels; ``failed`` counts predictions that are no pose.

    Raises:
        InputError: a file cannot be used.
    """
    with tempfile.TemporaryDirectory(prefix="training-") as folder:
        model, predictions = Path(folder) / "model.pt", Path(folder) / "predictions.csv"
        test_frames, test_labels = _test_set(case, Path(folder))
        wall_s, cpu_s = time.perf_counter(), time.process_time()
        job = Job(
            case.model,
            case.network,
            case.localizers[case.model],
            case.training,
            case.samples_seen,
            seed_of(seed, "train"),
            case.exchanged,
        )
        train_localizer(
            job,
            case.train_frames,
            case.train_labels,
            model,
            Path(folder) / "history.csv",
            weights=case.start,
            test=(test_frames, test_labels),
        )
        wall_s, cpu_s = time.perf_counter() - wall_s, time.process_time() - cpu_s
        predict_poses(model, test_frames, test_labels, predictions)
        errors = pose_errors(read_pose_table(predictions), read_pose_table(test_labels))
        one, many = (_ms_per_image(model, test_frames, count) for count in (1, BATCH))
    return {
        "train_cpu_s": cpu_s,
        "train_wall_s": wall_s,
        "predict_ms_1": one,
        f"predict_ms_{BATCH}": many,
        **{name: float(np.median(values)) for name, values in errors.items()},
        "failed": float(np.isinf(errors["position_m"]).sum()),
    }


def _test_set(case: Case, folder: Path) -> tuple[Path, Path]:
    """Return frames and labels of the test set, copied where only some of its rows are meant."""
    if case.test_rows is None:
        return case.test_frames, case.test_labels
    first, last = map(int, case.test_rows.split("-"))
    frames, labels = folder / "test.npy", folder / "test.csv"
    np.save(frames, read_packed(case.test_frames)[first : last + 1])
    table, rows = read_pose_table(case.test_labels), slice(first, last + 1)
    path = table.path[rows]
    count = np.arange(len(path), dtype=np.int64)
    write_pose_table(labels, PoseTable(count, path, table.position_m[rows], table.quat_wxyz[rows]))
    return frames, labels


def _ms_per_image(model: Path, frames: Path, count: int) -> float:
    """Measure the median milliseconds per image of predicting ``count`` images at once."""
    trained = read_checkpoint(model, torch.device("cpu"))
    images = read_images(frames, count, trained.description.network.input_px, trained.device)
    return predict_ms(trained, images) / count
