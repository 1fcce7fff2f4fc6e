"""A table of the pairs of frames that see the same surfaces, and optical flow between them."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.depth_agreement import check_depth
from synfeal.errors import Argument, InputError
from synfeal.geometry.poses import pose_error
from synfeal.pairing.choose import Choice
from synfeal.pairing.correspondence import TOLERANCE, DepthImage, State
from synfeal.pairing.flow import flow_between, write_flows
from synfeal.pairing.frames import DepthFrames, read_depth_frames
from synfeal.pairing.overlap import GRID, grid_points, overlaps_with
from synfeal.records.files import (
    atomic_directory,
    refuse_existing,
    refuse_inside,
    write_json,
    write_text,
)
from synfeal.records.progress import Progress
from synfeal.records.tables import MAYBE_TEXT, NUMBER, TEXT, read_frame, rows_of, write_frame

if TYPE_CHECKING:
    import pandas as pd

Among = Literal["each", "train", "test", "all"]
TABLE, LIST, RECORD, FLOWS = "pairs.csv", "pairs.txt", "pairs.json", "flow"
SCHEMA = {
    "image_a": TEXT,
    "image_b": TEXT,
    "split_a": MAYBE_TEXT,
    "split_b": MAYBE_TEXT,
    "overlap_ab": NUMBER,
    "overlap_ba": NUMBER,
    "distance_m": NUMBER,
    "angle_deg": NUMBER,
    "flow": MAYBE_TEXT,
}
MOST_FRAMES = 20_000  # all pairs of them are compared: 1.6 GB of overlaps
MOST_POINTS = 2 * 10**8  # in all frames together: 4.8 GB


@dataclass(frozen=True)
class PairsJob:
    """A comparison of frames, and the files to write.

    Attributes:
        dataset: Data set with depth.
        out: Directory to create.
        among: Which frames are paired: those of ``each`` split with one another, of ``train`` or
            ``test`` alone, or ``all``, across splits too.
        choice: Which pairs are kept.
        every: Take every such frame of each sequence.
        tolerance: Relative difference of depth up to which a point is visible.
        grid: Columns and rows of the cells whose middles are compared.
        flow: Whether to write optical flow of the pairs that are kept.
        camera_file: A calibration in place of the manifest's camera.
    """

    dataset: Path
    out: Path
    among: Among = "each"
    choice: Choice = field(default_factory=Choice)
    every: int = 1
    tolerance: float = TOLERANCE
    grid: tuple[int, int] = GRID
    flow: bool = False
    camera_file: Path | None = None

    def check(self) -> None:
        """Refuse values out of their bounds.

        Raises:
            InputError: One is; the message names its option.
        """
        for name in ("min_overlap", "max_overlap"):
            value = getattr(self.choice, name)
            if not 0.0 <= value <= 1.0:
                raise InputError(Argument(name), f"must be 0 to 1, found {value:g}")
        if self.choice.min_overlap > self.choice.max_overlap:
            raise InputError(Argument("min_overlap"), "must not be above `max_overlap`")
        if self.choice.per_frame is not None and self.choice.per_frame < 1:
            raise InputError(
                Argument("per_frame"), f"must be at least 1, found {self.choice.per_frame}"
            )
        if self.every < 1:
            raise InputError(Argument("stride"), f"must be at least 1, found {self.every}")
        if not 0.0 < self.tolerance < 1.0:
            raise InputError(
                Argument("tolerance"), f"must be above 0 and below 1, found {self.tolerance:g}"
            )
        if not all(2 <= side <= 8192 for side in self.grid):
            raise InputError(
                Argument("grid"),
                f"each side must be 2 to 8192, found {self.grid[0]} {self.grid[1]}",
            )


@dataclass(frozen=True)
class Found:
    """Outcome of a job.

    Attributes:
        frames: Frames that were compared.
        compared: Pairs that were compared.
        table: Pairs that were kept, with the columns of :data:`SCHEMA`.
    """

    frames: int
    compared: int
    table: pd.DataFrame


def find_pairs(job: PairsJob) -> Found:
    """Write the table of pairs, and flow if that is asked for, to a directory.

    Raises:
        InputError: An option is out of its bounds, ``out`` is not empty, the data set cannot be
            used, its depth and poses do not fit together, or no two frames can be compared.
    """
    job.check()
    refuse_existing(job.out)
    refuse_inside(job.out, job.dataset)
    splits = (job.among,) if job.among in ("train", "test") else ("train", "test")
    frames = read_depth_frames(job.dataset, splits, job.camera_file, job.every)
    if job.flow and not frames.is_color:
        raise InputError(
            Argument("flow"),
            f"the depth images of {job.dataset} are of another camera than its colour images",
            "give the camera of both with `camera`",
        )
    groups = _groups(frames, job.among)
    if len(frames) > MOST_FRAMES:
        raise InputError(
            job.dataset,
            f"has {len(frames)} frames, and at most {MOST_FRAMES} are compared",
            f"give `stride={math.ceil(job.every * len(frames) / MOST_FRAMES)}`",
        )
    _refuse_fine_grid(job.grid, frames)
    if not any(len(group) > 1 for group in groups):
        raise InputError(job.dataset, "has no two frames to compare", "give another `among`")
    if frames.camera.projection is None:
        check_depth(frames.posed_depth)
    with atomic_directory(job.out) as directory:
        table, compared = _table(job, frames, groups)
        if job.flow:
            (directory / FLOWS).mkdir()
            table["flow"] = _write_flows(job, frames, table, directory)
        table = table[list(SCHEMA)]
        write_frame(directory / TABLE, table)
        lines = [f"{row.image_a} {row.image_b}\n" for row in rows_of(table)]
        write_text(directory / LIST, "".join(lines))
        write_json(directory / RECORD, _record(job, len(frames), compared, len(table)))
    return Found(frames=len(frames), compared=compared, table=table)


def _refuse_fine_grid(grid: tuple[int, int], frames: DepthFrames) -> None:
    """Refuse more points than pixels, and more than memory is likely to hold."""
    (columns, rows), camera = grid, frames.camera
    if columns > camera.width or rows > camera.height:
        raise InputError(
            Argument("grid"),
            f"{columns} x {rows} points are finer than the {camera.width} x {camera.height} pixels"
            " of a frame",
            "give fewer",
        )
    if (count := columns * rows * len(frames)) > MOST_POINTS:
        raise InputError(
            Argument("grid"),
            f"{count:.2g} points of {len(frames)} frames are more than {MOST_POINTS:.0e}",
            "give fewer, or `stride`",
        )


def read_pairs(path: Path | str) -> pd.DataFrame:
    """Read ``pairs.csv`` of a directory of pairs, or the file itself.

    Raises:
        InputError: It is missing or no such table.
    """
    file = Path(path) / TABLE if Path(path).is_dir() else Path(path)
    return read_frame(file, SCHEMA, "run synfeal pairs again")


def _groups(frames: DepthFrames, among: Among) -> list[NDArray[np.int64]]:
    """Group the indices of the frames that are paired with one another."""
    if among == "all":
        return [np.arange(len(frames))]
    split = np.array(frames.splits, str)
    return [np.flatnonzero(split == name) for name in sorted(set(frames.splits))]


def _table(
    job: PairsJob, frames: DepthFrames, groups: list[NDArray[np.int64]]
) -> tuple[pd.DataFrame, int]:
    """Tabulate the pairs that are kept with the indices of their frames; count those compared."""
    import pandas as pd  # takes time to load

    with Progress(len(frames), "read") as progress:
        point_m = grid_points(
            frames.camera, frames.depth_m, frames.world_from_cam, job.grid, progress.update
        )
    n_directed = sum(len(group) * (len(group) - 1) for group in groups)
    parts = []
    with Progress(n_directed, "compare", unit="pair") as progress:
        for group in groups:
            overlap = _overlaps(job, frames, point_m, group, progress)
            first, second = np.triu_indices(len(group), 1)
            ab, ba = overlap[first, second], overlap[second, first]
            kept = job.choice.rows(first, second, ab, ba)
            a, b = group[first[kept]], group[second[kept]]
            parts.append(
                pd.DataFrame({"a": a, "b": b, "overlap_ab": ab[kept], "overlap_ba": ba[kept]})
            )
    table = pd.concat(parts, ignore_index=True)
    a, b = table["a"].to_numpy(), table["b"].to_numpy()
    distance_m, angle_rad = pose_error(frames.world_from_cam[a], frames.world_from_cam[b])
    for end, rows in (("a", a), ("b", b)):
        table[f"image_{end}"] = [frames.image(index) for index in rows.tolist()]
        table[f"split_{end}"] = [frames.splits[index] for index in rows.tolist()]
    table["distance_m"], table["angle_deg"], table["flow"] = distance_m, np.degrees(angle_rad), ""
    return table, n_directed // 2


def _overlaps(
    job: PairsJob,
    frames: DepthFrames,
    point_m: NDArray[np.float64],
    group: NDArray[np.int64],
    progress: Progress,
) -> NDArray[np.float32]:
    """Compute overlaps (G, G) in a group: row a, column b is the share of a that b sees."""
    overlap = np.ones((len(group), len(group)), np.float32)
    for column, index in enumerate(group.tolist()):
        others = np.flatnonzero(group != index)
        overlap[others, column] = overlaps_with(
            point_m,
            group[others],
            frames.camera,
            DepthImage(frames.depth_m(index)),
            frames.world_from_cam[index],
            job.tolerance,
        )
        progress.update(len(others))
    return overlap


def _write_flows(
    job: PairsJob, frames: DepthFrames, table: pd.DataFrame, directory: Path
) -> list[str]:
    """Write the flows of all pairs; their files, relative to the directory."""
    names = []
    with Progress(len(table), "flow", unit="pair") as progress:
        for row in rows_of(table):
            ends = [frames.frames[index].name.replace("/", "-") for index in (row.a, row.b)]
            name = f"{FLOWS}/{ends[0]}_{ends[1]}.npz"
            depth_m = [frames.depth_m(index) for index in (row.a, row.b)]
            poses = [frames.world_from_cam[index] for index in (row.a, row.b)]
            flows = [
                flow_between(
                    camera=frames.camera,
                    depth_a_m=depth_m[first],
                    world_from_a=poses[first],
                    depth_b_m=depth_m[1 - first],
                    world_from_b=poses[1 - first],
                    tolerance=job.tolerance,
                )
                for first in (0, 1)
            ]
            write_flows(directory / name, *flows)
            names.append(name)
            progress.update()
    return names


def _record(job: PairsJob, n_frames: int, compared: int, kept: int) -> dict[str, Any]:
    """Return the record of what was done, for a reader of the directory."""
    return {
        "dataset": job.dataset.resolve().name,
        "frames": n_frames,
        "compared": compared,
        "kept": kept,
        "overlap": "share of the pixels of a with depth whose points are visible in b, over the"
        " middles of equal cells of a's image",
        "flow": "pixels from a to b, x right, y down; NaN for none",
        "states": {state.name.lower(): int(state) for state in State},
        "settings": {
            "among": job.among,
            "every": job.every,
            "tolerance": job.tolerance,
            "grid": list(job.grid),
            **asdict(job.choice),
        },
    }
