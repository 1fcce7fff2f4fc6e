"""Every scene to be turned by hand: its mesh, where the cameras went, and where labels put them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from synfeal.config import Design
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.inspect.surface import SurfacePoints
from synfeal.inspect.viewer_mesh import viewer_mesh
from synfeal.mesh.load import load_mesh
from synfeal.report.html.render import render
from synfeal.report.layouts import SOURCES, scene_title
from synfeal.seeds import generator_of

SPLITS = {"train": ("Cameras, training", (0, 114, 178)), "test": ("Cameras, test", (213, 94, 0))}
# Okabe and Ito's colours that are left, for label sets that were estimated.
LABEL_RGB = ((204, 121, 167), (0, 158, 115), (230, 159, 0), (86, 180, 233), (0, 0, 0))
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trajectory:
    """Camera paths that are shown or hidden together."""

    title: str  # what stands beside the box to tick
    rgb: tuple[int, int, int]  # colour, 0 to 255
    paths_m: tuple[Array, ...]  # one polyline (N, 3) per path, world, metres
    is_shown: bool  # from the start


def room_html(scene: str, root: Path, design: Design) -> Markup:
    """The view of one scene, ready for ``report.js``; the design says what label sets there are."""
    mesh = load_mesh(root / "scenes" / scene / "mesh.glb")
    small = viewer_mesh(mesh, SurfacePoints.of(mesh, generator_of(0, "report", scene)))
    drawn = trajectories(scene, root, design)
    data = small.scene([(path, one.rgb) for one in drawn for path in one.paths_m])
    return render("room.html", scene=scene, title=scene_title(scene), drawn=drawn, data=data)


def trajectories(scene: str, root: Path, design: Design) -> list[Trajectory]:
    """The planned cameras of both splits, then every estimated label set of the scene."""
    found = [
        Trajectory(title, rgb, paths_of(read_pose_table(path)), True)
        for split, (title, rgb) in SPLITS.items()
        if (path := root / "plans" / scene / f"{split}.csv").exists()
    ]
    sets = [(size, labels) for where, size, labels in design.estimated if where == scene]
    for (size, labels), rgb in zip(sets, LABEL_RGB * len(sets), strict=False):
        folder = root / "labels" / scene / size / labels
        tables = [read_pose_table(folder / f"{split}.csv") for split in SPLITS]
        paths = tuple(path for table in tables for path in paths_of(table))
        found.append(Trajectory(f"{SOURCES[labels]} labels, {size}", rgb, paths, False))
    return found


def paths_of(table: PoseTable) -> tuple[Array, ...]:
    """Camera centres (N, 3) of each path that has more than one frame."""
    starts = np.flatnonzero(np.diff(table.path)) + 1
    return tuple(path for path in np.split(table.position_m, starts) if len(path) > 1)
