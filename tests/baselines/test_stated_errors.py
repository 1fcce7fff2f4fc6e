"""Errors that poses of a map state: scaled by a trial, held by new poses, silent in old maps."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest
from PIL import Image

from baselines.references.pose_covariance import Spread
from baselines.references.stated_errors import (
    FEWEST,
    FILE,
    ErrorScale,
    Poses,
    Trial,
    add_photographs,
    held_out_coverage,
    read_scale,
)
from synfeal.cli import main
from synfeal.dataset.pose_table import STATED
from synfeal.geometry.poses import pose_error, pose_from_quat
from tests.support.collected import refused
from tests.support.painted_rooms import (
    PHOTO,
    looking_about,
    textures,
    write_calibration,
    write_dataset,
    write_photographs,
)

N_FRAMES, N_PHOTOS = 28, 12
POSE = ["tx", "ty", "tz", "qw", "qx", "qy", "qz"]


def normal(rng, count):
    return np.linalg.norm(rng.normal(size=(count, 3)), axis=1)


def heavy(rng, count):
    """One pose in eight is off by ten times what its inliers say."""
    return normal(rng, count) * np.where(rng.random(count) < 1 / 8, 10.0, 1.0)


def drawn(tail, count, seed):
    """A trial of poses of different spreads, all stated three times too small."""
    rng = np.random.default_rng(seed)
    spread_m, spread_deg = rng.uniform(0.001, 0.1, count), rng.uniform(0.1, 2.0, count)
    return Trial(
        map_sha256="",
        seed=0,
        tried=count,
        position_m=3 * spread_m * tail(rng, count),
        position_spread_m=spread_m,
        orientation_deg=3 * spread_deg * tail(rng, count),
        orientation_spread_deg=spread_deg,
    )


@pytest.mark.parametrize("tail", [normal, heavy])
@pytest.mark.parametrize("count", [FEWEST, 100])
def test_new_poses_lie_within_their_radii_as_often_as_these_say(tail, count):
    """On average over trials, as conformal prediction promises: at least, and by 1 / n at most."""
    new = np.sort(3 * tail(np.random.default_rng(999), 100_000))  # errors over spreads
    held = []
    for seed in range(200):
        radii = ErrorScale(drawn(tail, count, seed)).stated(Spread(1.0, 1.0))
        held.append(np.searchsorted(new, radii, side="right") / len(new))
    for share, level in zip(np.mean(held, axis=0), (0.6827, 0.95) * 2, strict=True):
        assert level - 0.015 < share < level + 1.0 / (count + 1) + 0.015


def test_radii_grow_with_what_inliers_say():
    scale = ErrorScale(drawn(normal, 100, 1))
    near, far = (np.array(scale.stated(Spread(k * 0.01, k * 0.1))) for k in (1.0, 4.0))
    np.testing.assert_allclose(far, 4.0 * near)
    assert near[0] < near[1]
    assert near[2] < near[3]


def scale_with_photographs(photographs, trial=None):
    poses = Poses(**photographs.model_dump(include=set(Poses.model_fields)))
    known = trial or drawn(normal, 100, 1)
    return ErrorScale(known.model_copy(update={"photographs": poses}))


@pytest.mark.parametrize(("factor", "least", "most"), [(4.0, 4.0, 6.0), (0.1, 1.0, 1.0)])
def test_photographs_widen_radii_and_never_narrow_them(factor, least, most):
    trial = drawn(normal, 100, 1)
    errors = trial.model_dump()
    for name in ("position_m", "orientation_deg"):
        errors[name] = [factor * error for error in errors[name]]
    both = np.array(scale_with_photographs(Trial(**errors), trial).stated(Spread(0.01, 0.1)))
    alone = np.array(ErrorScale(trial).stated(Spread(0.01, 0.1)))
    assert (both / alone >= least - 1e-9).all()
    assert (both / alone <= most + 1e-9).all()


def test_radii_that_photographs_widen_hold_their_share_in_nine_of_ten_places():
    """As tolerance limits promise: each place at least its share, but for one in ten."""
    new = np.sort(12 * normal(np.random.default_rng(999), 100_000))  # four times off as the trial
    held = []
    for seed in range(400):
        seen = drawn(normal, 60, 1000 + seed).model_dump()
        for name in ("position_m", "orientation_deg"):
            seen[name] = [4 * error for error in seen[name]]
        radii = scale_with_photographs(Trial(**seen)).stated(Spread(1.0, 1.0))
        held.append(np.searchsorted(new, radii, side="right") / len(new))
    sure = np.mean(np.array(held) >= (0.6827, 0.95) * 2, axis=0)
    # Of 60 ratios the largest holds 95 % with 95 % confidence, the one before with 81 %.
    np.testing.assert_allclose(sure[[1, 3]], 0.954, atol=0.03)
    assert (sure[[0, 2]] > 0.87).all()
    assert (sure[[0, 2]] < 0.96).all()


def test_a_photograph_at_another_place_widens_no_radius():
    seen = drawn(normal, 60, 3).model_dump()
    usual = np.array(scale_with_photographs(Trial(**seen)).stated(Spread(1.0, 1.0)))
    for name in ("position_m", "orientation_deg"):
        seen[name] = [1000 * seen[name][0], *seen[name][1:]]
    with_one = np.array(scale_with_photographs(Trial(**seen)).stated(Spread(1.0, 1.0)))
    assert (with_one <= 1.3 * usual).all()


def test_what_is_far_less_certain_than_anything_tried_has_no_stated_error():
    """Spreads that were tried reach to 0.1 m and 2 degrees."""
    seen = drawn(normal, 60, 3)
    scale = scale_with_photographs(seen)
    assert scale.knows(Spread(0.15, 3.0))
    assert not scale.knows(Spread(0.25, 0.5))
    assert not scale.knows(Spread(0.01, 5.0))
    # A pose of another place that is as uncertain teaches nothing of such.
    values = seen.model_dump()
    values["position_m"] = [100.0, *values["position_m"][1:]]
    values["position_spread_m"] = [0.3, *values["position_spread_m"][1:]]
    assert not scale_with_photographs(Trial(**values)).knows(Spread(0.25, 0.5))
    # Renderings alone must judge photographs of whatever spread.
    assert ErrorScale(seen).knows(Spread(1.0, 50.0))


def test_photographs_are_added_with_the_spreads_that_their_radii_come_from(copied):
    """Radii of the trial's frames, of poses that are all off by twice their 95 % radius."""
    folder = copied / "map"
    rng = np.random.default_rng(6)
    spreads = [Spread(*pair) for pair in rng.uniform(0.01, 1.0, (FEWEST, 2))]
    before = read_scale(folder)
    stated = np.array([before.stated(spread) for spread in spreads])
    add_photographs(folder, 2 * stated[:, 1], 2 * stated[:, 3], stated)
    after = np.array([read_scale(folder).stated(spread) for spread in spreads])
    np.testing.assert_allclose(after[:, [1, 3]], 2 * stated[:, [1, 3]])
    add_photographs(folder, np.zeros(0), np.zeros(0), np.zeros((0, 4)))
    np.testing.assert_allclose([read_scale(folder).stated(spread) for spread in spreads], after)


