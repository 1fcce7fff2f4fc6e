"""What photographs of a place teach of its errors, without building one."""

import numpy as np
import pandas as pd
import pytest

from baselines.places.check import FUSED, RENDERED, Known, check_of, learn_of_photographs
from baselines.places.place import Place
from baselines.references.pose_covariance import Spread
from baselines.references.stated_errors import ErrorScale, Trial, read_scale, read_trial
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


def test_renderings_are_no_second_trial(checked):
    place, files = checked
    learn_of_photographs(place, known_as(RENDERED, place, files))
    assert read_trial(place.map).photographs is None
