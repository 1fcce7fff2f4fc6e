"""How much memory the stages take on a processor when a data set is as large as the paper's.

``python -m benchmarks.scale_memory --out results/benchmarks/scale_memory.csv`` makes 100,000 poses
and frames of 224 px (15 GB, deleted at the end) and runs each stage by itself in a new process. Two
peaks are noted: private memory, and what is resident with the pages of mapped files, which the
system takes back when it runs short. The largest sets are the paper's: 95,000 frames.
"""

from __future__ import annotations

import argparse
import csv
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from synfeal.files import atomic_path

INPUT_PX = 224
SHARD_FRAMES = 1000
PATH_FRAMES = 40
BATCH_FRAMES = 250
PREDICTED = 500  # frames: the time per frame is the network's, and only a batch is in memory
COLUMNS = ("stage", "frames", "seconds", "peak_private_mb", "peak_resident_mb")
POLL_S = 0.05


def make_poses(folder: Path, n_frames: int) -> None:
    """Poses on paths in a room, as a plan and as predictions."""
    from synfeal.dataset.pose_table import PoseTable, write_pose_table
    from synfeal.geometry.rotations import canonical_quat_wxyz

    rng = np.random.default_rng(0)
    quat = rng.normal(size=(n_frames, 4))
    quat = canonical_quat_wxyz(quat / np.linalg.norm(quat, axis=1, keepdims=True))
    index = np.arange(n_frames)
    position_m = rng.uniform(0, 5, (n_frames, 3))
    write_pose_table(folder / "plan.csv", PoseTable(index, index // PATH_FRAMES, position_m, quat))


def pack(folder: Path, n_frames: int) -> None:
    """Join shards of empty frames, and record what they are."""
    from synfeal.dataset.packed import join_packed
    from synfeal.dataset.packed_record import file_sha256

    shards = []
    for start in range(0, n_frames, SHARD_FRAMES):
        shape = (min(SHARD_FRAMES, n_frames - start), INPUT_PX, INPUT_PX, 3)
        shards.append(folder / f"shard-{start:06d}.npy")
        np.lib.format.open_memmap(shards[-1], mode="w+", dtype=np.uint8, shape=shape)
    join_packed(shards, folder / "frames.npy")
    file_sha256(folder / "frames.npy")


def true_labels(folder: Path, n_frames: int) -> None:
    """All rows of the plan."""
    from synfeal.dataset.pose_table import read_frames, write_pose_table

    write_pose_table(folder / "labels.csv", read_frames(folder / "plan.csv", 0, n_frames))


def noisy_labels(folder: Path, _: int) -> None:
    """The same with noise."""
    from synfeal.dataset.pose_table import read_pose_table, write_pose_table
    from synfeal.labels.noise import add_noise

    rng = np.random.default_rng(0)
    noisy = add_noise(read_pose_table(folder / "labels.csv"), 0.1, 5.0, rng)
    write_pose_table(folder / "predictions.csv", noisy)


def chain(folder: Path, n_frames: int) -> None:
    """Batches that follow the true poses."""
    from baselines.groundtruth.batches import batches_of
    from baselines.groundtruth.label_set import chain_split
    from baselines.groundtruth.trajectory import BatchTrajectory, write_trajectory
    from synfeal.config.models import GroundTruthConfig
    from synfeal.dataset.pose_table import read_pose_table
    from synfeal.geometry.poses import inverse

    pose = read_pose_table(folder / "labels.csv").world_from_cam
    paths = []
    for batch in batches_of(n_frames, BATCH_FRAMES):
        part = pose[batch.start : batch.stop]
        seen = np.ones(len(part), dtype=bool)
        paths.append(folder / f"batch-{batch.index:04d}.csv")
        write_trajectory(paths[-1], BatchTrajectory(inverse(part[0]) @ part, seen))
    out = (folder / "chained.csv", folder / "unassisted.csv")
    chain_split(paths, folder / "labels.csv", *out, GroundTruthConfig(batch_frames=BATCH_FRAMES))


def read_training_data(folder: Path, _: int) -> None:
    """Frames and labels as a training reads them, the statistics of the images, and some steps."""
    import torch

    from baselines.training.data import image_statistics, read_labelled_frames

    device = torch.device("cpu")
    data = read_labelled_frames(folder / "frames.npy", folder / "labels.csv", INPUT_PX, device)
    statistics = image_statistics(data.images)
    for _step in range(20):
        statistics.normalise(data.batch(torch.randint(len(data), (45,))).images)


def predict(folder: Path, n_frames: int) -> None:
    """Poses of some of the frames by the largest network."""
    import torch

    from baselines.localizers.registry import build_localizer
    from baselines.training.data import ImageStatistics, read_images
    from baselines.training.predict import BATCH
    from synfeal.config.models import LocalizerConfig, NetworkConfig

    network = build_localizer(
        "hourglass", NetworkConfig(input_px=INPUT_PX), LocalizerConfig(beta=10)
    )
    statistics = ImageStatistics(torch.zeros(1, 3, 1, 1), torch.ones(1, 3, 1, 1))
    device = torch.device("cpu")
    images = read_images(folder / "frames.npy", n_frames, INPUT_PX, device)
    with torch.inference_mode():
        for batch in torch.split(images[:PREDICTED], BATCH):
            network.eval()(statistics.normalise(batch))


def score(folder: Path, _: int) -> None:
    """Errors and their bootstrap."""
    from baselines.training.score import score_run

    labels, errors = folder / "labels.csv", folder / "errors.csv"
    score_run(
        *(folder / "predictions.csv", labels, labels, labels, errors),
        folder / "metrics.json",
        {},
    )


STAGES: dict[str, Callable[[Path, int], None]] = {
    "pack": pack,
    "true_labels": true_labels,
    "noisy_labels": noisy_labels,
    "chain": chain,
    "training_data": read_training_data,
    "predict": predict,
    "score": score,
}


def measure(stage: str, folder: Path, n_frames: int) -> list[str]:
    """Run a stage in a process of its own; a row of the table.

    Raises:
        CalledProcessError: it failed.
    """
    command = [sys.executable, "-m", "benchmarks.scale_memory", "--stage", stage]
    begin = time.perf_counter()
    command += ["--frames", str(n_frames), "--folder", str(folder)]
    private_mb = resident_mb = 0.0
    with subprocess.Popen(command) as process:
        while process.poll() is None:
            found = memory_mb(process.pid)
            private_mb, resident_mb = max(private_mb, found[0]), max(resident_mb, found[1])
            time.sleep(POLL_S)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    seconds = time.perf_counter() - begin
    frames = PREDICTED if stage == "predict" else n_frames
    return [stage, str(frames), f"{seconds:.1f}", f"{private_mb:.0f}", f"{resident_mb:.0f}"]


def memory_mb(pid: int) -> tuple[float, float]:
    """Private and resident memory of a process; zeros when it has ended."""
    try:
        lines = Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines()
    except OSError:
        return 0.0, 0.0
    kilobytes = {line.split(":")[0]: int(line.split()[1]) for line in lines if line[-2:] == "kB"}
    return kilobytes.get("RssAnon", 0) * 1.024e-3, kilobytes.get("VmRSS", 0) * 1.024e-3


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure all stages, or be one of them."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.scale_memory", description=__doc__)
    parser.add_argument("--frames", type=int, default=100_000)
    parser.add_argument("--out", type=Path, help="table to write")
    parser.add_argument("--stage", choices=STAGES, help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help="where the frames are made (a temporary one)")
    options = parser.parse_args(arguments)
    if options.stage:
        STAGES[options.stage](options.folder, options.frames)
        return
    rows = []
    with tempfile.TemporaryDirectory(dir=options.folder) as name:
        folder = Path(name)
        make_poses(folder, options.frames)
        for stage in STAGES:
            rows.append(measure(stage, folder, options.frames))
            print(*rows[-1], sep=",", flush=True)
            for path in folder.glob("shard-*.npy"):
                path.unlink()
    if options.out:
        with atomic_path(options.out) as temporary, temporary.open("w", newline="") as file:
            csv.writer(file, lineterminator="\n").writerows([COLUMNS, *rows])


if __name__ == "__main__":
    main()
