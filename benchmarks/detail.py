"""Savings of levels of detail per frame, and the distance of their images from the truth.

Writes ``<out>.csv``, a row for each scene, size of image and way to draw, and ``<out>.png``::

    python -m benchmarks.detail --results results/mini large_room sanctuary

A scene is ``scenes/NAME/mesh.glb`` and ``plans/NAME/test.csv`` below the results. Times are of the
processor, all threads together, in turns with the full mesh at 2x2 samples: those of the full mesh,
median over all rounds, times the median of the ratios, so that what else the machine does matters
little. Errors are from 64 samples per pixel of the full mesh.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from benchmarks.page import mark_front
from benchmarks.rows import read_rows
from reproduction.figures.style import BLUE, GREEN, ORANGE, RC, VERMILION
from synfeal.collection.detail import choose_detail
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset.pose_table import read_pose_table
from synfeal.errors import exit_status
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.triangles import with_fewer_faces, with_smaller_textures
from synfeal.records.files import atomic_path
from synfeal.records.tables import write_frame
from synfeal.records.timing import seconds_of
from synfeal.render import open_renderer
from synfeal.render.base import Renderer, reference_images

POSES, ROUNDS = 6, 5
USUAL = RenderConfig(backend="opengl")
SAMPLES = (1, 2, 3)
COLORS = {"full": BLUE, "chosen": VERMILION, "textures 1/4": ORANGE, "faces 1/4": GREEN}

Poses = NDArray[np.float64]


class Way(NamedTuple):
    """A way to draw a scene."""

    level: str  # what of the mesh is drawn
    mesh: TexturedMesh
    supersampling: int  # samples per pixel along each axis


def ways(mesh: TexturedMesh, camera: CameraConfig, poses: Poses) -> Iterator[Way]:
    """List the ways to draw a scene: with all detail, the level chosen, or one detail less.

    Args:
        mesh: The full mesh.
        camera: Camera of the images.
        poses: ``world_from_cam`` (N, 4, 4) by which the level is chosen.

    Yields:
        The full mesh and the level chosen, with each of ``SAMPLES``; then smaller textures, and
        fewer triangles, alone.
    """
    chosen = choose_detail(mesh, camera, poses, USUAL).chosen.mesh
    for samples in SAMPLES:
        yield Way("full", mesh, samples)
    for samples in SAMPLES if chosen is not mesh else ():
        yield Way("chosen", chosen, samples)
    if any(part.texture is not None for part in mesh.parts):
        yield Way("textures 1/4", with_smaller_textures(mesh, 4), USUAL.supersampling)
    yield Way("faces 1/4", with_fewer_faces(mesh, mesh.n_faces // 4), USUAL.supersampling)


def measure(name: str, results: Path, camera: CameraConfig) -> Iterator[dict[str, object]]:
    """Measure time and error of all ways to draw a scene.

    Args:
        name: Name of the scene.
        results: Results of a profile, with its mesh and plan.
        camera: Camera of the images.

    Yields:
        One row for each way.
    """
    mesh = load_mesh(results / "scenes" / name / "mesh.glb")
    every = read_pose_table(results / "plans" / name / "test.csv").world_from_cam
    poses = every[np.linspace(0, len(every) - 1, min(POSES, len(every))).astype(int)]
    plain = USUAL.model_copy(update={"supersampling": 1})
    truth = np.stack(
        list(reference_images(lambda finer: open_renderer(mesh, finer, plain), camera, poses))
    )
    rows, seconds = [], []
    with open_renderer(mesh, camera, USUAL) as full:
        for way in ways(mesh, camera, every):
            render = USUAL.model_copy(update={"supersampling": way.supersampling})
            with open_renderer(way.mesh, camera, render) as renderer:
                seen = np.stack([renderer.render(pose) for pose in poses])
                works = [partial(draw_all, each, poses) for each in (full, renderer)]
                seconds.append([seconds_of(works, of_processor=True) for _ in range(ROUNDS)])
            error = float(np.abs(seen - truth).mean(dtype=np.float64))
            size = {"width": camera.width, "height": camera.height}
            row = {"scene": name, **size, "level": way.level, "supersampling": way.supersampling}
            rows.append({**row, "faces": way.mesh.n_faces, "error_levels": error})
    times = np.array(seconds)  # ways, rounds, the full mesh and the way
    full_ms = 1e3 * float(np.median(times[..., 0])) / len(poses)
    ratios = np.median(times[..., 1] / times[..., 0], axis=1)
    for row, ratio in zip(rows, ratios.tolist(), strict=True):
        usual = row["level"] == "full" and row["supersampling"] == USUAL.supersampling
        yield {**row, "cpu_ms": full_ms * (1.0 if usual else ratio)}


def draw_all(renderer: Renderer, poses: Poses) -> None:
    """Draw each view once."""
    for pose in poses:
        renderer.render(pose)


def draw(path: Path, table: pd.DataFrame) -> None:
    """Draw error against time, a panel for each scene and size; the shipped way is ringed."""
    scenes = list(table.groupby("scene", sort=False))
    n_sizes = max(rows.groupby(["width", "height"]).ngroups for _, rows in scenes)
    with mpl.rc_context(RC), atomic_path(path) as temporary:
        figure = Figure(
            figsize=(0.6 + 2.9 * len(scenes), 0.7 + 2.5 * n_sizes), layout="constrained"
        )
        panels = figure.subplots(n_sizes, len(scenes), squeeze=False)
        for column, (name, of_scene) in enumerate(scenes):
            for panel in panels[of_scene.groupby(["width", "height"]).ngroups :, column]:
                panel.set_visible(False)
            for row, (size, rows) in enumerate(of_scene.groupby(["width", "height"], sort=False)):
                panel = panels[row, column]
                for level, of_level in rows.groupby("level", sort=False):
                    style = {"color": COLORS[str(level)], "marker": "o", "markersize": 4}
                    line = of_level.sort_values("supersampling")
                    panel.plot(line["cpu_ms"], line["error_levels"], label=str(level), **style)
                shipped = {"level": shipped_level(rows), "supersampling": str(USUAL.supersampling)}
                mark_front(panel, rows, "cpu_ms", "error_levels", shipped)
                panel.set_title(f"{str(name).replace('_', ' ')}, {size[0]} × {size[1]}")
                panel.set(xlim=(0, None), ylim=(0, None))
                panel.grid(color="0.94")
        for panel in panels[-1]:
            panel.set_xlabel("ms of the processor a frame")
        for panel in panels[:, 0]:
            panel.set_ylabel("mean error (levels)")
        handles = panels[0, 0].get_legend_handles_labels()
        title = "1 × 1, 2 × 2 and 3 × 3 samples are joined; grey: beaten; ringed: in use"
        figure.legend(*handles, title=title, loc="outside lower center", ncols=4)
        figure.savefig(temporary, dpi=130)


def shipped_level(rows: pd.DataFrame) -> str:
    """Return the level chosen for a scene at a size, where it is not the full mesh."""
    return "chosen" if "chosen" in set(rows["level"]) else "full"


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure scenes at sizes; rows of others that are in the table are kept."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.detail", description=__doc__)
    parser.add_argument("scenes", nargs="+", help="names below scenes/")
    parser.add_argument("--results", type=Path, default=Path("results/mini"))
    parser.add_argument("--sizes", nargs="+", default=["88x66", "320x240"], metavar="WxH")
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks/detail"))
    options = parser.parse_args(arguments)

    def run() -> None:
        path = options.out.with_suffix(".csv")
        table = read_rows(path)
        for name in options.scenes:
            for size in options.sizes:
                width, height = map(int, size.split("x"))
                camera = CameraConfig(width=width, height=height)
                rows = pd.DataFrame(list(measure(name, options.results, camera)))
                if len(table):
                    stale = (table["scene"] == name) & (table["width"] == width)
                    rows = pd.concat([table[~stale], rows], ignore_index=True)
                table = rows
                write_frame(path, table, "%.5g")
        draw(options.out.with_suffix(".png"), table)

    return exit_status(run, "rows that were measured are kept")


if __name__ == "__main__":
    sys.exit(main())
