"""Which file formats poses are read from, and how each is told.

- 7-Scenes: ``seq-XX/frame-XXXXXX.pose.txt``, four rows of ``world_from_cam``.
- TUM RGB-D ("File Formats"): ``timestamp tx ty tz qx qy qz qw``, ``world_from_cam``.
- COLMAP ("Output Format"): ``images.txt`` or ``images.bin``, ``cam_from_world``, ``wxyz``.
- hloc (``localize_sfm``) and visuallocalization.net: ``name qw qx qy qz tx ty tz``,
  ``cam_from_world``.
- ACE (``test_ace.py``): the same and three numbers more, both errors and the number of inliers.
- CSV: our tables of poses (``frame,path,tx,...``) and what ``synfeal localize`` writes
  (``image,tx,...``), ``world_from_cam``, ``wxyz``.
"""

from __future__ import annotations

import io
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from synfeal.dataset.pose_table import COLUMNS, IMAGE, SEEN, SUPPORT
from synfeal.dataset.sequence_listing import refuse_problems
from synfeal.dataset.sevenscenes import read_pose
from synfeal.errors import InputError, read_as
from synfeal.evaluation.estimates import Convention, Estimates
from synfeal.geometry.poses import quat_wxyz_of
from synfeal.validation.listing import POSE, list_sequences
from synfeal.validation.poses import rigid_defects

Array = NDArray[np.float64]

OURS, COLMAP = Convention("world_from_cam", "wxyz"), Convention("cam_from_world", "wxyz")
TUM = Convention("world_from_cam", "xyzw")
MODELS = ("images.txt", "images.bin")
# Numbers on a line of text, by whether a name stands before them.
NAMED, TIMED = {7: "an hloc result file", 10: "an ACE result file"}, 8
RIGID_BOUND = 1e-3  # text of few digits


def read_estimates(path: Path) -> Estimates:
    """Poses from any of the formats above.

    Raises:
        InputError: the path is missing, in none of these formats, in two of them, or damaged.
    """
    if path.is_dir():
        return _from_directory(path)
    if path.name in MODELS:
        return read_colmap(path.parent)
    if not os.path.lexists(path):
        raise InputError(f"{path}: missing; give a file of poses, or a directory")
    with read_as(path, "poses"):
        text = path.read_text(encoding="utf-8-sig")
    rows = [(i, line.split()) for i, line in enumerate(text.splitlines(), start=1)]
    rows = [(i, row) for i, row in rows if row and not row[0].startswith("#")]
    if not rows:
        raise InputError(f"{path}: holds no poses")
    if "," in rows[0][1][0]:
        return read_csv(path, text)
    return read_lines(path, rows)


def _from_directory(path: Path) -> Estimates:
    places = (path, path / "sparse" / "0", path / "0")
    models = [p for p in places if any((p / name).is_file() for name in MODELS)]
    sequences = any(p.is_dir() or p.suffix == ".zip" for p in path.glob("seq-*"))
    lists = sorted(path.glob("seq-*.txt"))
    found = [*models, *([path / "seq-*"] if sequences else []), *lists[:1]]
    if len(found) > 1:
        raise InputError(f"{path}: holds poses twice, {found[0]} and {found[1]}; name one of them")
    if models:
        return read_colmap(models[0])
    if sequences:
        return read_sevenscenes(path)
    if lists:
        return read_tum_sequences(lists)
    raise InputError(
        f"{path}: holds no seq-01/frame-000000.pose.txt, no seq-01.txt (TUM) and no images.txt or"
        " images.bin (COLMAP); name the file that has the poses"
    )


def read_sevenscenes(path: Path) -> Estimates:
    """A tree of ``pose.txt``."""
    sequences = list_sequences(path)
    refuse_problems(sequences)
    frames = [
        (s.name, frame) for s in sequences for frame in s.frames if frame.number in s.numbers[POSE]
    ]
    if not frames:
        raise InputError(f"{path}: its sequences hold no frame-XXXXXX.pose.txt")
    matrices = np.array([read_pose(frame.path(POSE)) for _, frame in frames])
    quat = np.full((len(matrices), 4), np.nan)
    rigid = rigid_defects(matrices).max(axis=1) <= RIGID_BOUND
    quat[rigid] = quat_wxyz_of(matrices[rigid])
    return Estimates(
        "a 7-Scenes tree",
        OURS,
        tuple(f"{name}/frame-{frame.number:06d}" for name, frame in frames),
        tuple(str(frame.path(POSE)) for _, frame in frames),
        matrices[:, :3, 3],
        quat,
    )


