"""How fast plans are made: poses per second on the full mesh and on the collision mesh.

``python -m benchmarks.planning`` prints a table: the paper's spacing of 3 cm, and 25 cm, at which
there are eight times as many paths to find. The cases are planned in turns; a figure is the median.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synfeal.config import load_config
from synfeal.config.models import CollectionConfig, SceneConfig
from synfeal.mesh.collision import collision_mesh
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import Triangles, merge_vertices
from synfeal.planning.plan import plan_split, sampling_box_of
from synfeal.scenes.prepare import build_or_load

SPACINGS_M = (0.03, 0.25)
N_POSES = 100_000
N_RUNS = 3


class Case(NamedTuple):
    """A mesh, its name and the distance between frames."""

    name: str
    mesh: Triangles
    spacing_m: float


def seconds(
    case: Case, scene: SceneConfig, box_m: NDArray[np.float64], collection: CollectionConfig
) -> tuple[float, int]:
    """Time to plan ``N_POSES`` poses, the acceleration structure included, and their paths."""
    collection = collection.model_copy(update={"frame_spacing_m": case.spacing_m})
    begin = time.perf_counter()
    caster = RayCaster(*case.mesh)
    plan = plan_split(caster, box_m, scene, collection, N_POSES, np.random.default_rng(0))
    return time.perf_counter() - begin, int(plan.path[-1]) + 1


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure one scene of the default profile and print a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.planning", description=__doc__)
    parser.add_argument("--scene", default="large_room", help="a scene of the configuration")
    name = parser.parse_args(arguments).scene
    config = load_config(Path("config/config.yaml"))
    scene = config.scenes[name]
    textured = build_or_load(scene, config.seed, name)
    box_m = sampling_box_of(scene, textured.bounds_m, name)
    agreement, rng = config.collection.collision_agreement, np.random.default_rng(0)
    meshes = {
        "full": merge_vertices(*textured.merged()),
        "collision": collision_mesh(textured, scene, box_m, agreement, rng)[0],
    }
    cases = [Case(*mesh, spacing_m) for mesh, spacing_m in product(meshes.items(), SPACINGS_M)]
    plan = config.collection
    runs = [[seconds(case, scene, box_m, plan) for case in cases] for _ in range(N_RUNS)]
    print(f"{name}: {N_POSES:,} poses, median of {N_RUNS} interleaved runs\n")
    print("| mesh | faces | spacing | paths | seconds | poses/s |")
    print("|---|---|---|---|---|---|")
    for case, results in zip(cases, zip(*runs, strict=True), strict=True):
        median_s = float(np.median([taken for taken, _ in results]))
        print(
            f"| {case.name} | {len(case.mesh.faces):,} | {100 * case.spacing_m:.0f} cm"
            f" | {results[0][1]:,} | {median_s:.2f} | {N_POSES / median_s:,.0f} |"
        )


if __name__ == "__main__":
    main()
