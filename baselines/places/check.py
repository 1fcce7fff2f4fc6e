"""Check of a place: pictures of known pose, localized in its map."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

import synfeal
from baselines.places.place import Place
from baselines.references.localized import localize_in_map
from baselines.references.map_localizer import FOUND
from baselines.references.stated_errors import (
    add_photographs,
    held_out_coverage,
    photographs_coverage,
    read_trial,
    usual_radius_m,
)
from synfeal.camera.photograph import PhotographCamera
from synfeal.dataset.manifest import MANIFEST
from synfeal.dataset.pose_table import STATED
from synfeal.dataset.posed_sequence import PosedFrames
from synfeal.errors import InputError
from synfeal.evaluation.coverage import Coverage, coverage
from synfeal.evaluation.metrics import ORIENTATION, POSITION
from synfeal.geometry.poses import pose_error, pose_from_quat

Array = NDArray[np.float64]
# Pictures that are localized: half an hour's worth of a place would say little more.
CHECKED = 60
CLOSE_M, CLOSE_DEG = 0.05, 5.0
# What the pictures are: photographs that the scan was not made of, photographs that it was made of,
# renderings that the map was not made of.
SPARED, FUSED, RENDERED = "spared photographs", "fused photographs", "renderings"


@dataclass(frozen=True)
class Known:
    """Pictures whose poses are known.

    Attributes:
        kind: ``SPARED``, ``FUSED`` or ``RENDERED``.
        files: Their files.
        world_from_cam: Their poses (N, 4, 4) in the world that the map answers in.
        camera: File with their calibration.
    """

    kind: str
    files: tuple[Path, ...]
    world_from_cam: Array
    camera: Path


def photographs_of(place: Place, frames: PosedFrames, stride: int) -> Known:
    """Choose photographs of a capture evenly, among those that were not fused if there are any."""
    spared = [index for index in range(len(frames)) if index % stride]
    chosen = _evenly(spared or list(range(len(frames))))
    return Known(
        SPARED if spared else FUSED,
        tuple(Path(str(frames.color[index])) for index in chosen),
        frames.world_from_cam[chosen],
        place.camera,
    )


def renderings_of(place: Place) -> Known:
    """Take the test frames of the data set that a mesh was rendered into."""
    test = synfeal.open_dataset(place.rendered).test
    chosen = _evenly(list(range(len(test))))
    return Known(
        RENDERED,
        tuple(Path(str(test.images[index])) for index in chosen),
        test.world_from_cam[chosen],
        place.rendered / MANIFEST,
    )


def _evenly(rows: list[int]) -> list[int]:
    some = np.unique(np.linspace(0, len(rows) - 1, CHECKED).astype(np.int64))
    return [rows[index] for index in some]


def localize_known(place: Place, known: Known, seed: int) -> None:
    """Write ``check.csv``: poses of pictures as the map finds them."""
    camera = PhotographCamera.read(known.camera, None, exif=False)
    localize_in_map(place.map, list(known.files), place.check, camera=camera, seed=seed)


def check_of(place: Place, known: Known) -> dict[str, Any]:
    """Compare the poses of ``check.csv`` with those that are known.

    Returns:
        Counts; medians and 90 % of the errors of the pictures that were localized; the share of all
        that are within 5 cm and 5 degrees; how the errors that poses state fit theirs; for each
        picture its known position and its error, None where it was not localized.

    Raises:
        InputError: The file names other pictures.
    """
    checked = _checked(place, known)
    table, truth, found, position_m, angle_deg = checked
    close = (position_m <= CLOSE_M) & (angle_deg <= CLOSE_DEG)
    return {
        "kind": known.kind,
        "pictures": len(table),
        "localized": int(found.sum()),
        "position_m": _percentile(position_m[found], 50),
        "position_90_m": _percentile(position_m[found], 90),
        "orientation_deg": _percentile(angle_deg[found], 50),
        "within_5cm_5deg": float(close.mean()),
        "stated": _stated_of(checked),
        "halves": _levels_of(photographs_coverage(read_trial(place.map))),
        "places": [
            {
                "position_m": pose[:3, 3].round(3).tolist(),
                "error_m": round(float(error), 4) if np.isfinite(error) else None,
            }
            for pose, error in zip(truth, position_m, strict=True)
        ],
    }


def trial_of(place: Place) -> dict[str, Any]:
    """Say how the map did on frames left out of it.

    Returns:
        Counts; how the errors that one half states fit those of the other, nothing of that where
        there are few; the 95 % radius of the position that poses state, the median.
    """
    trial = read_trial(place.map)
    found = held_out_coverage(trial)
    return {
        "pictures": trial.tried,
        "localized": len(trial.position_m),
        "stated": _levels_of(found),
        "usual_95_m": usual_radius_m(trial),
    }


def _levels_of(found: Mapping[str, Sequence[Coverage]]) -> dict[str, list[dict[str, float]]]:
    return {name: [one._asdict() for one in levels] for name, levels in found.items()}


class _Checked(NamedTuple):
    """Lines of ``check.csv`` with known poses (N, 4, 4), which were localized (N,), errors (N,)."""

    table: pd.DataFrame
    truth: Array
    found: NDArray[np.bool_]
    position_m: Array
    orientation_deg: Array

    @property
    def stated(self) -> Array:
        """Radii (N, 4) that the poses state; NaN where they state none."""
        return self.table.reindex(columns=list(STATED)).to_numpy(np.float64)


def _checked(place: Place, known: Known) -> _Checked:
    """Read ``check.csv``, and compare poses with those that are known."""
    table = pd.read_csv(place.check)
    truth = known.world_from_cam[_rows_of(table["image"], known, place)]
    found = (table["status"] == FOUND).to_numpy()
    position_m, angle_deg = np.full(len(table), np.inf), np.full(len(table), np.inf)
    if found.any():
        values = table.loc[found, ["tx", "ty", "tz", "qw", "qx", "qy", "qz"]].to_numpy(np.float64)
        poses = pose_from_quat(values[:, :3], values[:, 3:])
        error_m, error_rad = pose_error(poses, truth[found])
        position_m[found], angle_deg[found] = error_m, np.degrees(error_rad)
    return _Checked(table, truth, found, position_m, angle_deg)


def learn_of_photographs(place: Place, known: Known) -> None:
    """Let errors of photographs widen the radii that poses state, unless they did before.

    Renderings are no second trial: the first one was of such.
    """
    if known.kind == RENDERED or read_trial(place.map).photographs is not None:
        return
    checked = _checked(place, known)
    stated = checked.stated
    both = checked.found & np.isfinite(stated).all(axis=1)
    add_photographs(
        place.map,
        error_m=checked.position_m[both],
        error_deg=checked.orientation_deg[both],
        stated=stated[both],
    )


def _stated_of(checked: _Checked) -> dict[str, Any]:
    """Compare errors with the radii that the lines of ``check.csv`` state, if they do.

    They are those of the trial's frames alone, so of photographs they show what the scan and the
    capture add.
    """
    found = {}
    errors = {POSITION: checked.position_m, ORIENTATION: checked.orientation_deg}
    radii = (checked.stated[:, :2], checked.stated[:, 2:])
    for (name, error), radius in zip(errors.items(), radii, strict=True):
        both = np.isfinite(radius).all(axis=1) & np.isfinite(error)
        if both.any():
            found[name] = [one._asdict() for one in coverage(error[both], *radius[both].T)]
    return found


def _rows_of(images: Iterable[str], known: Known, place: Place) -> list[int]:
    """Find the pictures that the lines of ``check.csv`` name, wherever the place was then."""
    row = {_ending(file): index for index, file in enumerate(known.files)}
    try:
        return [row[_ending(image)] for image in images]
    except KeyError as error:
        raise InputError(
            place.check, f"names {error.args[0]}, which is not tried here", "delete it, build again"
        ) from error


def _ending(path: str | Path) -> str:
    """Return the folder and the name of a picture, which are unique in a place."""
    return "/".join(Path(path).parts[-2:])


def _percentile(values: Array, percent: float) -> float | None:
    return float(np.percentile(values, percent)) if len(values) else None
