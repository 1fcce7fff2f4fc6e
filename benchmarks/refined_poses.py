"""Errors of poses in a map, as found and refined on the mesh that the map shows.

    python -m benchmarks.refined_poses results/benchmarks/refined_poses.csv --photographs seq \
        --camera scan.json --map map --mesh scan.glb

The photographs are posed (7-Scenes), and are not those that a result is reported on.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from baselines.references.confidence import LEAST_CONFIDENCE
from baselines.references.mapped import read_map
from baselines.references.photographs import Finder
from baselines.references.redrawn import read_redrawn
from baselines.training.localize import open_picture
from synfeal.camera.photograph import PhotographCamera
from synfeal.dataset.posed_sequence import read_posed_sequence
from synfeal.geometry.poses import pose_error
from synfeal.records.tables import write_frame

Array = NDArray[np.float64]
ROUNDS = 2


@dataclass(frozen=True)
class Place:
    """A map, the mesh it shows, photographs, and their camera: files."""

    map: Path
    mesh: Path
    photographs: Path
    camera: Path


def main() -> None:
    """Localize photographs in a map, refine their poses, and write a row for each round."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    for name in ("photographs", "camera", "map", "mesh"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    parser.add_argument("--every", type=int, default=1, help="take one photograph of so many (1)")
    parser.add_argument("--workers", type=int, default=1, help="processes (1)")
    given = parser.parse_args()
    place = Place(given.map, given.mesh, given.photographs, given.camera)
    count = len(read_posed_sequence(place.photographs))
    parts = [
        range(count)[:: given.every][worker :: given.workers] for worker in range(given.workers)
    ]
    with ProcessPoolExecutor(given.workers) as pool:
        measured = np.concatenate(list(pool.map(partial(measure, place), parts)))
    rows = []
    for rounds in range(ROUNDS + 1):
        position_m, angle_deg, seconds = measured[:, rounds].T
        rows.append(
            {
                "rounds": rounds,
                "position_m": np.median(position_m),
                "orientation_deg": np.median(angle_deg),
                "within_5cm_5deg": np.mean((position_m <= 0.05) & (angle_deg <= 5.0)),
                "localized": np.isfinite(position_m).mean(),
                "photographs": len(measured),
                "seconds": np.median(seconds),
            }
        )
    write_frame(given.table, pd.DataFrame(rows))


def measure(place: Place, chosen: Sequence[int]) -> Array:
    """Localize photographs and refine their poses.

    Args:
        place: Files.
        chosen: Which photographs (n,).

    Returns:
        For each photograph and number of rounds (n, ROUNDS + 1, 3): metres and degrees that its
        pose is off, infinite where it is not localized, and processor seconds of the last round.
    """
    found = read_map(place.map)
    assert found.sequence_from_world is not None
    camera = PhotographCamera.read(place.camera, None, exif=False)
    frames = read_posed_sequence(place.photographs)
    finder = Finder(found)
    measured = np.full((len(chosen), ROUNDS + 1, 3), np.inf)
    with read_redrawn(found, place.mesh, place.map) as redrawn:
        for row, index in enumerate(chosen):
            began = time.process_time()
            path = Path(str(frames.color[index]))
            image, turn = open_picture(path)
            calibration = camera.of(image, path, turn)
            assert calibration is not None
            photograph = finder.look_at(image, calibration)
            answer = finder.find(photograph)
            for rounds in range(ROUNDS + 1):
                if rounds and answer.support.confidence >= LEAST_CONFIDENCE:
                    answer = redrawn.refine(photograph, answer)
                measured[row, rounds, 2] = time.process_time() - began
                began = time.process_time()
                if answer.support.confidence >= LEAST_CONFIDENCE:
                    pose = found.sequence_from_world @ answer.world_from_cam
                    position_m, angle_rad = pose_error(pose[None], frames.world_from_cam[[index]])
                    measured[row, rounds, :2] = position_m[0], np.degrees(angle_rad[0])
    return measured


if __name__ == "__main__":
    main()