def test_halves_of_a_trial_judge_each_other():
    """Where the tail of one half is not that of the other, its radii are told to be too narrow."""
    good = held_out_coverage(drawn(normal, 400, 2))
    assert {one.level: one.held for one in good["position_m"]}[0.95] == pytest.approx(
        0.95, abs=0.03
    )
    values = drawn(normal, 400, 2).model_dump()
    values["position_m"] = [
        error * (5.0 if row % 2 else 1.0) for row, error in enumerate(values["position_m"])
    ]
    bad = held_out_coverage(Trial(**values))["position_m"]
    assert {one.level: one.held for one in bad}[0.95] < 0.8
    assert not held_out_coverage(drawn(normal, 2 * FEWEST - 1, 2))


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A mapped room, and photographs of it."""
    folder = tmp_path_factory.mktemp("place")
    paint = textures(0)
    write_dataset(folder / "frames", paint, looking_about(N_FRAMES, 1))
    write_photographs(folder / "photos", paint, looking_about(N_PHOTOS, 2))
    write_calibration(folder / "photo.json", PHOTO)
    assert main(["map", str(folder / "frames"), "--out", str(folder / "map")]) == 0
    return folder


def localized(place, out, images="photos", map_="map"):
    command = ["localize", str(place / map_), str(place / images), "--out", str(out)]
    assert main([*command, "--camera", str(place / "photo.json"), "--world", "mesh"]) == 0
    return pd.read_csv(out)


def test_photographs_lie_within_their_radii(place, tmp_path):
    table = localized(place, tmp_path / "poses.csv")
    assert (table["status"] == "localized").all()
    poses = pose_from_quat(table[POSE[:3]].to_numpy(), table[POSE[3:]].to_numpy())
    error_m, error_rad = pose_error(poses, looking_about(N_PHOTOS, 2))
    stated = table[list(STATED)].to_numpy()
    assert np.isfinite(stated).all()
    # At 95 %, fewer than 10 of 12 happen in 2 of 100 samples.
    assert (error_m <= stated[:, 1]).sum() >= 10
    assert (np.degrees(error_rad) <= stated[:, 3]).sum() >= 10
    assert np.median(stated[:, 1]) < 10 * np.median(error_m)


def test_the_trial_says_what_it_was(place):
    trial = Trial.model_validate_json((place / "map" / FILE).read_text())
    assert trial.tried == N_FRAMES
    assert FEWEST <= len(trial.position_m) <= N_FRAMES
    assert np.median(trial.position_m) < 0.05
    assert read_scale(place / "map") is not None


def changed(folder):
    record = json.loads((folder / "map.json").read_text())
    (folder / "map.json").write_text(json.dumps({**record, "seconds": -1.0}))


def short(folder):
    trial = json.loads((folder / FILE).read_text())
    values = {key: each[:5] if isinstance(each, list) else each for key, each in trial.items()}
    (folder / FILE).write_text(json.dumps(values))


@pytest.fixture
def copied(place, tmp_path):
    """The map anew, and one photograph."""
    shutil.copytree(place / "map", tmp_path / "map")
    (tmp_path / "photos").mkdir()
    for name in ("photos/photo-00.png", "photo.json"):
        shutil.copy(place / name, tmp_path / name)
    return tmp_path


@pytest.mark.parametrize("spoil", [lambda folder: (folder / FILE).unlink(), changed, short])
def test_an_old_map_states_no_error_and_says_what_to_run(spoil, copied, caplog):
    spoil(copied / "map")
    table = localized(copied, copied / "poses.csv")
    assert (table["status"] == "localized").all()
    assert table[list(STATED)].isna().all(axis=None)
    (said,) = [text for text in caplog.messages if "state no error" in text]
    assert "the same synfeal build, or synfeal map into another folder, tries it" in said


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("position_m", [0.1], "not of one length"),
        ("position_spread_m", [0.0] * 5, "must be above 0"),
        ("version", 2, "version"),
    ],
)
def test_a_damaged_trial_is_refused(key, value, said, copied, capsys):
    path = copied / "map" / FILE
    path.write_text(json.dumps({**json.loads(path.read_text()), key: value}))
    words = ("localize", copied / "map", copied / "photos", "--out", copied / "poses.csv")
    text = refused(capsys, *words, "--camera", copied / "photo.json")
    assert "trial.json" in text
    assert said in text


def test_a_photograph_that_is_not_localized_states_nothing(copied):
    Image.new("RGB", (PHOTO.width, PHOTO.height)).save(copied / "photos/photo-00.png")
    table = localized(copied, copied / "poses.csv")
    assert table["status"].tolist() == ["not localized"]
    assert table[list(STATED)].isna().all(axis=None)
