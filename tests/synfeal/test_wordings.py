"""Lines for a person: refusals in our own words, progress, and the end of a command."""

import ast
import errno
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from pydantic import ValidationError

import synfeal
from synfeal.config.dataset import CameraConfig
from synfeal.config.load import describe
from synfeal.dataset.frame_files import decode_png, encode_png
from synfeal.errors import InputError, exit_status
from synfeal.records import progress
from tests.support.mesh_samples import box_mesh

NAN = np.full((4, 4), np.nan)
FAR = np.eye(4)
FAR[0, 3] = 1e308


@pytest.fixture(scope="module")
def renderer():
    with synfeal.Renderer(box_mesh(), width=16, height=16, backend="raycast") as opened:
        yield opened


@pytest.mark.parametrize(
    ("pose", "words"),
    [
        (NAN, "must hold finite numbers"),
        (FAR, "must hold finite numbers"),
        (np.diag([-1.0, 1, 1, 1]), "is not a rigid pose"),  # mirrored
        (np.diag([2.0, 2, 2, 1]), "is not a rigid pose"),
        (np.zeros((4, 4)), "is not a rigid pose"),
        (np.eye(4)[:, ::-1], "is not a rigid pose"),
        (np.eye(2), r"must be of shape \(4, 4\), found \(2, 2\)"),
        (np.eye(4)[:3], r"must be of shape \(4, 4\), found \(3, 4\)"),
        (np.eye(4)[None], r"must be of shape \(4, 4\), found \(1, 4, 4\)"),
        (None, "must be of shape"),
        ("here", "cannot be read as a pose"),
        ([[1, 2], [3]], "cannot be read as a pose"),
    ],
)
def test_a_renderer_takes_rigid_poses_only(pose, words, renderer):
    for draw in (renderer.render, renderer.render_rgbd):
        with pytest.raises(InputError, match=rf"^world_from_cam: .*{words}"):
            draw(pose)


def test_a_renderer_takes_poses_of_few_digits_and_lists(renderer):
    rounded = np.round(np.eye(4), 3).tolist()
    np.testing.assert_array_equal(renderer.render(rounded), renderer.render(np.eye(4)))


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"width": 1}, "width: must be 16 or more, found 1"),
        ({"width": 9000}, "width: must be 8192 or less, found 9000"),
        ({"width": 20.5}, "width: must be a whole number, found 20.5"),
        ({"width": "wide"}, "width: must be a whole number, found 'wide'"),
        ({"horizontal_fov_deg": 1.0}, "horizontal_fov_deg: must be above 1, found 1.0"),
        ({"horizontal_fov_deg": 361}, "horizontal_fov_deg: must be 360 or less, found 361"),
        ({"cx": float("nan")}, "cx: must be a finite number, found nan"),
        ({"near_m": "near"}, "near_m: must be a number, found 'near'"),
        ({"distortion": [1, 2, 3]}, "distortion: must hold at least 4 values"),
        ({"distortion": 7}, "distortion: must be a list, found 7"),
    ],
)
def test_bounds_are_said_in_plain_words(values, words):
    with pytest.raises(ValidationError) as caught:
        CameraConfig.model_validate(values)
    assert describe(caught.value).startswith(words)


def test_lines_of_progress_tell_rate_and_time_left(monkeypatch, capsys):
    now_s = 100.0
    monkeypatch.setattr(progress, "EVERY_S", 5.0)
    monkeypatch.setattr(progress.time, "monotonic", lambda: now_s)
    with progress.Progress(40, "validate") as shown:
        for _ in range(20):
            now_s += 0.5
            shown.update()
    assert capsys.readouterr().err.splitlines() == [
        "validate: 10 of 40 frames, 2.0/s, 15 s left",
        "validate: 20 of 40 frames, 2.0/s, 10 s left",
    ]


def test_a_finished_part_is_told_and_what_was_done_before_does_not_count_for_the_rate(
    monkeypatch, capsys
):
    now_s = 100.0
    monkeypatch.setattr(progress, "EVERY_S", 5.0)
    monkeypatch.setattr(progress.time, "monotonic", lambda: now_s)
    with progress.Progress(40, "collect", 20) as shown:
        now_s += 5.0
        shown.update(10)
        now_s += 2.5
        shown.part_done("seq-02", 10, 4.0)
        now_s += 2.5  # since the last line: not due yet
        shown.update(10)
    assert capsys.readouterr().err.splitlines() == [
        "collect: 30 of 40 frames, 2.0/s, 5 s left",
        "seq-02, 10 frames in 4.0 s, 2.5/s",
    ]


