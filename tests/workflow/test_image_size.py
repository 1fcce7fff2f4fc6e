"""Feature matching at a size of image, in painted rooms whose depth and poses are exact."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from benchmarks.image_size import NETWORKS, PICTURE, TABLE, Frames, draw, locate
from synfeal.dataset.pose_table import PoseTable
from synfeal.geometry.poses import quat_wxyz_of
from tests.support.painted_rooms import FRAME, ROOM, SIZE_M, looking_about, textures
from tests.support.room_scene import cast, painted

N_MAP, N_ASKED = 24, 6


def table_of(poses):
    count = np.arange(len(poses))
    return PoseTable(count, count // 2, poses[:, :3, 3], quat_wxyz_of(poses))


@pytest.fixture(scope="module")
def frames():
    paint = textures(seed=0)
    found = []
    for count, seed in ((N_MAP, 1), (N_ASKED, 2)):
        poses = looking_about(count, seed)
        rgb = [np.asarray(painted(paint, pose, SIZE_M, FRAME)) for pose in poses]
        depth_m = [cast(pose, ROOM, FRAME)[0].astype(np.float32) for pose in poses]
        found.append(Frames(table_of(poses), np.stack(rgb), np.stack(depth_m)))
    return found


def test_frames_are_located_where_they_are(frames):
    known, asked = frames
    row = locate(known, asked, FRAME)
    assert (row.width_px, row.test_paths) == (176, 3)
    assert (row.map_frames, row.test_frames) == (N_MAP, N_ASKED)
    assert row.found == N_ASKED
    assert row.position_m < 0.02
    assert row.orientation_deg < 0.5
    # Truths that are all moved by a metre make errors of a metre.
    moved = dataclasses.replace(asked.poses, position_m=asked.poses.position_m + np.eye(3)[0])
    row = locate(known, asked._replace(poses=moved), FRAME)
    assert row.position_m == pytest.approx(1, abs=0.05)


def test_what_is_not_found_is_the_worst(frames):
    known, asked = frames
    row = locate(known, asked._replace(rgb=np.full_like(asked.rgb, 128)), FRAME)
    assert row.found == 0
    assert row.position_m == np.inf


def test_the_picture_is_drawn_from_both_tables(tmp_path, frames):
    pd.DataFrame([locate(*frames, FRAME)]).to_csv(tmp_path / TABLE, index=False)
    network = {"localizer": "posenet2", "input_px": 64, "width": 0.25, "images": 30000}
    large = network | {"localizer": "posenet", "input_px": 224, "width": 1, "position_m": 0.2}
    rows = [network | {"position_m": 0.4}, large]
    pd.DataFrame(rows).to_csv(tmp_path / NETWORKS, index=False)
    draw(tmp_path)
    with Image.open(tmp_path / PICTURE) as picture:
        assert min(picture.size) > 400
