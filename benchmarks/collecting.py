"""Our frames beside those of a plain pyrender loop, starting included.

Writes ``<out>``, a row for each way to make the frames::

    python -m benchmarks.collecting large_room --size 88x66 --packed 64 --frames 500
    python -m benchmarks.collecting large_room --size 640x480 --frames 100

A scene is ``scenes/NAME/mesh.glb`` and ``plans/NAME/test.csv`` below the results. Each way is a
process of its own, run in turns: :mod:`benchmarks.collecting_worker`, which calls what a job of
the workflow calls, and :mod:`benchmarks.pyrender_loop`, once with as many samples and once with the
edge samples alone that pyrender always takes. Seconds are the system's account of the process, all
threads together: importing, reading the mesh, drawing, compressing, writing. The level of detail is
chosen once for a scene and a camera, before, and has a column of its own.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from benchmarks.processes import ROOT, Taken, seconds_of_process
from synfeal.collection.detail import write_detail
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset.images import read_image
from synfeal.dataset.packed import read_packed
from synfeal.dataset.pose_table import read_frames, write_pose_table
from synfeal.errors import exit_status
from synfeal.records.tables import write_frame

COMPARED = 10  # frames
LOOP = Path(__file__).with_name("pyrender_loop.py")
OURS, SAME, EDGES = "synfeal", "pyrender, the same samples", "pyrender, edge samples alone"
RENDER = RenderConfig(backend="opengl")
KEYS = ["scene", "width", "height"]


class Task(NamedTuple):
    """Frames that are made in every way."""

    mesh: Path
    detail: Path  # what we draw colours of
    plan: Path  # pose table
    poses: Path  # the same as an array
    camera: CameraConfig
    packed_px: int | None  # side of packed frames; None writes images
    rounds: int  # turns of each way

    def command(self, way: str, out: Path | None) -> list[str | Path]:
        """Return the command that makes the frames or, where ``out`` is None, only draws them."""
        samples = 1 if way == EDGES else RENDER.supersampling
        size = ["--width", str(self.camera.width), "--height", str(self.camera.height)]
        packed = [] if self.packed_px is None else ["--packed", str(self.packed_px)]
        target = [] if out is None else [out]
        options = [*size, "--samples", str(samples), *packed]
        if way == OURS:
            files = [self.mesh, self.detail, self.plan]
            return [sys.executable, "-m", "benchmarks.collecting_worker", *files, *target, *options]
        return [sys.executable, LOOP, self.mesh, self.poses, *target, *options]


def measure(task: Task, scene: str, n_frames: int, detail_cpu_s: float) -> list[dict[str, object]]:
    """Measure every way of making the frames, in turns.

    Args:
        task: Frames to make.
        scene: Name of the scene, for the table.
        n_frames: Number of frames, for the table.
        detail_cpu_s: Processor seconds that choosing the level of detail took; stands in our row.

    Returns:
        One row for each way, ours first.
    """
    ways = (OURS, SAME, EDGES)
    with tempfile.TemporaryDirectory() as folder:
        outs = {way: Path(folder, f"{index}") for index, way in enumerate(ways)}
        taken = np.array(list(rounds_of(task, outs)))  # (rounds, ways, cpu and wall)
        seen = {way: frames_in(out, task.packed_px) for way, out in last_outs(task, outs).items()}
    alone = {way: drawing_ms(task.command(way, None)) for way in ways}
    rows = []
    for index, way in enumerate(ways):
        cpu_s, wall_s = np.median(taken[:, index], axis=0)
        ratios = np.median(taken[:, index] / taken[:, 0], axis=0)
        rows.append(
            {
                "scene": scene,
                "width": task.camera.width,
                "height": task.camera.height,
                "output": "PNG" if task.packed_px is None else f"packed {task.packed_px}",
                "frames": n_frames,
                "rounds": task.rounds,
                "way": way,
                "cpu_s": cpu_s,
                "wall_s": wall_s,
                "cpu_times_ours": ratios[0],
                "wall_times_ours": ratios[1],
                "drawing_cpu_ms": alone[way],
                "drawing_times_ours": alone[way] / alone[OURS],
                "levels_from_ours": np.abs(seen[way] - seen[OURS]).mean(),
                "choosing_detail_cpu_s": detail_cpu_s if way == OURS else 0.0,
            }
        )
    return rows


def rounds_of(task: Task, outs: dict[str, Path]) -> Iterator[list[Taken]]:
    """Yield the seconds of all ways, round by round; what the last round wrote stays."""
    for number in range(task.rounds):
        yield [
            seconds_of_process(task.command(way, named(out, number, task.packed_px)))
            for way, out in outs.items()
        ]


def named(out: Path, number: int, packed_px: int | None) -> Path:
    """Return where one round writes its frames: a folder of images, or a packed file.

    Args:
        out: Path that all rounds of a way share.
        number: Number of the round.
        packed_px: Side of packed frames; None for images.
    """
    return out.with_name(f"{out.name}-{number}{'' if packed_px is None else '.npy'}")


def last_outs(task: Task, outs: dict[str, Path]) -> dict[str, Path]:
    """Return the outputs of the last round, by way."""
    return {way: named(out, task.rounds - 1, task.packed_px) for way, out in outs.items()}


def frames_in(out: Path, packed_px: int | None) -> NDArray[np.float32]:
    """Read colours (N, H, W, 3) of some frames, 0 to 255."""
    if packed_px is not None:
        return np.asarray(read_packed(out)[:COMPARED], np.float32)
    paths = sorted(out.glob("*.color.png"))[:COMPARED]
    return np.stack([np.asarray(read_image(path, "RGB"), np.float32) for path in paths])


def drawing_ms(command: Sequence[str | Path]) -> float:
    """Measure the processor time of drawing a frame alone, in milliseconds."""
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return float(done.stdout)


def run(options: argparse.Namespace) -> None:
    """Measure one scene at one size; rows of others that are in the table are kept."""
    width, height = map(int, options.size.split("x"))
    camera = CameraConfig(width=width, height=height)
    mesh = options.results / "scenes" / options.scene / "mesh.glb"
    every = options.results / "plans" / options.scene / "test.csv"
    with tempfile.TemporaryDirectory() as folder:
        poses = read_frames(every, 0, options.frames)
        task = Task(
            mesh=mesh.resolve(),
            detail=Path(folder, "detail.glb"),
            plan=Path(folder, "plan.csv"),
            poses=Path(folder, "poses.npy"),
            camera=camera,
            packed_px=options.packed,
            rounds=options.rounds,
        )
        write_pose_table(task.plan, poses)
        np.save(task.poses, poses.world_from_cam)
        began = time.process_time()
        write_detail(mesh, [every], camera, RENDER, task.detail, Path(folder, "detail.json"))
        detail_cpu_s = time.process_time() - began
        rows = pd.DataFrame(measure(task, options.scene, len(poses), detail_cpu_s))
    print(rows.to_string(index=False))
    if options.out.exists():
        table = pd.read_csv(options.out)
        stale = (table[KEYS] == rows.loc[0, KEYS]).all(axis=1)
        rows = pd.concat([table[~stale], rows])
    write_frame(options.out, rows, "%.5g")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.collecting", description=__doc__)
    parser.add_argument("scene", help="name below scenes/")
    parser.add_argument("--results", type=Path, default=Path("results/mini"))
    parser.add_argument("--size", default="640x480", metavar="WxH")
    parser.add_argument("--packed", type=int, metavar="PX", help="one array of squares, not PNG")
    parser.add_argument("--frames", type=int, default=100)
    parser.add_argument("--rounds", type=int, default=3, help="turns of each way (3)")
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks/collecting.csv"))
    options = parser.parse_args(arguments)
    return exit_status(lambda: run(options), "rows that were measured are kept")


if __name__ == "__main__":
    sys.exit(main())
