"""Depth and poses that contradict each other are noticed, and what was meant is named."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from synfeal.cli import main
from synfeal.dataset.depth_agreement import PosedDepth, compare_depth
from tests.support import box_depth
from tests.support.box_depth import CAMERA, depth_m, world_from_cams, write_sequence

Array = NDArray[np.float64]


def opengl(poses: Array) -> Array:
    """The same cameras, y up and looking along -z."""
    return poses @ np.diag([1.0, -1.0, -1.0, 1.0])


def inverse(poses: Array) -> Array:
    return np.linalg.inv(poses)


def reordered(poses: Array) -> Array:
    """Rotations of quaternions ``xyzw`` whose numbers were taken as ``wxyz``."""
    moved = poses.copy()
    xyzw = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    w, x, y, z = xyzw.T  # the mistake
    moved[:, :3, :3] = Rotation.from_quat(np.stack([x, y, z, w], axis=1)).as_matrix()
    return moved


def transposed(poses: Array) -> Array:
    moved = poses.copy()
    moved[:, :3, :3] = poses[:, :3, :3].transpose(0, 2, 1)
    return moved


def millimetres(poses: Array) -> Array:
    moved = poses.copy()
    moved[:, :3, 3] *= 1000
    return moved


def of_body(poses: Array) -> Array:
    """The same cameras with x forward, y left, z up."""
    body = np.eye(4)
    body[:3, :3] = [[0, -1, 0], [0, 0, -1], [1, 0, 0]]  # columns: its axes in the camera's
    return poses @ body


def left_handed(poses: Array) -> Array:
    flip = np.diag([1.0, -1.0, 1.0, 1.0])
    return flip @ poses @ flip


def nothing(poses: Array) -> Array:
    return poses


def opengl_view(poses: Array) -> Array:
    return inverse(opengl(poses))


TRUE = world_from_cams(40)
DEPTH_M = [depth_m(pose) for pose in TRUE]


def posed(poses: Array, scale: float = 1.0, options: frozenset[str] = frozenset()) -> PosedDepth:
    """Depth as a command reads it that takes a metre for 1000, ``scale`` times too far."""
    return PosedDepth(
        files=[f"{index}.png" for index in range(len(poses))],
        read_m=lambda index: DEPTH_M[index] * np.float32(scale),
        world_from_cam=poses,
        camera=CAMERA,
        depth_from_cam=np.eye(4),
        options=options,
    )


def test_right_poses_agree() -> None:
    found = compare_depth(posed(TRUE))
    assert found.problem is None
    assert found.share > 0.97


@pytest.mark.parametrize(
    ("change", "scale", "words"),
    [
        (opengl, 1.0, ["as in OpenGL", "diag(1, -1, -1, 1)"]),
        (inverse, 1.0, ["the poses are cam_from_world"]),
        (reordered, 1.0, ["quaternions' numbers"]),
        (transposed, 1.0, ["the rotations are transposed"]),
        (millimetres, 1.0, ["positions are in millimetres"]),
        (of_body, 1.0, ["the poses are of a body"]),
        (left_handed, 1.0, ["left-handed"]),
        (nothing, 5.0, ["a metre of depth is stored as 5000"]),
        (nothing, 0.001, ["a metre of depth is stored as 1:"]),
        (opengl, 5.0, ["as in OpenGL", "a metre of depth is stored as 5000"]),
        (opengl_view, 1.0, ["the poses are cam_from_world", "as in OpenGL"]),
    ],
)
def test_what_was_meant_is_named(
    change: Callable[[Array], Array], scale: float, words: list[str]
) -> None:
    problem = compare_depth(posed(change(TRUE), scale)).problem
    assert problem is not None
    for word in words:
        assert word in problem
    assert problem.count(": ") == 2 + len(set(words) - {"diag(1, -1, -1, 1)"}) - 1


def test_poses_of_other_frames_are_refused_without_a_remedy() -> None:
    problem = compare_depth(posed(TRUE[::-1])).problem
    assert problem is not None
    assert "the poses are of these frames" in problem


def test_frames_that_share_nothing_are_not_judged() -> None:
    apart = TRUE.copy()
    apart[:, 0, 3] += 1000.0 * np.arange(len(apart))
    found = compare_depth(posed(apart))
    assert np.isnan(found.share)
    assert found.problem is None


@pytest.fixture
def wrong(tmp_path: Path) -> Path:
    """A data set whose poses are those of Blender's cameras."""
    folder = tmp_path / "set"
    write_sequence(folder / "seq-01", TRUE, opengl(TRUE))
    (folder / "manifest.json").write_text(
        '{"format": 1, "camera": {"width": 80, "height": 60, "fx": 70, "fy": 70, "cx": 40,'
        ' "cy": 30}}'
    )
    return folder


def test_every_command_refuses(
    wrong: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = str(tmp_path / "out")
    sequence = str(wrong / "seq-01")
    for arguments, remedy in (
        (["map", sequence, "--color-focal", "70", "--out", out], "give --convention opengl"),
        (["scan", sequence, "--color-focal", "70", "--out", f"{out}.glb"], "--convention opengl"),
        (["pairs", str(wrong), "--out", out], "multiply each pose by diag(1, -1, -1, 1)"),
        (["train", sequence, "--focal", "70", "--out", out], "multiply each pose by diag"),
    ):
        assert main(arguments) == 1
        error = capsys.readouterr().err
        assert remedy in error
        assert "as in OpenGL" in error
        assert not (tmp_path / "out").exists()


def test_validate_names_the_axes(wrong: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate", str(wrong)]) == 1
    captured = capsys.readouterr()
    assert "convention" in captured.out
    assert "as in OpenGL" in captured.err


def test_map_takes_the_poses_as_told(wrong: Path, tmp_path: Path) -> None:
    out = tmp_path / "map"
    given = ["--color-focal", "70", "--convention", "opengl", "--out", str(out)]
    assert main(["map", str(wrong / "seq-01"), *given]) == 0
    row = (out / "frames.csv").read_text().splitlines()[1].split(",")
    np.testing.assert_allclose(np.array(row[2:5], float), TRUE[0, :3, 3], atol=1e-6)
    x, y, z, w = Rotation.from_matrix(TRUE[0, :3, :3]).as_quat()
    wxyz = np.array(row[5:9], float)
    assert abs(abs(wxyz @ [w, x, y, z]) - 1) < 1e-9


def test_depth_of_the_box_is_right() -> None:
    """The support itself: a camera in the middle that looks along x sees the wall 2.5 m away."""
    pose = np.eye(4)
    pose[:3, :3] = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]]
    pose[:3, 3] = box_depth.SIZE_M / 2
    np.testing.assert_allclose(depth_m(pose)[25:35, 35:45], 2.5, rtol=1e-6)
