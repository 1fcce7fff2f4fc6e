"""Error against the size of the image: feature matching beside networks of two sizes.

    python -m benchmarks.gpu_frames plan OUT
    python -m benchmarks.image_size measure OUT results/benchmarks/image_size.csv
    python -m benchmarks.image_size draw results/benchmarks

The first plans the frames of `night`'s Large Room that the networks of ``benchmarks/gpu.sh`` were
trained and tested on. The second draws every fourth of the 6,000 training frames with depth, every
eighth of the 2,500 test frames, and locates these by matched features, each at several sizes of
image. An inlier is at most 1/80 of the width off, which is the 4 pixels of the reference methods
at 320. The third draws the picture beside ``gpu_errors.csv``.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image
from tqdm import tqdm

from baselines.config.references import ReferencesConfig
from baselines.references.arrays import most_alike
from baselines.references.correspondences import match_test_frames
from baselines.references.descriptors import Vlad
from baselines.references.features import features_of
from baselines.references.mapped import VIEW_PX
from baselines.references.structure import lifted, localize
from reproduction.figures.style import BLUE, GREEN, VERMILION
from reproduction.report.stamped import digest, stamped_png, write_stamped
from reproduction.tables.layouts import TITLES
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.packed import fit_frame
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.errors import exit_status
from synfeal.evaluation.bootstrap import limits, medians, path_counts
from synfeal.geometry.poses import pose_error
from synfeal.mesh.load import load_mesh
from synfeal.records.provenance import generator_of
from synfeal.records.tables import COUNT, NUMBER, TEXT, read_frame, write_frame
from synfeal.render.choose import open_renderer

WIDTHS_PX = (64, 88, 160, 320)
MAP_EVERY, TEST_EVERY = 4, 8
BOUND = 1 / 80  # largest reprojection error of an inlier, of the width
TABLE, PICTURE, NETWORKS = "image_size.csv", "image_size.png", "gpu_errors.csv"
CENTIMETRES = 100.0


class Row(NamedTuple):
    """Median errors at one size of image, with 95 % limits over test paths."""

    width_px: int
    map_frames: int
    test_frames: int
    test_paths: int
    found: int
    position_m: float
    position_m_low: float
    position_m_high: float
    orientation_deg: float
    orientation_deg_low: float
    orientation_deg_high: float


class Frames(NamedTuple):
    """Drawn frames.

    Attributes:
        poses: Their poses.
        rgb: Colours (N, H, W, 3).
        depth_m: Depth (N, H, W) along the optical axis, metres.
    """

    poses: PoseTable
    rgb: NDArray[np.uint8]
    depth_m: NDArray[np.float32]


def measure(folder: Path, out_csv: Path) -> None:
    """Locate test frames by matched features at each size of image.

    Args:
        folder: Directory that ``benchmarks.gpu_frames plan`` wrote.
        out_csv: Table to write.

    Raises:
        InputError: Mesh or poses cannot be read.
    """
    mesh = load_mesh(folder / "scene" / "mesh.glb")
    poses = {
        split: read_pose_table(folder / "labels" / f"{split}.csv").at(slice(None, None, step))
        for split, step in (("train", MAP_EVERY), ("test", TEST_EVERY))
    }
    rows = []
    for width in WIDTHS_PX:
        camera = CameraConfig(width=width, height=width * 3 // 4)
        with open_renderer(mesh, camera) as renderer:
            drawn = {}
            for split, table in poses.items():
                views = [
                    renderer.render_rgbd(pose)
                    for pose in tqdm(table.world_from_cam, f"{split} {width} px", mininterval=5)
                ]
                rgb, depth_m = (np.stack(part) for part in zip(*views, strict=True))
                drawn[split] = Frames(table, rgb, depth_m)
        rows.append(locate(drawn["train"], drawn["test"], camera))
        write_frame(out_csv, pd.DataFrame(rows), "%.5g")


def locate(known: Frames, asked: Frames, camera: CameraConfig) -> Row:
    """Locate frames in a map of others, as the reference method with depth does.

    Args:
        known: Frames of the map.
        asked: Frames to locate; their depth is not used.
        camera: Camera of both.
    """
    references = ReferencesConfig()
    train, test = (
        features_of(map(_grey, frames.rgb), depth, camera, references)
        for frames, depth in ((known, iter(known.depth_m)), (asked, None))
    )
    views, queries = (np.stack([*map(_view, frames.rgb)]) for frames in (known, asked))
    vlad = Vlad.learn(views, seed=0)
    retrieved = most_alike(vlad.describe(views), vlad.describe(queries), references.retrieved)
    matches = match_test_frames(train, test, retrieved)
    found = localize(matches, lifted(matches, known.poses), camera, 0, BOUND * camera.width)
    return _row(found, asked.poses, camera.width, len(known.poses))


def _grey(rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.asarray(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), dtype=np.uint8)


def _view(rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return fit_frame(Image.fromarray(rgb), VIEW_PX, "whole")


def _row(found: NDArray[np.float64], truth: PoseTable, width_px: int, map_frames: int) -> Row:
    """Score poses; what was not found counts as the worst."""
    true = truth.world_from_cam
    lost = np.asarray(~np.isfinite(found).all(axis=(1, 2)))
    position_m, angle_rad = pose_error(np.where(lost[:, None, None], true, found), true)
    _, path = np.unique(truth.path, return_inverse=True)
    n_paths = int(path.max()) + 1
    counts = path_counts(n_paths, generator_of("image size"))
    numbers: list[float] = []
    for errors in (position_m, np.degrees(angle_rad)):
        sample = medians(np.where(lost, np.inf, errors), path, counts)
        numbers += [float(sample[0]), *limits(sample)]
    return Row(width_px, map_frames, len(truth), n_paths, int((~lost).sum()), *numbers)


NETWORK_SCHEMA = {
    "localizer": TEXT,
    "input_px": COUNT,
    "width": NUMBER,
    "images": COUNT,
    "position_m": NUMBER,
}
SCHEMA = dict.fromkeys(Row._fields, NUMBER)
MARKS = {"posenet": "o", "poselstm": "s", "posenet2": "v"}


def draw(folder: Path) -> None:
    """Draw structure at all sizes, and networks at theirs, from the two tables of a folder.

    Raises:
        InputError: A table cannot be read.
    """
    structure = read_frame(folder / TABLE, SCHEMA, "measure again")
    networks = read_frame(folder / NETWORKS, NETWORK_SCHEMA, "run benchmarks/gpu.sh")
    shown = digest([structure.to_csv(), networks.to_csv()])
    drawn = stamped_png(lambda: figure_of(structure, networks), shown)
    write_stamped(drawn, folder / PICTURE)


def figure_of(structure: pd.DataFrame, networks: pd.DataFrame) -> Figure:
    """Draw median position errors over the width of the image, both logarithmic."""
    figure = Figure(figsize=(7.5, 5.2), layout="constrained")
    axes = figure.subplots()
    width_px, middle = structure["width_px"], structure["position_m"]
    ends = [middle - structure["position_m_low"], structure["position_m_high"] - middle]
    axes.errorbar(
        width_px,
        CENTIMETRES * middle,
        CENTIMETRES * np.array(ends),
        color=BLUE,
        marker="D",
        lw=1.5,
        capsize=3,
        label=f"matched features, map of {int(structure['map_frames'].iloc[0]):,} frames",
    )
    for _, own in networks.groupby(["localizer", "input_px"], sort=False):
        row = own.iloc[0]
        name = str(row["localizer"])
        width = "full width" if row["width"] == 1 else f"{row['width']:g} of its width"
        axes.plot(
            own["input_px"],
            CENTIMETRES * own["position_m"],
            MARKS[name],
            color=VERMILION if row["input_px"] < 100 else GREEN,
            mec="white",
            mew=0.5,
            ms=8,
            ls="none",
            label=f"{TITLES[name]}, {width}, {row['images']:,} images",
        )
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks([64, 88, 160, 224, 320], ["64", "88", "160", "224", "320"])
    axes.minorticks_off()
    axes.set_yticks([0.1, 0.3, 1, 3, 10, 30, 100], ["0.1", "0.3", "1", "3", "10", "30", "100"])
    axes.set_xlim(58, 350)
    axes.set_ylim(0.1, 100)
    axes.set_xlabel("width of the image, pixels")
    axes.set_ylabel("median position error, cm")
    axes.grid(color="0.92")
    axes.spines[["top", "right"]].set_visible(False)
    figure.legend(loc="outside lower center", ncols=2, fontsize=9)
    return figure


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return 0, or 1 after ``error: ...`` for what a person can put right."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.image_size", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    measuring = commands.add_parser("measure")
    measuring.add_argument("folder", type=Path, help="that was planned into")
    measuring.add_argument("out", type=Path, help="table to write")
    drawing = commands.add_parser("draw")
    drawing.add_argument("folder", type=Path, help="of both tables")
    options = parser.parse_args(arguments)
    if options.command == "draw":
        return exit_status(lambda: draw(options.folder), "draw again")
    return exit_status(lambda: measure(options.folder, options.out), "measure again")


if __name__ == "__main__":
    sys.exit(main())
