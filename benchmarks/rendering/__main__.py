"""Command line of the benchmark."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.rendering.tables import ROUNDS, in_memory, on_disk, quality, working
from synfeal.config import load_config
from synfeal.config.models import CameraConfig
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.errors import InputError, exit_status
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.planning.plan import plan_split, sampling_box_of
from synfeal.scenes.prepare import build_or_load

N_PLANNED, N_FRAMES = 1000, 20


def build_parser() -> argparse.ArgumentParser:
    """The options."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rendering", description=__doc__)
    parser.add_argument("--scene", default="large_room", help="a scene of the configuration")
    parser.add_argument("--mesh", type=Path, help="its mesh, else it is built")
    parser.add_argument("--poses", type=Path, help="a table of poses, else they are planned")
    parser.add_argument("--frames", type=int, default=N_FRAMES, help=f"poses used ({N_FRAMES})")
    return parser


def subject(options: argparse.Namespace) -> tuple[TexturedMesh, PoseTable]:
    """The mesh, and poses spread evenly over the plan."""
    config = load_config(Path("config/config.yaml"))
    scene = config.scenes[options.scene]
    if options.mesh is not None:
        mesh = load_mesh(options.mesh)
    else:
        mesh = build_or_load(scene, config.seed, options.scene)
    if options.poses is not None:
        plan = read_pose_table(options.poses)
    else:
        box = sampling_box_of(scene, mesh.bounds_m, options.scene)
        caster, rng = RayCaster(*mesh.merged()), np.random.default_rng(0)
        plan = plan_split(caster, box, scene, config.collection, N_PLANNED, rng)
    every = np.linspace(0, len(plan) - 1, options.frames).astype(int)
    return mesh, PoseTable(
        plan.frame[every], plan.path[every], plan.position_m[every], plan.quat_wxyz[every]
    )


def measure(options: argparse.Namespace) -> None:
    """Measure and print the tables."""
    if working()[:1] != ["opengl"]:
        raise InputError("benchmarks.rendering: the opengl backend does not work here")
    mesh, poses = subject(options)
    print(
        f"{options.scene}: {mesh.n_faces:,} faces, {len(poses)} views; medians, all ways in turns;"
        f" {ROUNDS} rounds of the first two tables\n"
    )
    for rows in (
        on_disk(mesh, poses, CameraConfig(width=640, height=480)),
        in_memory(mesh, poses),
        quality(mesh, poses),
    ):
        for row in rows:
            print(row, flush=True)
        print()


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point: 0, or 1 with ``error: ...`` for what a person can mend."""
    options = build_parser().parse_args(argv)
    return exit_status(lambda: measure(options), "nothing was kept")


if __name__ == "__main__":
    sys.exit(main())