def read_colmap(path: Path) -> Estimates:
    """A COLMAP model, text or binary, but not both."""
    import pycolmap

    both = [name for name in MODELS if (path / name).is_file()]
    if len(both) > 1:
        raise InputError(f"{path}: holds images.txt and images.bin; leave one of them")
    damage = (RuntimeError, ValueError, IndexError, KeyError, MemoryError)
    with read_as(path, "a COLMAP model", *damage):
        model = pycolmap.Reconstruction(path)
        images = sorted(model.images.values(), key=lambda image: image.name)
        poses = [image.cam_from_world() for image in images if image.has_pose]
    if not poses:
        raise InputError(f"{path}: this COLMAP model has no image with a pose")
    names = tuple(image.name for image in images if image.has_pose)
    return Estimates(
        "a COLMAP model",
        COLMAP,
        names,
        tuple(f"image {name}" for name in names),
        np.array([pose.translation for pose in poses]),
        np.roll(np.array([pose.rotation.quat for pose in poses]), 1, axis=1),
    )


def read_csv(path: Path, text: str) -> Estimates:
    """A table of poses with a header."""
    with read_as(path, "CSV"):
        table = pd.read_csv(io.StringIO(text), dtype=str, keep_default_na=False)
    header = tuple(table.columns)
    found = (IMAGE, *COLUMNS[2:])
    known = (COLUMNS, (*COLUMNS, IMAGE), found, (*found, *SUPPORT), (*found, *SEEN))
    if header not in known:
        raise InputError(
            f"{path}: the header must be {','.join(COLUMNS)} or image,{','.join(COLUMNS[2:])},"
            f" found '{','.join(header)[:80]}'"
        )
    places = [f"line {i}" for i in range(2, len(table) + 2)]
    cells = table[list(COLUMNS[2:])]
    if header[-1] == SUPPORT[-1]:  # no pose, no numbers
        cells = cells.replace("", "nan")
    values = _numbers(path, places, cells.to_numpy().tolist())
    if not len(table):
        raise InputError(f"{path}: holds no poses below its header")
    named = IMAGE in header
    return Estimates(
        "a pose table" if header[0] == COLUMNS[0] else "poses of synfeal localize",
        OURS,
        tuple(table[IMAGE if named else "frame"]),
        tuple(places),
        values[:, :3],
        values[:, 3:],
        ordered=not named,
    )


def read_lines(path: Path, rows: Sequence[tuple[int, list[str]]]) -> Estimates:
    """Lines of text: TUM, hloc or ACE, by how many numbers they have and whether a name."""
    named = not _is_number(rows[0][1][0])
    counts = {len(row) - named for _, row in rows}
    first = len(rows[0][1]) - named
    if first not in (NAMED if named else (TIMED,)):
        raise InputError(f"{path}: line {rows[0][0]} {_advice(first, named)}")
    if len(counts) > 1:
        line, row = next((i, row) for i, row in rows if len(row) - named != first)
        raise InputError(f"{path}: line {line} has {len(row)} columns, those above {first + named}")
    places = [f"line {i}" for i, _ in rows]
    values = _numbers(path, places, [row[1:8] for _, row in rows])
    names = tuple(row[0] for _, row in rows)
    if named:
        return Estimates(NAMED[first], COLMAP, names, tuple(places), values[:, 4:], values[:, :4])
    _numbers(path, places, [[name] for name in names])
    return Estimates("a TUM trajectory", TUM, names, tuple(places), values[:, :3], values[:, 3:])


def _advice(count: int, named: bool) -> str:
    known = (
        "timestamp and seven numbers (TUM), name and seven (hloc), name and ten (ACE), or a CSV"
        f" header {','.join(COLUMNS)}"
    )
    if named:
        return f"has a name and {count} numbers; known are {known}"
    guesses = {12: "KITTI's format, which does not say which frame a pose is of", 4: "one matrix"}
    guess = f" ({guesses[count]})" if count in guesses else ""
    return f"has {count} numbers and no name{guess}; known are {known}"


def read_tum_sequences(paths: Sequence[Path]) -> Estimates:
    """``seq-01.txt``, ``seq-02.txt``, ...: a TUM trajectory each."""
    parts = [read_estimates(path) for path in paths]
    odd = [p for p, part in zip(paths, parts, strict=True) if part.convention != TUM]
    if odd:
        raise InputError(f"{odd[0]}: must be a TUM trajectory, as its name and directory say")
    return Estimates(
        "TUM trajectories",
        TUM,
        tuple(f"{p.stem}/{n}" for p, e in zip(paths, parts, strict=True) for n in e.names),
        tuple(f"{p.name}, {w}" for p, e in zip(paths, parts, strict=True) for w in e.places),
        np.concatenate([part.translation for part in parts]),
        np.concatenate([part.quat for part in parts]),
    )


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _numbers(path: Path, places: Sequence[str], cells: Sequence[Sequence[str]]) -> Array:
    for place, row in zip(places, cells, strict=True):
        bad = [cell for cell in row if not _is_number(cell)]
        if bad:
            raise InputError(f"{path}: {place}: '{bad[0][:40]}' is not a number")
    return np.array(cells, np.float64)
