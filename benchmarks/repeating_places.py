"""Poses found in maps of places that repeat themselves: right, wrong, or called ambiguous.

    python -m benchmarks.repeating_places results/benchmarks/repeating_places.csv \
        --place hotel --map hotelmap --photographs hotelset/seq-02 --camera hotelset/manifest.json

The photographs are renderings of known pose (``synfeal collect --mode random``), in the world of
the map; ``--light`` shows them under another light, lens and sensor. Rows of other places and of
other photographs are kept.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
import pandas as pd
from PIL import Image

from baselines.references.mapped import read_map
from baselines.references.photographs import Finder
from baselines.references.stated_errors import PHOTOGRAPHIC, photographed
from baselines.training.localize import open_picture
from baselines.training.photometric import PhotometricRandomisation
from synfeal.camera.photograph import PhotographCamera
from synfeal.dataset.posed_sequence import read_posed_sequence
from synfeal.geometry.poses import position_error_m
from synfeal.records.tables import write_frame

KEYS = ["place", "photographs", "light"]


def main() -> None:
    """Localize photographs in a map, and write a row for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("--place", required=True, help="name in the table")
    for name in ("map", "photographs", "camera"):
        parser.add_argument(f"--{name}", type=Path, required=True)
    parser.add_argument("--light", action="store_true", help="vary light, lens and sensor")
    given = parser.parse_args()
    rows = measure(given.map, given.photographs, given.camera, given.light)
    keys = (given.place, given.photographs.parent.name, "varied" if given.light else "as rendered")
    for column, value in reversed(list(zip(KEYS, keys, strict=True))):
        rows.insert(0, column, value)
    if given.table.exists():
        known = pd.read_csv(given.table)
        is_other = (known[KEYS] != list(keys)).any(axis=1)
        rows = pd.concat([known[is_other], rows])
    write_frame(given.table, rows)


def measure(folder: Path, photographs: Path, camera: Path, is_lit: bool) -> pd.DataFrame:
    """Localize photographs.

    Args:
        folder: The map.
        photographs: A posed sequence (7-Scenes).
        camera: Calibration.
        is_lit: Show them under another light, lens and sensor, drawn by their number.
    """
    finder = Finder(read_map(folder))
    cameras = PhotographCamera.read(camera, None, exif=False)
    frames = read_posed_sequence(photographs)
    rows = []
    for index, world_from_cam in enumerate(frames.world_from_cam):
        path = Path(str(frames.color[index]))
        image, turn = open_picture(path)
        if is_lit:
            randomise = PhotometricRandomisation(PHOTOGRAPHIC, index)
            image = Image.fromarray(photographed(np.asarray(image), randomise))
        calibration = cameras.of(image, path, turn)
        assert calibration is not None
        began = time.process_time()
        answer = finder.find(finder.look_at(image, calibration))
        rows.append(
            {
                "photograph": index,
                "error_m": position_error_m(
                    answer.world_from_cam[:3, 3], world_from_cam[:3, 3]
                ).round(3),
                "inliers": answer.support.inliers,
                "confidence": round(answer.support.confidence, 4),
                "rival_inliers": 0 if answer.rival is None else answer.rival.inliers,
                "rival_share": 0 if answer.rival is None else round(answer.rival.share, 3),
                "ambiguous": int(answer.is_ambiguous),
                "seconds": round(time.process_time() - began, 2),
            }
        )
    return pd.DataFrame(rows)


if __name__ == "__main__":
    main()
