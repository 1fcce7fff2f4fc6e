"""The tables of MS-Transformer and of the pose regressors that read the same format.

Source: ``datasets/CameraPoseDataset.py`` of yolish/multi-scene-pose-transformer and the tables
beside it: columns ``scene,split,seq,img_path,t1,t2,t3,q1,q2,q3,q4``, poses ``world_from_cam`` with
quaternions ``wxyz``, image paths below the data set's directory. There is no camera in it.
"""

from __future__ import annotations

from pathlib import Path

import pandas as pd

from synfeal.export.frames import ExportSet, Place, frame_name, need_splits
from synfeal.geometry.poses import quat_wxyz_of

COLUMNS = ("scene", "split", "seq", "img_path", "t1", "t2", "t3", "q1", "q2", "q3", "q4")


def export_mstransformer(data: ExportSet, out: Path, place: Place) -> None:
    """Write ``images/``, ``train.csv`` and ``test.csv``.

    Raises:
        InputError: there are no splits.
    """
    need_splits(data)
    for split in ("train", "test"):
        rows = []
        for frame in data.of_split(split):
            path = f"images/{frame_name(frame)}"
            place(frame.color, out / path)
            pose = (*frame.world_from_cam[:3, 3], *quat_wxyz_of(frame.world_from_cam))
            rows.append((data.path.resolve().name, split, frame.sequence, path, *pose))
            table = pd.DataFrame(rows, columns=list(COLUMNS))
        table.to_csv(out / f"{split}.csv", index=False, lineterminator="\n")
