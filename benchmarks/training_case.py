"""Frames as files and packed, and one network that learns from them in our loop or a plain one."""

from __future__ import annotations

import copy
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import torch

from baselines.localizers.base import Localizer
from baselines.localizers.registry import build_localizer
from baselines.training.data import (
    ImageStatistics,
    LabelledFrames,
    image_statistics,
    read_labelled_frames,
)
from baselines.training.device import open_device
from baselines.training.fit import fit
from baselines.training.optimizer import Schedule
from baselines.training.protocol import HALVE_EVERY, PROTOCOLS
from benchmarks.plain_training import ImageFiles, train_plainly
from benchmarks.scene_difficulty.pool import run_tasks
from benchmarks.trainings import SCENE
from synfeal.config.models import CameraConfig, Config, ModelName
from synfeal.dataset.packed import pack_frames
from synfeal.dataset.pose_table import read_frames, write_pose_table
from synfeal.dataset.render_sequence import render_sequence

MODEL: ModelName = "posenet2"
N_FRAMES = 320
PUBLISHED = PROTOCOLS["published"]._replace(selection="last")


class Taken(NamedTuple):
    """Seconds: on the clock, and of processor time, that of processes that have ended included."""

    wall_s: float
    cpu_s: float


@dataclass(frozen=True)
class Case:
    """Frames of one size, as files and packed, and a network without dropout to train on them."""

    start: Localizer
    data: LabelledFrames
    files: ImageFiles
    statistics: ImageStatistics
    pack_ms: float
    epoch: Schedule
    seed: int

    def ours(self, steps: int, nudge: float = 0.0) -> list[float]:
        """Losses of our loop; weights may start off, by normal draws of relative size ``nudge``."""
        localizer = copy.deepcopy(self.start)
        generator = torch.Generator().manual_seed(self.seed)
        with torch.no_grad():
            for parameter in localizer.parameters():
                parameter.mul_(1 + nudge * torch.randn(parameter.shape, generator=generator))
        localizer.place_on(self.data.images.device)
        schedule = self.schedule(steps)
        rows = fit(localizer, self.data, self.statistics, schedule, self.seed, protocol=PUBLISHED)
        return [row.loss for row in rows]

    def plain(self, steps: int, workers: int) -> list[float]:
        """Losses of the plain loop."""
        localizer = copy.deepcopy(self.start)
        return train_plainly(localizer, self.files, self.schedule(steps), self.seed, workers)

    def schedule(self, steps: int) -> Schedule:
        """So many batches."""
        return self.epoch._replace(samples_seen=steps * self.epoch.batch_size)


def open_case(config: Config, root: Path, folder: Path, size: tuple[int, int]) -> Case:
    """Render what is missing, pack it, and build the network."""
    name, network = f"{size[0]}x{size[1]}", config.network
    frames, packed, labels = folder / name, folder / f"{name}.npy", folder / "labels.csv"
    camera = config.network_camera.model_copy(update={"width": size[0], "height": size[1]})
    if not frames.exists():
        run_tasks(render, [(root, camera, frames)], 1, f"frames of {name}")
    taken = timed(lambda: pack_frames([frames], network.input_px, packed))
    write_pose_table(labels, read_frames(root / "plans" / SCENE / "train.csv", 0, N_FRAMES))
    data = read_labelled_frames(packed, labels, network.input_px, open_device("cpu"))
    statistics = image_statistics(data.images)
    hyper = config.localizers[MODEL].model_copy(update={"dropout": 0.0})
    torch.manual_seed(config.seed)
    start = build_localizer(MODEL, network, hyper)
    start.set_pose_prior(data.position_m.mean(0))
    start.criterion.distance = PUBLISHED.distance
    rate, decay, size_of_batch = hyper.learning_rate, hyper.weight_decay, config.training.batch_size
    return Case(
        start,
        data,
        ImageFiles(frames, network.input_px, statistics),
        statistics,
        1e3 * taken.cpu_s / N_FRAMES,
        Schedule(N_FRAMES, size_of_batch, rate, decay, HALVE_EVERY[MODEL]),
        config.seed,
    )


def render(root: Path, camera: CameraConfig, out: Path) -> None:
    """The first frames of the training plan as files."""
    poses = read_frames(root / "plans" / SCENE / "train.csv", 0, N_FRAMES)
    render_sequence(root / "scenes" / SCENE / "mesh.glb", camera, poses, out, False)


def timed(action: Callable[[], object]) -> Taken:
    """What an action takes, the processes that it starts and ends included."""
    before, begin = os.times(), time.perf_counter()
    action()
    wall_s, after = time.perf_counter() - begin, os.times()
    return Taken(wall_s, sum(after[:4]) - sum(before[:4]))
