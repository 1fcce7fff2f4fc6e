"""What photographs of a place teach of its errors, without building one."""

import numpy as np
import pandas as pd
import pytest

from baselines.places.check import FUSED, RENDERED, Known, check_of, learn_of_photographs
from baselines.places.place import Place
from baselines.references.pose_covariance import Spread
from baselines.references.stated_errors import (
    ErrorScale,
    Poses,
    Trial,
    photographs_coverage,
    read_scale,
    read_trial,
    usual_radius_m,
)
from synfeal.dataset.pose_table import STATED
from synfeal.records.files import file_sha256, write_json

N_TRIED = 30


@pytest.fixture
def checked(tmp_path):
    """A place whose map is off by its spread, and photographs that are off by three times that.

    The last photograph was not localized.
    """
    place = Place(tmp_path)
    place.map.mkdir()
    write_json(place.map / "map.json", {})
    columns = ("position_m", "position_spread_m", "orientation_deg", "orientation_spread_deg")
    trial = Trial(
        map_sha256=file_sha256(place.map / "map.json"),
        seed=0,
        tried=N_TRIED,
        **{name: [0.01] * N_TRIED for name in columns},
    )
    write_json(place.trial, trial.model_dump(mode="json"))
    stated = ErrorScale(trial).stated(Spread(0.02, 0.5))
    table = pd.DataFrame({"image": [f"frames/{row}.jpg" for row in range(N_TRIED)]})
    table[["tx", "ty", "tz", "qw", "qx", "qy", "qz"]] = [0.06, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    table["status"] = "localized"
    table[list(STATED)] = stated
    table.loc[N_TRIED - 1, ["status", "tx", *STATED]] = ["not localized", *[np.nan] * 5]
    table.to_csv(place.check, index=False)
    files = tuple(place.frames / f"{row}.jpg" for row in range(N_TRIED))
    return place, files


def known_as(kind, place, files):
    return Known(kind, files, np.tile(np.eye(4), (N_TRIED, 1, 1)), place.camera)


def test_photographs_of_a_place_widen_what_its_poses_state(checked):
    place, files = checked
    known = known_as(FUSED, place, files)
    for _ in range(2):  # a second build learns nothing more
        learn_of_photographs(place, known)
        stated = read_scale(place.map).stated(Spread(0.02, 0.5))
        np.testing.assert_allclose(stated, (0.06, 0.06, 0.5, 0.5), rtol=1e-6)
    assert len(read_trial(place.map).photographs.position_m) == N_TRIED - 1
    shown = check_of(place, known)["stated"]["position_m"]
    assert {one["held"] for one in shown} == {0.0}  # by the radii of the trial's frames alone
    assert shown[-1]["width"] == pytest.approx(1 / 3)


def test_photographs_are_judged_by_the_other_half_of_them():
    """Errors of photographs are three times those of the trial, but for one: its half has it."""
    count = 60
    names = ("position_m", "position_spread_m", "orientation_deg", "orientation_spread_deg")
    alike = {name: [0.01] * count for name in names}
    errors = [0.03] * count
    errors[0] = 0.05
    photographs = Poses(**alike | {"position_m": errors})
    trial = Trial(map_sha256="", seed=0, tried=count, photographs=photographs, **alike)
    found = {one.level: one for one in photographs_coverage(trial)["position_m"]}
    # Its own half takes no part in its radius, so that error alone is outside.
    assert found[0.95].held == pytest.approx((count - 1) / count)
    assert photographs_coverage(trial)["orientation_deg"][0].held == 1.0
    # The largest of 60 holds 95 % with a confidence of 1 - 0.95^60, 95 %; the next one with 81 %.
    assert usual_radius_m(trial) == pytest.approx(0.05)
    assert usual_radius_m(trial.model_copy(update={"photographs": None})) == pytest.approx(0.01)


def test_few_photographs_are_not_judged():
    names = ("position_m", "position_spread_m", "orientation_deg", "orientation_spread_deg")
    few = Poses(**{name: [0.01] * 47 for name in names})
    trial = Trial(map_sha256="", seed=0, tried=47, photographs=few, **few.model_dump())
    assert photographs_coverage(trial) == {}
    lost = Trial(map_sha256="", seed=0, tried=90, **{name: [0.01] * 9 for name in names})
    assert usual_radius_m(lost) is None


def test_renderings_are_no_second_trial(checked):
    place, files = checked
    learn_of_photographs(place, known_as(RENDERED, place, files))
    assert read_trial(place.map).photographs is None
