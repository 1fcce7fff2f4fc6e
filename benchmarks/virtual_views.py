"""Errors on photographs by how many virtual rotations of the camera a pose is averaged over.

    python -m benchmarks.virtual_views results/benchmarks/virtual_views.csv --photographs seq \
        --camera scan.json --models default=a/model.pt seen=b/model.pt

The photographs are posed (7-Scenes), and are not those that a result is reported on.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd

from baselines.training.localize import localize
from synfeal.camera.photograph import PhotographCamera
from synfeal.dataset.pose_table import COLUMNS
from synfeal.dataset.posed_sequence import read_posed_sequence
from synfeal.geometry.poses import pose_error, pose_from_quat
from synfeal.records.tables import NUMBER, read_frame, write_frame

PAIRS = (0, 4, 8, 16)


def main() -> None:
    """Localize the photographs with every model and number of rotations, a row for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("--photographs", type=Path, required=True)
    parser.add_argument("--camera", type=Path, required=True)
    parser.add_argument("--models", nargs="+", required=True, metavar="NAME=MODEL")
    arguments = parser.parse_args()
    truth = read_posed_sequence(arguments.photographs).world_from_cam
    rows = []
    for named in arguments.models:
        name, _, model = named.partition("=")
        for pairs in PAIRS:
            with TemporaryDirectory() as temporary:
                out = Path(temporary, "poses.csv")
                done = localize(
                    Path(model),
                    [arguments.photographs],
                    out,
                    "cpu",
                    camera=PhotographCamera.read(arguments.camera, None, exif=False),
                    turns=pairs,
                )
                poses = read_frame(out, dict.fromkeys(COLUMNS[2:], NUMBER)).to_numpy()
            errors = pose_error(pose_from_quat(poses[:, :3], poses[:, 3:]), truth)
            rows.append(
                {
                    "model": name,
                    "views": done.views,
                    "position_m": np.median(errors[0]),
                    "orientation_deg": np.degrees(np.median(errors[1])),
                    "network_ms": done.network_ms,
                }
            )
    write_frame(arguments.table, pd.DataFrame(rows))


if __name__ == "__main__":
    main()
