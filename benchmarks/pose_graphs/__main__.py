"""Command line: two tables and a picture.

``<out>/pose_graphs.csv`` compares the optimisers on a sphere of 2,200 and a Manhattan world of
3,500 nodes; ``<out>/toro_iteration.csv`` says how the time of a pass of TORO grows with the graph.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from baselines.groundtruth.posegraph.graph import PoseGraph, chi2
from baselines.groundtruth.posegraph.lm import optimise_lm
from baselines.groundtruth.posegraph.open3d_lm import optimise_open3d
from baselines.groundtruth.posegraph.toro import optimise_toro
from benchmarks.pose_graphs.figure import draw_curves
from benchmarks.pose_graphs.graphs import Array, manhattan, measured, sphere
from synfeal.errors import exit_status
from synfeal.geometry.poses import pose_error, relative
from synfeal.report.tables import Value, write_rows

Optimise = Callable[[PoseGraph], Array]
Row = dict[str, Value]

# By its chi2 all are measured: least squares that starts at the true poses and therefore cannot end
# in another minimum.
REFERENCE = "gtsam LM from the truth"
OPTIMISERS: dict[str, Optimise] = {
    "gtsam LM": lambda graph: optimise_lm(graph, 100),
    "Open3D LM": lambda graph: optimise_open3d(graph, 100),
    **{
        f"TORO {count}": lambda graph, count=count: optimise_toro(graph, count, 1e-9)  # type: ignore[misc]
        for count in (10, 30, 100, 300)
    },
}
NOISE_M, NOISE_RAD = 0.02, 0.005
RING_COUNTS, WALK_NODES = (5, 11, 22, 44), (440, 875, 1750, 3500)
PASSES, RUNS = 10, 3


def large_graphs() -> dict[str, tuple[Array, PoseGraph]]:
    """True poses relative to the first, and noisy graphs, of the sizes of the public ones."""
    rng = np.random.default_rng(0)
    worlds = {"sphere": sphere(), "Manhattan": manhattan(rng)}
    return {
        name: (relative(truth[0], truth), measured(rng, truth, pairs, NOISE_M, NOISE_RAD))
        for name, (truth, pairs) in worlds.items()
    }


def comparison(name: str, truth: Array, graph: PoseGraph) -> list[Row]:
    """One row for the reference and one per optimiser; seconds are of processor time."""
    optimise_toro(graph, 1, 1e-9)  # compiles
    rows: list[Row] = []
    optimisers: dict[str, Optimise] = {
        REFERENCE: lambda graph: optimise_lm(PoseGraph(truth, graph.edges), 100)
    }
    for optimiser, optimise in (optimisers | OPTIMISERS).items():
        begin = time.process_time()
        poses = optimise(graph)
        seconds = time.process_time() - begin
        error_m, error_rad = pose_error(poses, truth)
        rows.append(
            {
                "graph": name,
                "nodes": len(graph),
                "edges": len(graph.edges),
                "optimiser": optimiser,
                "seconds": seconds,
                "chi2": chi2(graph, poses),
                "median_m": float(np.median(error_m)),
                "median_deg": float(np.degrees(np.median(error_rad))),
            }
        )
    for row in rows:
        row["chi2_ratio"] = float(str(row["chi2"])) / float(str(rows[0]["chi2"]))
    return rows


def growth() -> list[Row]:
    """Seconds of one pass of TORO on graphs of growing size."""
    rng = np.random.default_rng(1)
    worlds = [("sphere", sphere(rings)) for rings in RING_COUNTS]
    worlds += [("Manhattan", manhattan(rng, nodes)) for nodes in WALK_NODES]
    graphs = [(name, measured(rng, *world, NOISE_M, NOISE_RAD)) for name, world in worlds]
    optimise_toro(graphs[0][1], 1, 1e-9)  # compiles
    return [
        {
            "graph": name,
            "nodes": len(graph),
            "edges": len(graph.edges),
            "seconds_per_pass": float(np.median([_pass_seconds(graph) for _ in range(RUNS)])),
        }
        for name, graph in graphs
    ]


def _pass_seconds(graph: PoseGraph) -> float:
    """Seconds a pass adds: many passes less one, so that setting up does not count."""
    seconds = []
    for count in (1, 1 + PASSES):
        begin = time.process_time()
        optimise_toro(graph, count, 0.0)
        seconds.append(time.process_time() - begin)
    return (seconds[1] - seconds[0]) / PASSES


def measure(out: Path) -> None:
    """Carry out the command."""
    rows = [row for name, made in large_graphs().items() for row in comparison(name, *made)]
    write_rows(out / "pose_graphs.csv", tuple(rows[0]), rows)
    passes = growth()
    write_rows(out / "toro_iteration.csv", tuple(passes[0]), passes)
    draw_curves(rows, passes, out / "pose_graphs.png")


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.pose_graphs", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks/pose_graphs"))
    arguments = parser.parse_args(argv)
    return exit_status(lambda: measure(arguments.out), "nothing was kept")


if __name__ == "__main__":
    sys.exit(main())
