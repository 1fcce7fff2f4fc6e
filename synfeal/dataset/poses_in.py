"""The one reader of pose files and trajectories, which tells each format by its content.

- 7-Scenes: ``seq-XX/frame-XXXXXX.pose.txt``, four rows of ``world_from_cam``.
- TUM RGB-D ("File Formats"): ``timestamp tx ty tz qx qy qz qw``, ``world_from_cam``.
- KITTI odometry (``devkit/readme.txt``): the first three rows of ``world_from_cam``, one line for
  each frame, in order.
- EuRoC (Burri et al., IJRR 2016; ``state_groundtruth_estimate0/data.csv``): a CSV of a time in
  whole nanoseconds, position and quaternion ``wxyz`` of ``world_from_body``, and further columns.
  Without these, and with times that may be seconds, it may be TUM with commas: a person says which.
- COLMAP ("Output Format"): ``images.txt`` or ``images.bin``, ``cam_from_world``, ``wxyz``.
- kapture: ``sensors/trajectories.txt``, ``timestamp, device, qw, ..., tz``, ``cam_from_world``;
  ``records_camera.txt`` beside it names the images.
- hloc (``localize_sfm``) and visuallocalization.net: ``name qw qx qy qz tx ty tz``,
  ``cam_from_world``.
- Pseudo ground truth (``tsattler/visloc_pseudo_gt_limitations``): the same and the focal length;
  estimates of that repository are hloc's.
- ACE (``test_ace.py``): hloc's and three numbers more, both errors and the number of inliers.
- ACE0 (``poses_final.txt``): hloc's and two numbers more, focal length and confidence. DSAC* has as
  many, both errors.
- CSV: our tables of poses (``frame,path,tx,...``) and what ``synfeal localize`` writes
  (``image,tx,...``), ``world_from_cam``, ``wxyz``.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from synfeal.dataset.pose_list import KITTI, Convention, FrameKey, PoseList
from synfeal.dataset.pose_models import (
    COLMAP,
    MODELS,
    TRAJECTORIES,
    is_kapture,
    read_colmap,
    read_kapture,
)
from synfeal.dataset.pose_table import (
    COLUMNS,
    IMAGE,
    SEEN,
    STATED,
    SUPPORT,
    check_places,
    check_unit,
)
from synfeal.dataset.sequence_listing import POSE, list_sequences, refuse_problems
from synfeal.dataset.sevenscenes import read_pose
from synfeal.errors import InputError, read_as
from synfeal.geometry.poses import pose_from_quat, quat_wxyz_of
from synfeal.geometry.rigid import RIGID_BOUND, rigid_defects
from synfeal.records.files import read_text
from synfeal.records.tables import is_number, parse_cells

Array = NDArray[np.float64]
Rows = list[tuple[int, list[str]]]  # numbers of lines, from 1, and their columns

OURS = Convention("world_from_cam", "wxyz")
TUM = Convention("world_from_cam", "xyzw")
TUM_ROW = "timestamp tx ty tz qx qy qz qw"
# 1973 in nanoseconds: what seconds, milliseconds and microseconds of today do not reach.
LEAST_STAMP_NS = 10**17
SAME_PLACE_M = 1e-3  # two poses of one time that are nearer are one pose written twice

FormatName = Literal[
    "7scenes",
    "tum",
    "kitti",
    "euroc",
    "colmap",
    "kapture",
    "hloc",
    "pgt",
    "ace",
    "ace0",
    "csv",
]
FORMATS: tuple[FormatName, ...] = get_args(FormatName)


@dataclass(frozen=True)
class LineFormat:
    """A format of one pose on each line, numbers separated by spaces.

    Attributes:
        kind: What it is called, with its article.
        convention: What its poses map, and the order of their quaternions.
        frame_key: How a line says which frame it is of.
        n_numbers: Numbers on a line; a name before them is none.
        holds: What stands on a line, for messages.
    """

    kind: str
    convention: Convention
    frame_key: FrameKey
    n_numbers: int
    holds: str


LINE_FORMATS: dict[FormatName, LineFormat] = {
    "tum": LineFormat("a TUM trajectory", TUM, "time", 8, "timestamp and seven numbers (TUM)"),
    "kitti": LineFormat(KITTI, OURS, "index", 12, "twelve numbers (KITTI)"),
    "hloc": LineFormat("an hloc result file", COLMAP, "name", 7, "name and seven (hloc)"),
    "pgt": LineFormat("pseudo ground truth", COLMAP, "name", 8, "name and eight (pgt)"),
    "ace0": LineFormat(
        "an ACE0 or DSAC* result file", COLMAP, "name", 9, "name and nine (ACE0, DSAC*)"
    ),
    "ace": LineFormat("an ACE result file", COLMAP, "name", 10, "name and ten (ACE)"),
}


def read_pose_list(path: Path, file_format: FormatName | None = None) -> PoseList:
    """Read poses from any of the formats above.

    Args:
        path: File or directory.
        file_format: Its format; None to tell it by what it holds.

    Raises:
        InputError: the path is missing, in none of these formats, in two of them, or damaged; or
            it is not in ``file_format``.
    """
    if path.is_dir() or path.name in MODELS:
        found = _from_directory(path) if path.is_dir() else read_colmap(path.parent)
        if file_format not in (None, _name_of(found)):
            raise InputError(path, f"is {found.kind}, not {file_format}", "correct `format`")
        return found
    if not os.path.lexists(path):
        raise InputError(path, "missing", "give a file of poses, or a directory")
    with read_as(path, "poses"):
        text = read_text(path, "utf-8-sig")
    if file_format == "kapture" or (file_format is None and is_kapture(text)):
        return read_kapture(path)
    rows = _rows(text.replace(",", " ") if file_format == "tum" else text)
    if not rows:
        raise InputError(path, "holds no poses")
    if file_format in ("7scenes", "colmap"):
        raise InputError(path, f"is a file; a {file_format} set of poses is a directory")
    first = rows[0][1][0]
    if file_format in ("csv", "euroc") or (file_format is None and "," in first):
        whole = is_number(first.partition(",")[0]) and file_format != "csv"
        if whole or file_format == "euroc":
            return read_euroc(path, text, told=file_format == "euroc")
        return read_csv(path, text)
    return read_lines(path, rows, file_format)


def _rows(text: str) -> Rows:
    """Split lines into columns, numbered from 1, without blank ones and comments."""
    rows = [(i, _cells(line)) for i, line in enumerate(text.splitlines(), start=1)]
    return [(i, row) for i, row in rows if row and not row[0].startswith("#")]


def _cells(line: str) -> list[str]:
    """Split a line into columns, without a comment behind a whole pose."""
    cells = line.split()
    marks = (place for place, cell in enumerate(cells) if cell.startswith("#") and place >= 8)
    return cells[: next(marks, None)]


@dataclass(frozen=True)
class Trajectory:
    """Poses at times, in the order of their lines.

    Attributes:
        stamps_s: Times (N,), seconds.
        position_m: Positions (N, 3) of the camera in the world, metres.
        quat_wxyz: Quaternions (N, 4) of ``world_from_cam``, of unit length up to rounding.
    """

    stamps_s: Array
    position_m: Array
    quat_wxyz: Array

    def __len__(self) -> int:
        return len(self.stamps_s)

    @property
    def world_from_cam(self) -> Array:
        """Poses (N, 4, 4)."""
        return pose_from_quat(self.position_m, self.quat_wxyz)

    def by_time(self, path: Path) -> Trajectory:
        """Order poses by time; of a pose that is written twice the first is kept.

        Args:
            path: Their file, for messages.

        Raises:
            InputError: Two poses of one time differ, so nothing says which is meant.
        """
        order = np.argsort(self.stamps_s, kind="stable")
        is_new = np.concatenate([[True], np.diff(self.stamps_s[order]) > 0.0])
        kept = order[is_new]
        moved_m = np.abs(np.diff(self.position_m[order], axis=0)).max(axis=1, initial=0.0)
        differing = np.flatnonzero(~is_new[1:] & (moved_m > SAME_PLACE_M))
        if len(differing):
            raise InputError(
                path,
                f"the time {self.stamps_s[order[differing[0]]]:.6f} has two different poses"
                f" ({len(order)} poses at {len(kept)} times); are two runs in one file, or times"
                " rounded?",
            )
        return Trajectory(self.stamps_s[kept], self.position_m[kept], self.quat_wxyz[kept])


def read_trajectory(path: Path) -> Trajectory:
    """Read a TUM trajectory of which every pose is needed: whole, finite, and of unit quaternions.

    Args:
        path: Lines ``timestamp tx ty tz qx qy qz qw``; ``#`` starts a comment, also after a pose.

    Raises:
        InputError: The file is missing, or a line holds no such pose.
    """
    with read_as(path, "a trajectory"):
        text = read_text(path, "utf-8-sig")
    rows = _rows("\n".join(line.partition("#")[0] for line in text.splitlines()))
    if not rows:
        raise InputError(path, f"holds no poses; a trajectory has lines {TUM_ROW}")
    for line, row in rows:
        if any("," in cell for cell in row):
            raise InputError(path, f"line {line} has commas; {TUM_ROW} are separated by blanks")
        if len(row) != 8 or not all(map(is_number, row)) or not np.isfinite(_floats(row)).all():
            raise InputError(path, f"line {line} must hold eight finite numbers: {TUM_ROW}")
    found = read_lines(path, rows, "tum")
    lines = np.array([line for line, _ in rows])
    check_places(found.translation, path, lines)
    check_unit(found.quat, path, lines)
    stamps_s = np.array(found.names, np.float64)
    return Trajectory(stamps_s, found.translation, found.quat[:, [3, 0, 1, 2]])


def _floats(row: Sequence[str]) -> Array:
    return np.array(row, np.float64)


def _name_of(found: PoseList) -> FormatName:
    """Name the format of poses that were read from a directory."""
    names: dict[str, FormatName] = {
        "a 7-Scenes tree": "7scenes",
        "a COLMAP model": "colmap",
        "kapture trajectories": "kapture",
        "TUM trajectories": "tum",
    }
    return names[found.kind]


def _from_directory(path: Path) -> PoseList:
    places = (path, path / "sparse" / "0", path / "0")
    models = [p for p in places if any((p / name).is_file() for name in MODELS)]
    sequences = any(p.is_dir() or p.suffix == ".zip" for p in path.glob("seq-*"))
    lists = sorted(path.glob("seq-*.txt"))
    kapture = [p for p in (path, path / "sensors") if (p / TRAJECTORIES).is_file()]
    found = [*models, *kapture, *([path / "seq-*"] if sequences else []), *lists[:1]]
    if len(found) > 1:
        raise InputError(path, f"holds poses twice, {found[0]} and {found[1]}", "name one of them")
    if models:
        return read_colmap(models[0])
    if kapture:
        return read_kapture(kapture[0] / TRAJECTORIES)
    if sequences:
        return read_sevenscenes(path)
    if lists:
        return read_tum_sequences(lists)
    raise InputError(
        path,
        "holds no seq-01/frame-000000.pose.txt, no seq-01.txt (TUM) and no images.txt or"
        " images.bin (COLMAP)",
        "name the file that has the poses",
    )


def read_sevenscenes(path: Path) -> PoseList:
    """Read a tree of ``pose.txt`` files.

    Raises:
        InputError: It holds no such file.
    """
    sequences = list_sequences(path)
    refuse_problems(sequences)
    frames = [
        (s.name, frame) for s in sequences for frame in s.frames if frame.number in s.numbers[POSE]
    ]
    if not frames:
        raise InputError(path, "its sequences hold no frame-XXXXXX.pose.txt")
    matrices = np.array([read_pose(frame.path(POSE)) for _, frame in frames])
    return PoseList(
        "a 7-Scenes tree",
        OURS,
        tuple(f"{name}/frame-{frame.number:06d}" for name, frame in frames),
        tuple(str(frame.path(POSE)) for _, frame in frames),
        matrices[:, :3, 3],
        _quat_of_rotations(matrices),
        of_matrices=True,
    )


def read_csv(path: Path, text: str) -> PoseList:
    """Read a table of poses with a header.

    Raises:
        InputError: The header is none that is known, or no pose is below it.
    """
    table = parse_cells(path, text, remedy="correct the file")
    found = (IMAGE, *COLUMNS[2:])
    bare = table.header
    states_errors = bare[-len(STATED) :] == STATED
    if states_errors:
        bare = bare[: -len(STATED)]
    known = (COLUMNS, (*COLUMNS, IMAGE), found, (*found, *SUPPORT), (*found, *SEEN))
    if bare not in known:
        raise InputError(
            path,
            f"the header must be {','.join(COLUMNS)} or image,{','.join(COLUMNS[2:])}, found"
            f" '{','.join(table.header)[:80]}'",
        )
    table.check_rows()
    if not table.rows:
        raise InputError(path, "holds no poses below its header")
    may_be_empty = bare[-1] == SUPPORT[-1]  # no pose, no numbers
    values = table.numbers(COLUMNS[2:], may_be_empty)
    named = IMAGE in table.header
    names = table.header.index(IMAGE if named else "frame")
    return PoseList(
        "a pose table" if table.header[0] == COLUMNS[0] else "poses of synfeal localize",
        OURS,
        tuple(row[names] for row in table.rows),
        tuple(f"line {line}" for line in table.lines),
        values[:, :3],
        values[:, 3:],
        frame_key="name" if named else "index",
        stated=table.numbers(STATED, may_be_empty=True) if states_errors else None,
        names_all_asked=may_be_empty,
    )


def read_euroc(path: Path, text: str, told: bool = True) -> PoseList:
    """Read EuRoC's ground truth, or a table of its first eight columns.

    Args:
        path: The file, for messages.
        text: Its content.
        told: Whether a person said that it is EuRoC's.

    Raises:
        InputError: it is damaged, or nobody said so and it may as well be TUM's.
    """
    lines = [(i, line) for i, line in enumerate(text.splitlines(), start=1) if line.strip()]
    rows = [
        (i, [cell.strip() for cell in line.rstrip(", ").split(",")])
        for i, line in lines
        if not line.startswith("#")
    ]
    places = [f"line {i}" for i, _ in rows]
    for place, (_, row) in zip(places, rows, strict=True):
        if len(row) < 8:
            raise InputError(
                path,
                f"{place} has {len(row)} columns; EuRoC's are a time in nanoseconds, three of the"
                " position, four of the quaternion, and more",
            )
        if not row[0].isdecimal():
            raise InputError(
                f"{path}: {place}",
                f"the time '{row[0][:40]}' must be whole nanoseconds (EuRoC)",
                'a TUM trajectory has seconds, and with commas needs `format="tum"`',
            )
    values = _numbers(path, places, [row[1:8] for _, row in rows])
    stamps_ns = [int(row[0]) for _, row in rows]
    if not told and max(stamps_ns) < LEAST_STAMP_NS and all(len(row) == 8 for _, row in rows):
        raise InputError(
            f"{path}: {places[0]}",
            f"eight numbers, a time of {rows[0][1][0][:40]} and commas may be EuRoC's (nanoseconds,"
            " quaternion wxyz) or TUM's (seconds, xyzw)",
            'say which with `format="euroc"` or tum',
        )
    return PoseList(
        "a EuRoC trajectory",
        OURS,
        tuple(f"{ns // 10**9}.{ns % 10**9:09d}" for ns in stamps_ns),
        tuple(places),
        values[:, :3],
        values[:, 3:],
        frame_key="time",
    )


def read_lines(path: Path, rows: Rows, file_format: FormatName | None = None) -> PoseList:
    """Read poses from lines of text.

    Args:
        path: File the lines are from, for messages.
        rows: Number of each line, and its columns; at least one line.
        file_format: Format of the lines; None to tell it from the first line, by how many numbers
            it has and whether a name leads them.

    Raises:
        InputError: Lines differ in their number of columns, or a cell is no number.
    """
    line_format = _line_format(path, rows[0], file_format)
    columns = line_format.n_numbers + (line_format.frame_key == "name")
    for line, row in rows:
        if len(row) != columns:
            raise InputError(path, f"line {line} has {len(row)} columns, those above {columns}")
    places = [f"line {i}" for i, _ in rows]
    if line_format.frame_key == "index":
        return _of_matrices(path, line_format, places, [row for _, row in rows])
    values = _numbers(path, places, [row[1:8] for _, row in rows])
    names = tuple(row[0] for _, row in rows)
    if line_format.frame_key == "time":
        _numbers(path, places, [[name] for name in names])
    else:
        _numbers(path, places, [row[8:] for _, row in rows])
    if line_format.convention.order == "xyzw":
        position, quat = values[:, :3], values[:, 3:]
    else:
        quat, position = values[:, :4], values[:, 4:]
    return PoseList(
        line_format.kind,
        line_format.convention,
        names,
        tuple(places),
        position,
        quat,
        frame_key=line_format.frame_key,
    )


def _line_format(
    path: Path, first: tuple[int, list[str]], file_format: FormatName | None
) -> LineFormat:
    """Find the format of the first line (its number, its columns)."""
    line, row = first
    if ";" in row[0]:
        raise InputError(
            path,
            f"line {line} has semicolons between its columns",
            "save it with commas there, and points in numbers",
        )
    if file_format is not None:
        told = LINE_FORMATS[file_format]
        columns = told.n_numbers + (told.frame_key == "name")
        if len(row) != columns:
            raise InputError(
                path,
                f"line {line} has {len(row)} columns, {file_format} has {columns}",
                "correct `format`, or leave it out",
            )
        return told
    named = not is_number(row[0])
    for known in LINE_FORMATS.values():
        if (known.frame_key == "name", known.n_numbers) == (named, len(row) - named):
            return known
    count = f"a name and {len(row) - 1} numbers" if named else f"{len(row)} numbers and no name"
    held = ", ".join(known.holds for known in LINE_FORMATS.values())
    raise InputError(
        path, f"line {line} has {count}; known are {held}, or a CSV header {','.join(COLUMNS)}"
    )


def _of_matrices(
    path: Path, line_format: LineFormat, places: Sequence[str], rows: Sequence[Sequence[str]]
) -> PoseList:
    """Read poses from lines of three rows of four numbers each."""
    matrices = np.tile(np.eye(4), (len(rows), 1, 1))
    matrices[:, :3] = _numbers(path, places, rows).reshape(-1, 3, 4)
    return PoseList(
        line_format.kind,
        line_format.convention,
        tuple(map(str, range(len(rows)))),
        tuple(places),
        matrices[:, :3, 3],
        _quat_of_rotations(matrices),
        frame_key=line_format.frame_key,
        of_matrices=True,
    )


def _quat_of_rotations(matrices: Array) -> Array:
    """Convert matrices (N, 4, 4) to quaternions (N, 4) ``wxyz``; NaN where one is not rigid."""
    quat = np.full((len(matrices), 4), np.nan)
    rigid = rigid_defects(matrices).worst <= RIGID_BOUND
    quat[rigid] = quat_wxyz_of(matrices[rigid])
    return quat


def read_tum_sequences(paths: Sequence[Path]) -> PoseList:
    """Read ``seq-01.txt``, ``seq-02.txt``, ..., each a TUM trajectory.

    Raises:
        InputError: A file is no TUM trajectory.
    """
    parts = [read_pose_list(path) for path in paths]
    odd = [p for p, part in zip(paths, parts, strict=True) if part.convention != TUM]
    if odd:
        raise InputError(odd[0], "must be a TUM trajectory, as its name and directory say")
    return PoseList(
        "TUM trajectories",
        TUM,
        tuple(f"{p.stem}/{n}" for p, e in zip(paths, parts, strict=True) for n in e.names),
        tuple(f"{p.name}, {w}" for p, e in zip(paths, parts, strict=True) for w in e.places),
        np.concatenate([part.translation for part in parts]),
        np.concatenate([part.quat for part in parts]),
        frame_key="time",
    )


def _numbers(path: Path, places: Sequence[str], cells: Sequence[Sequence[str]]) -> Array:
    for place, row in zip(places, cells, strict=True):
        bad = [cell for cell in row if not is_number(cell)]
        if bad:
            raise InputError(path, f"{place}: '{bad[0][:40]}' is not a number")
    return np.array(cells, np.float64)
