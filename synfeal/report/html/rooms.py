"""Every scene to be turned by hand: its mesh, where the cameras went, and where labels put them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from baselines.groundtruth.methods import METHODS
from synfeal.config import Experiment
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.inspect.surface import SurfacePoints
from synfeal.inspect.viewer_mesh import ViewerMesh, viewer_mesh
from synfeal.mesh.load import load_mesh
from synfeal.report.layouts import SOURCES, scene_title
from synfeal.seeds import generator_of

SPLITS = {"train": ("Cameras, training", (0, 114, 178)), "test": ("Cameras, test", (213, 94, 0))}
# Okabe and Ito's colours that are left, for label sets that were estimated.
LABEL_RGB = ((204, 121, 167), (0, 158, 115), (230, 159, 0), (86, 180, 233), (0, 0, 0))
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trajectory:
    """Camera paths that are shown or hidden together.

    Attributes:
        title: what stands beside the box to tick.
        rgb: colour, 0 to 255.
        paths_m: one polyline (N, 3) per path, world, metres.
        is_shown: from the start.
    """

    title: str
    rgb: tuple[int, int, int]
    paths_m: tuple[Array, ...]
    is_shown: bool


def room_html(scene: str, root: Path, rows: Sequence[Experiment]) -> str:
    """The view of one scene, ready for ``report.js``.

    Args:
        scene: its name.
        root: results directory of the profile.
        rows: the design, which says what label sets there are.

    Raises:
        InputError: the mesh, a plan or a label set cannot be read.
    """
    mesh = load_mesh(root / "scenes" / scene / "mesh.glb")
    small = viewer_mesh(mesh, SurfacePoints.of(mesh, generator_of(0, "report", scene)))
    return _html(scene, small, trajectories(scene, root, rows))


def trajectories(scene: str, root: Path, rows: Sequence[Experiment]) -> list[Trajectory]:
    """The planned cameras of both splits, then every estimated label set of the scene."""
    found = [
        Trajectory(title, rgb, paths_of(read_pose_table(path)), True)
        for split, (title, rgb) in SPLITS.items()
        if (path := root / "plans" / scene / f"{split}.csv").exists()
    ]
    sets = dict.fromkeys(
        (row.size, row.labels) for row in rows if row.scene == scene and row.labels in METHODS
    )
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


def _html(scene: str, mesh: ViewerMesh, drawn: Sequence[Trajectory]) -> str:
    lines = [(path, trajectory.rgb) for trajectory in drawn for path in trajectory.paths_m]
    ends = np.cumsum([len(trajectory.paths_m) for trajectory in drawn]).tolist()
    boxes = "".join(
        _box(trajectory, start, end)
        for trajectory, start, end in zip(drawn, [0, *ends], ends, strict=False)
    )
    title = escape(scene_title(scene))
    data = json.dumps(mesh.scene(lines), allow_nan=False).replace("<", "\\u003c")
    return (
        f'<div class="room" id="room-{escape(scene)}"><h3>{title}</h3>'
        f'<canvas tabindex="0" role="img" aria-label="{title}, to be turned by hand"></canvas>'
        '<p class="fallback" hidden>This browser offers no WebGL 2.</p>'
        f'<div class="controls">{boxes}<label>Cut above <input type="range" class="cut" min="0"'
        ' max="1" step="0.005" value="1"> <output></output></label></div>'
        f'<script type="application/json">{data}</script></div>'
    )


def _box(trajectory: Trajectory, start: int, end: int) -> str:
    colour = "rgb({}, {}, {})".format(*trajectory.rgb)
    checked = " checked" if trajectory.is_shown else ""
    return (
        f'<label><input type="checkbox" class="trajectory" data-start="{start}" data-end="{end}"'
        f'{checked}> <span class="swatch" style="background: {colour}"></span>'
        f"{escape(trajectory.title)}</label>"
    )
