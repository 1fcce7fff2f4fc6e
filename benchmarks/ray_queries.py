"""How fast the admissibility of candidates is decided: ours against trimesh's two ray engines.

``python -m benchmarks.ray_queries`` prints a table. All engines answer the same questions, in
turns, on one mesh; a figure is the median of several runs.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.ray import ray_pyembree, ray_triangle

from synfeal.config import load_config
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import Triangles, merge_vertices
from synfeal.planning.plan import sampling_box_of
from synfeal.planning.questions import Questions, draw_questions
from synfeal.planning.sampling import view_directions
from synfeal.scenes.prepare import build_or_load

Answers = NDArray[np.bool_]
N_RUNS = 5
N_FAST, N_SLOW = 10_000, 200  # trimesh's own engine takes milliseconds a ray


def first_hits_m(
    engine: ray_triangle.RayMeshIntersector,
    origins: NDArray[np.float64],
    directions: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Distances (N,) to the first hits through trimesh's interface, ``inf`` where there is none."""
    place, ray, _ = engine.intersects_location(origins, directions, multiple_hits=False)
    distance = np.full(len(origins), np.inf)
    distance[ray] = np.linalg.norm(place - origins[ray], axis=1)
    return distance


def trimesh_answers(engine: ray_triangle.RayMeshIntersector, questions: Questions) -> Answers:
    """The planner's decision (section 3.2) written with trimesh."""
    starts, ends = questions.starts[:, :3], questions.candidates[:, :3]
    length = np.linalg.norm(ends - starts, axis=1)
    reachable = first_hits_m(engine, starts, (ends - starts) / length[:, None]) > length
    view_m = first_hits_m(engine, ends, view_directions(questions.candidates))
    far = (view_m > questions.min_view_distance_m) & np.isfinite(view_m)
    return np.asarray(reachable & far, dtype=np.bool_)


def engines(mesh: Triangles) -> dict[str, Callable[[Questions], Answers]]:
    """The ways to answer, by name."""
    ours = RayCaster(*mesh)
    surface = trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
    rtree = ray_triangle.RayMeshIntersector(surface)
    embree = ray_pyembree.RayMeshIntersector(surface)
    return {
        "synfeal": lambda questions: questions.answers(ours),
        "trimesh, embreex": lambda questions: trimesh_answers(embree, questions),
        "trimesh, rtree": lambda questions: trimesh_answers(rtree, questions),
    }


def first_of(questions: Questions, count: int) -> Questions:
    """The first ``count`` questions."""
    return Questions(
        questions.starts[:count], questions.candidates[:count], questions.min_view_distance_m
    )


def measure(mesh: Triangles, questions: Questions) -> list[tuple[str, int, float, float]]:
    """Name, candidates asked, candidates per second, and share of answers that are ours."""
    ways = engines(mesh)
    asked = {name: first_of(questions, N_SLOW if "rtree" in name else N_FAST) for name in ways}
    expected = ways["synfeal"](questions)
    seconds: dict[str, list[float]] = {name: [] for name in ways}
    equal = {}
    for run in range(N_RUNS + 1):  # the first builds what is built on demand
        for name, answer in ways.items():
            begin = time.perf_counter()
            found = answer(asked[name])
            if run:
                seconds[name].append(time.perf_counter() - begin)
            equal[name] = float(np.mean(found == expected[: len(found)]))
    counts = {name: len(some.candidates) for name, some in asked.items()}
    return [
        (name, counts[name], counts[name] / float(np.median(taken)), equal[name])
        for name, taken in seconds.items()
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure one scene of the default profile and print a table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.ray_queries", description=__doc__)
    parser.add_argument("--scene", default="large_room", help="a scene of the configuration")
    name = parser.parse_args(arguments).scene
    config = load_config(Path("config/config.yaml"))
    scene = config.scenes[name]
    textured = build_or_load(scene, config.seed, name)
    mesh = merge_vertices(*textured.merged())
    box = sampling_box_of(scene, textured.bounds_m, name)
    questions = draw_questions(RayCaster(*mesh), scene, box, np.random.default_rng(0), N_FAST)
    rows = measure(mesh, questions)
    print(f"{name}: {len(mesh.faces):,} faces, median of {N_RUNS} interleaved runs\n")
    print("| engine | candidates | candidates/s | times ours | same answers |")
    print("|---|---|---|---|---|")
    for engine, count, speed, equal in rows:
        print(f"| {engine} | {count:,} | {speed:,.0f} | {speed / rows[0][2]:.4f} | {equal:.4%} |")


if __name__ == "__main__":
    main()
