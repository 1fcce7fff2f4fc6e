"""One batch through the project's own SfM and RGB-D stages, in a process of its own.

Results lie under ``<out>/<scene>/batches``: the trajectories, and last a JSON file with the CPU
seconds, which says that the batch is done.
"""

from __future__ import annotations

import json
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from baselines.groundtruth.posegraph.optimise import OPTIMISERS, optimise
from baselines.groundtruth.rgbd import rgbd_graph
from baselines.groundtruth.sfm import sfm_batch
from baselines.groundtruth.trajectory import write_trajectory
from synfeal.config.models import CameraConfig, GroundTruthConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.dataset.sevenscenes import frame_paths
from synfeal.files import write_json

Stage = Literal["sfm", "rgbd"]
STAGES: tuple[Stage, ...] = ("sfm", "rgbd")
STAGE_OF: dict[str, Stage] = {
    "sfm": "sfm",
    **{f"rgbd-{name}": "rgbd" for name in sorted(OPTIMISERS, reverse=True)},
}


@dataclass(frozen=True)
class BatchFiles:
    """Where the results of one batch lie.

    Attributes:
        directory: of the results of all batches.
        index: of the batch.
    """

    directory: Path
    index: int

    def trajectory(self, method: str) -> Path:
        """Estimated motion by a method."""
        return self.directory / f"batch-{self.index:03d}-{method}.csv"

    def seconds(self, stage: Stage) -> Path:
        """CPU seconds by method; there when the stage is done."""
        return self.directory / f"batch-{self.index:03d}-{stage}.json"

    def read_seconds(self, method: str) -> float:
        """CPU seconds of a method, odometry included."""
        text = self.seconds(STAGE_OF[method]).read_text(encoding="utf-8")
        return float(json.loads(text)[method])


def reconstruct(
    stage: Stage,
    frames: Path,
    truth: PoseTable,
    camera: CameraConfig,
    cfg: GroundTruthConfig,
    seed: int,
    files: BatchFiles,
) -> None:
    """Run one stage on the frames of one batch; its true poses scale and place SfM models."""
    color = frame_paths([frames], "color.png")
    start = time.process_time()
    if stage == "sfm":
        with tempfile.TemporaryDirectory() as work:
            estimate = sfm_batch(color, camera, truth.world_from_cam, cfg.sfm, seed, Path(work))
        write_trajectory(files.trajectory("sfm"), estimate.trajectory)
        write_json(files.seconds(stage), {"sfm": time.process_time() - start})
        return
    graph = rgbd_graph(color, frame_paths([frames], "depth.png"), camera, cfg.rgbd)
    odometry_s = time.process_time() - start
    seconds = {}
    for name in OPTIMISERS:
        start = time.process_time()
        trajectory = optimise(name, graph, cfg.posegraph)
        seconds[f"rgbd-{name}"] = odometry_s + time.process_time() - start
        write_trajectory(files.trajectory(f"rgbd-{name}"), trajectory)
    write_json(files.seconds(stage), seconds)