@pytest.mark.parametrize("shape", [(33, 40, 3), (33, 40), (1, 1, 3), (1, 1)])
def test_our_own_images_are_decoded_as_pillow_does(shape, tmp_path):
    dtype, most = (np.uint8, 256) if len(shape) == 3 else (np.uint16, 65536)
    pixels = np.random.default_rng(3).integers(0, most, shape).astype(dtype)
    content = encode_png(pixels)
    (tmp_path / "a.png").write_bytes(content)
    decoded = decode_png(content)
    assert decoded.dtype == dtype
    np.testing.assert_array_equal(decoded, pixels)
    np.testing.assert_array_equal(np.asarray(Image.open(tmp_path / "a.png")), pixels)


def test_nothing_else_is_taken_for_one_of_our_own_images(tmp_path):
    """Each byte changed, each cut, and the same pixels by another program are left to Pillow."""
    pixels = np.arange(6 * 5 * 3, dtype=np.uint8).reshape(6, 5, 3)
    content = encode_png(pixels)
    for place in range(len(content)):
        changed = bytearray(content)
        changed[place] ^= 1
        assert decode_png(bytes(changed)) is None
        assert decode_png(content[:place]) is None
    assert decode_png(content + b"\0") is None
    Image.fromarray(pixels).save(tmp_path / "a.png")
    assert decode_png((tmp_path / "a.png").read_bytes()) is None


WAITS = (
    "import sys, time\nfrom synfeal.errors import exit_status\n"
    "def wait():\n    print('ready', flush=True)\n    time.sleep(60)\n"
    "sys.exit(exit_status(wait, 'nothing was kept'))\n"
)


def test_sigterm_says_one_line(tmp_path):
    command = [sys.executable, "-c", WAITS]
    with subprocess.Popen(command, stdout=-1, stderr=-1, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGTERM)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 143
    assert said == "error: terminated; nothing was kept\n"


def test_a_full_disk_is_not_blamed_on_what_is_copied(capsys):
    def copy():
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "source.png", None, "target.png")

    assert exit_status(copy, "nothing was kept") == 1
    said = capsys.readouterr().err
    assert said == "error: target.png: No space left on device; nothing was kept\n"


def test_sigterm_leaves_handlers_as_they_were():
    before = signal.getsignal(signal.SIGTERM)
    assert exit_status(lambda: None, "") == 0
    assert signal.getsignal(signal.SIGTERM) is before
    began = time.monotonic()
    assert exit_status(lambda: os.kill(os.getpid(), signal.SIGTERM) or time.sleep(9), "") == 143
    assert time.monotonic() - began < 9


ROOT = Path(__file__).parents[2]
# Named for what they raise; commands end in the errors of what they call.
SELF_EVIDENT = ("refuse", "check", "_")
COMMANDS = ("synfeal/cli/", "baselines/cli/", "reproduction/cli.py")


def raised_by(function):
    """Names of the exceptions that a function raises itself, not in functions inside it."""
    names, waiting = set(), list(function.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            names.add(ast.unparse(node.exc.func))
        if not isinstance(node, ast.FunctionDef | ast.ClassDef | ast.Lambda):
            waiting.extend(ast.iter_child_nodes(node))
    return names


def test_functions_say_which_refusals_they_raise():
    silent = []
    for path in sorted(ROOT.glob("*/**/*.py")):
        place = path.relative_to(ROOT).as_posix()
        if not place.startswith(("synfeal/", "baselines/", "reproduction/")):
            continue
        if place.startswith(COMMANDS):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.FunctionDef) or node.name.startswith(SELF_EVIDENT):
                continue
            told = ast.get_docstring(node)
            if (
                told
                and not told.startswith("Refuse")
                and "InputError" in raised_by(node)
                and "InputError:" not in told
            ):
                silent.append(f"{place}: {node.name}")
    assert silent == []
