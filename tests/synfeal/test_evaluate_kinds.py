"""Poses as people have them: other axes, other clocks, and models of other programs' writing."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial.transform import Rotation

from synfeal.cli import main
from synfeal.dataset.posed_sequence import read_posed_sequence
from synfeal.errors import InputError
from synfeal.evaluation.run import Settings, evaluate
from synfeal.planning.repeat import repeated_poses
from tests.support.box_depth import SIZE_M, world_from_cams

Array = NDArray[np.float64]
COUNT = 30
OFF_M = 0.03
TRUE = world_from_cams(COUNT)
NAMES = [f"seq-01/frame-{index:06d}.color.png" for index in range(COUNT)]


def estimates() -> Array:
    """The true poses, each moved by 3 cm to the side."""
    moved = TRUE.copy()
    moved[:, :3, 3] += OFF_M * TRUE[:, :3, 0]
    return moved


def wxyz_of(poses: Array) -> Array:
    return np.roll(Rotation.from_matrix(poses[:, :3, :3]).as_quat(), 1, axis=1)


def numbers(values: Sequence[float]) -> str:
    return " ".join(f"{value:.12f}" for value in values)


def write_tum(path: Path, poses: Array, times_s: Sequence[float] | Array) -> Path:
    quat = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    rows = zip(times_s, poses, quat, strict=True)
    lines = [f"{time:.6f} {numbers([*pose[:3, 3], *xyzw])}" for time, pose, xyzw in rows]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture
def reference(tmp_path: Path) -> Path:
    """True poses by name, as ``synfeal localize`` writes them."""
    path = tmp_path / "truth.csv"
    rows = zip(NAMES, TRUE, wxyz_of(TRUE), strict=True)
    lines = [f"{name},{numbers([*pose[:3, 3], *q]).replace(' ', ',')}" for name, pose, q in rows]
    path.write_text("\n".join(["image,tx,ty,tz,qw,qx,qy,qz", *lines]) + "\n")
    return path


def scores_right(reference: Path, poses: Path, **settings: object) -> None:
    """All poses are scored, 3 cm off and not turned."""
    found = evaluate(reference, poses, Settings(**settings))  # type: ignore[arg-type]
    assert (found.row >= 0).sum() == COUNT
    np.testing.assert_allclose(found.errors["position_m"], OFF_M, atol=1e-6)
    assert found.errors["orientation_deg"].max() < 1e-3


def refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    assert main(["evaluate", *map(str, arguments)]) == 1
    error = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error")]
    assert len(error) == 1
    return error[0]


# Lines of COLMAP's images.txt, from cam_from_world and a name.


def image_line(index: int, pose: Array, name: str, number: Callable[[float], str] = repr) -> str:
    cam = np.linalg.inv(pose)
    values = [*wxyz_of(cam[None])[0], *cam[:3, 3]]
    return f"{index + 1} {' '.join(number(float(v)) for v in values)} 1 {name}"


def three_digits(value: float) -> str:
    """The number as Visual C++ prints it."""
    mantissa, exponent = f"{value:.15e}".split("e")
    return f"{mantissa}e{exponent[0]}{int(exponent[1:]):03d}"


POINTS = "775.26 129.33 1 118.5 971.25 -1"


def two_lines(second: str) -> Callable[[list[str]], str]:
    return lambda lines: "".join(f"{line}\n{second}\n" for line in lines)


@pytest.mark.parametrize(
    ("prefix", "number", "text"),
    [
        ("", repr, two_lines(POINTS)),
        ("", repr, two_lines("")),
        ("", repr, lambda lines: "\n".join(lines) + "\n\n\n"),
        ("", repr, lambda lines: two_lines("")(lines).replace("\n", "\r\n")),
        ("my scan (copy 2) ", three_digits, two_lines(POINTS)),
        ("", repr, lambda lines: "\ufeff# Image list\n#\n" + two_lines(POINTS)(lines)),
    ],
    ids=["points", "no points", "no second lines", "CRLF", "blanks, three digits", "BOM"],
)
def test_text_models_are_read_without_their_points(
    reference: Path,
    tmp_path: Path,
    prefix: str,
    number: Callable[[float], str],
    text: Callable[[list[str]], str],
) -> None:
    lines = [
        image_line(index, pose, prefix + name, number)
        for index, (pose, name) in enumerate(zip(estimates(), NAMES, strict=True))
    ]
    folder = tmp_path / "model"
    folder.mkdir()
    (folder / "images.txt").write_bytes(text(lines).encode())
    scores_right(reference, folder)


def test_binary_models_are_read_without_their_points(reference: Path, tmp_path: Path) -> None:
    content = struct.pack("<Q", COUNT)
    for index, (pose, name) in enumerate(zip(estimates(), NAMES, strict=True)):
        cam = np.linalg.inv(pose)
        content += struct.pack("<I7dI", index + 1, *wxyz_of(cam[None])[0], *cam[:3, 3], 1)
        content += name.encode() + b"\0" + struct.pack("<Q", 1) + struct.pack("<2dQ", 1.0, 2.0, 7)
    folder = tmp_path / "model"
    folder.mkdir()
    path = folder / "images.bin"
    path.write_bytes(content)
    scores_right(reference, folder)


@pytest.mark.parametrize("length", [0, 7, 100, 3000])
def test_a_binary_model_cut_short_is_told(
    reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], length: int
) -> None:
    test_binary_models_are_read_without_their_points(reference, tmp_path)
    path = tmp_path / "model" / "images.bin"
    path.write_bytes(path.read_bytes()[:length])
    assert "images.bin" in refused(capsys, reference, tmp_path / "model")


def kapture_lines(device: str) -> str:
    lines = ["# kapture format: 1.1", "# timestamp, device_id, qw, qx, qy, qz, tx, ty, tz"]
    for index, pose in enumerate(estimates()):
        cam = np.linalg.inv(pose)
        values = numbers([*wxyz_of(cam[None])[0], *cam[:3, 3]]).replace(" ", ", ")
        lines.append(f"{index}, {device}, {values}")
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("device", ["cam0", "1"])
def test_kapture_is_read_with_its_records(reference: Path, tmp_path: Path, device: str) -> None:
    folder = tmp_path / "set" / "sensors"
    folder.mkdir(parents=True)
    (folder / "trajectories.txt").write_text(kapture_lines(device))
    records = [f"{index}, {device}, {name}" for index, name in enumerate(NAMES)]
    (folder / "records_camera.txt").write_text("\n".join(["# kapture format: 1.1", *records]))
    scores_right(reference, folder / "trajectories.txt")
    scores_right(reference, tmp_path / "set")


@pytest.mark.parametrize("device", ["cam0", "1"])
def test_kapture_without_records_is_taken_for_nothing_else(
    reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], device: str
) -> None:
    path = tmp_path / "trajectories.txt"
    path.write_text(kapture_lines(device))
    assert "records_camera.txt" in refused(capsys, reference, path)


# Axes of the camera, and order of quaternions


def opengl(poses: Array) -> Array:
    return poses @ np.diag([1.0, -1.0, -1.0, 1.0])


def test_axes_of_opengl_are_named_and_taken(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    times_s = np.arange(COUNT) / 30
    truth = write_tum(tmp_path / "truth.txt", TRUE, times_s)
    given = write_tum(tmp_path / "given.txt", opengl(estimates()), times_s)
    line = refused(capsys, truth, given)
    assert "as opengl" in line
    assert "x right, y up, z backward" in line
    scores_right(truth, given, convention="opengl")


def test_axes_of_a_model(
    reference: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "model"
    folder.mkdir()
    poses = zip(opengl(estimates()), NAMES, strict=True)
    lines = [image_line(index, pose, name) for index, (pose, name) in enumerate(poses)]
    (folder / "images.txt").write_text("\n\n".join(lines) + "\n")
    assert "as opengl" in refused(capsys, reference, folder)
    scores_right(reference, folder, convention="opengl")


def test_quaternions_in_the_other_order_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    times_s = np.arange(COUNT) / 30
    truth = write_tum(tmp_path / "truth.txt", TRUE, times_s)
    moved = [
        f"{time:.6f} {numbers([*pose[:3, 3], *wxyz])}"
        for time, pose, wxyz in zip(times_s, estimates(), wxyz_of(TRUE), strict=True)
    ]
    given = tmp_path / "given.txt"
    given.write_text("\n".join(moved))
    assert "world_from_cam-wxyz" in refused(capsys, truth, given)
    scores_right(truth, given, convention="world_from_cam-wxyz")


# Clocks


START_S = 1.6e9


def test_two_runs_in_one_file_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    times_s = START_S + np.arange(COUNT) / 30
    truth = write_tum(tmp_path / "truth.txt", TRUE, times_s)
    twice = write_tum(
        tmp_path / "twice.txt", np.concatenate([estimates(), TRUE]), np.tile(times_s, 2)
    )
    line = refused(capsys, truth, twice)
    assert f"line 1 and line {COUNT + 1}" in line
    assert "two runs" in line
    assert "two runs" in refused(capsys, twice, truth)


def test_times_in_whole_seconds_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    times_s = np.round(START_S + np.arange(COUNT) / 30)
    truth = write_tum(tmp_path / "truth.txt", TRUE, times_s)
    assert "times rounded" in refused(capsys, truth, truth)


def test_a_late_clock_is_named_and_allowed_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    times_s = START_S + np.arange(COUNT) / 10
    truth = write_tum(tmp_path / "truth.txt", TRUE, times_s)
    late = write_tum(tmp_path / "late.txt", estimates(), times_s + 0.02)
    assert "give --offset -0.02" in refused(capsys, truth, late)
    scores_right(truth, late, offset_s=-0.02)
    scores_right(truth, late, most_apart_s=0.03)


def test_clocks_are_of_two_files_with_times(
    reference: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for option in ("--offset", "--max-difference"):
        assert option in refused(capsys, reference, reference, option, 0.5)
    assert "--max-difference" in refused(capsys, reference, reference, "--max-difference", -1)


# The same in sequences of photographs


def write_tum_sequence(
    folder: Path, photograph_s: Sequence[float], pose_s: Sequence[float]
) -> Path:
    folder.mkdir()
    lines = []
    for index, time in enumerate(photograph_s):
        Image.fromarray(np.full((6, 8, 3), 128, np.uint8)).save(folder / f"{index}.png")
        lines.append(f"{time:.6f} {index}.png\n")
    (folder / "rgb.txt").write_text("".join(lines))
    write_tum(folder / "groundtruth.txt", TRUE[: len(pose_s)], pose_s)
    return folder


def test_a_pose_at_the_time_of_a_photograph_needs_no_neighbours(tmp_path: Path) -> None:
    times_s = START_S + np.arange(5)  # a second apart
    found = read_posed_sequence(write_tum_sequence(tmp_path / "seq", times_s, times_s))
    np.testing.assert_allclose(found.world_from_cam, TRUE[:5], atol=1e-9)


def test_a_photograph_between_distant_poses_has_none(tmp_path: Path) -> None:
    times_s = START_S + np.arange(5)
    photographs = [*times_s[:-1], times_s[-1] - 0.5]
    found = read_posed_sequence(write_tum_sequence(tmp_path / "seq", photographs, times_s))
    assert len(found) == 4


def test_two_runs_in_a_sequence_are_refused(tmp_path: Path) -> None:
    times_s = START_S + np.arange(5) / 30
    folder = write_tum_sequence(tmp_path / "seq", times_s, np.tile(times_s, 2))
    with pytest.raises(InputError, match="has two different poses"):
        read_posed_sequence(folder)


@pytest.mark.parametrize(("change", "warned"), [(opengl, True), (lambda poses: poses, False)])
def test_cameras_on_their_heads_are_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, change: Callable[[Array], Array], warned: bool
) -> None:
    trajectory = write_tum(tmp_path / "poses.txt", change(TRUE), np.arange(COUNT))
    bounds_m = np.array([[0.0, 0.0, 0.0], SIZE_M])
    repeated_poses(trajectory, "train", COUNT, bounds_m)
    assert ("stand on their heads" in caplog.text) == warned
