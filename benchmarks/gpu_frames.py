"""Frames of one data set of a profile, drawn where they are learned from.

    python -m benchmarks.gpu_frames plan OUT     # mesh and poses, by the processor
    python -m benchmarks.gpu_frames draw OUT     # frames, by the GPU where its driver draws

Nothing needs to be carried to that machine: 6,000 and 2,500 frames of 224 pixels would be 1.3 GB.
Poses are planned with Open3D. Where a machine lacks it, ``plan OUT --labels DIR`` takes those that
were planned on another one.
The directory is laid out for :mod:`benchmarks.gpu_errors`: ``labels``, ``frames-small`` as the
profile's networks see them, and ``frames-large`` of 224 pixels.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import shutil
import sys
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

from reproduction.config.profile import Config
from reproduction.design.profiles import read_profile
from synfeal.collection.prepare import prepare_scene
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.packed import write_packed
from synfeal.dataset.render_sequence import render_packed
from synfeal.errors import exit_status, read_as
from synfeal.planning.plan import write_plan
from synfeal.records.provenance import seed_of

SPLITS = ("train", "test")
FRAMES_OF_A_TASK = 500


class Look(NamedTuple):
    """Frames as networks of one size see them: side of the square, pixels, and camera."""

    input_px: int
    camera: CameraConfig


LARGE = Look(224, CameraConfig(width=320, height=240))


class Source(NamedTuple):
    """Data set to draw.

    Attributes:
        config: The profile.
        scene: Its scene.
        size: Size of the data set, such as ``6k``.
    """

    config: Config
    scene: str
    size: str

    def count(self, split: str) -> int:
        """Return the number of frames of a split."""
        return self.config.n_frames(self.scene, self.size, split)

    @property
    def looks(self) -> dict[str, Look]:
        """Sizes of frames by name."""
        small = Look(self.config.network.input_px, self.config.network_camera)
        return {"small": small, "large": LARGE}


def plan(source: Source, out: Path, labels: Path | None = None) -> None:
    """Make the mesh of the scene, and the poses of the frames.

    Args:
        source: Data set.
        out: Directory to write to.
        labels: Directory of poses that were planned before; None plans them.

    Raises:
        InputError: There are no such poses.
    """
    config, scene = source.config, source.config.scenes[source.scene]
    if labels is not None:
        with read_as(labels, "poses planned before"):
            shutil.copytree(labels, out / "labels", dirs_exist_ok=True)
    prepare_scene(
        name=source.scene,
        scene=scene,
        # Only planning asks what a camera would run into.
        collision_agreement=None if labels else config.collection.collision_agreement,
        seed=config.seed,
        out_mesh=out / "scene" / "mesh.glb",
        shade=config.render.shade,
    )
    for split in SPLITS if labels is None else ():
        write_plan(
            collision=out / "scene" / "collision.ply",
            scene=scene,
            collection=config.collection,
            n_frames=source.count(split),
            seed=seed_of(config.seed, "plan", source.scene, split),
            split=split,
            out_plan=out / "labels" / f"{split}.csv",
        )


def draw(source: Source, out: Path, processes: int) -> None:
    """Draw the planned frames at both sizes.

    Args:
        source: Data set.
        out: Directory that :func:`plan` wrote.
        processes: Renderers at a time.
    """
    tasks: list[dict[str, Any]] = []
    shards: dict[tuple[str, str], list[Path]] = {}
    for name, look in source.looks.items():
        for split in SPLITS:
            for start in range(0, source.count(split), FRAMES_OF_A_TASK):
                shard = out / "shards" / f"{name}-{split}-{start:06d}.npy"
                shards.setdefault((name, split), []).append(shard)
                tasks.append(
                    {
                        "mesh": out / "scene" / "mesh.glb",
                        "camera": look.camera,
                        "plan": out / "labels" / f"{split}.csv",
                        "start": start,
                        "stop": min(start + FRAMES_OF_A_TASK, source.count(split)),
                        "input_px": look.input_px,
                        "view": source.config.network.view,
                        "render": source.config.render,
                        "out_frames": shard,
                    }
                )
    context = multiprocessing.get_context("spawn")  # a forked OpenGL context does not work
    with ProcessPoolExecutor(min(processes, len(tasks)), context) as executor:
        for done in [executor.submit(render_packed, **task) for task in tasks]:
            done.result()
    for (name, split), parts in shards.items():
        write_packed(
            plan=out / "labels" / f"{split}.csv",
            shards=parts,
            records=[part.with_suffix(".json") for part in parts],
            camera=source.looks[name].camera,
            render=source.config.render,
            view=source.config.network.view,
            out_frames=out / f"frames-{name}" / f"{split}.npy",
        )
        for part in parts:
            part.unlink()


def build_parser() -> argparse.ArgumentParser:
    """Build the parser of the options."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.gpu_frames", description=__doc__)
    parser.add_argument("stage", choices=("plan", "draw"))
    parser.add_argument("out", type=Path, help="directory")
    parser.add_argument("--labels", type=Path, help="poses planned before: of train and test.csv")
    parser.add_argument("--profile", default="night", help="name or file (night)")
    parser.add_argument("--scene", default="large_room", help="(large_room)")
    parser.add_argument("--size", default="6k", help="(6k)")
    parser.add_argument(
        "--processes", type=int, default=min(14, os.cpu_count() or 1), help="renderers at a time"
    )
    return parser


def run(options: argparse.Namespace) -> None:
    """Plan or draw, and print how long it took."""
    source = Source(read_profile(options.profile).config, options.scene, options.size)
    began = time.monotonic()
    if options.stage == "plan":
        plan(source, options.out, options.labels)
    else:
        draw(source, options.out, options.processes)
    print(f"{options.stage}: {time.monotonic() - began:.0f} s")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    options = build_parser().parse_args(arguments)
    return exit_status(lambda: run(options), "begin again in an empty directory")


if __name__ == "__main__":
    sys.exit(main())
