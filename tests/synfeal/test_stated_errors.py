"""Radii that poses state: are errors within them as often as they say?"""

import numpy as np
import pandas as pd
import pytest

from synfeal.cli import main
from synfeal.dataset.pose_table import STATED
from synfeal.evaluation.coverage import LEVELS, SD_LEVEL, coverage, radii
from synfeal.geometry.poses import pose_error, quat_wxyz_of
from tests.support import foreign_poses as foreign
from tests.support.collected import refused
from tests.support.property_support import random_table

COUNT = 60


def rayleigh(level, sigma):
    """Radius that holds a share of normal errors in a plane, in closed form."""
    return sigma * np.sqrt(-2.0 * np.log1p(-level))


def maxwell(level, sigma):
    from scipy.stats import maxwell as distribution

    return distribution.ppf(level, scale=sigma)


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize(("radius", "tolerance"), [(rayleigh, 1e-9), (maxwell, 0.04)])
def test_radii_of_all_levels_follow_from_two(level, radius, tolerance):
    """Exact for normal errors in a plane, near to it in space."""
    sigma = np.array([0.01, 3.0])
    found = radii(level, radius(SD_LEVEL, sigma), radius(0.95, sigma))
    np.testing.assert_allclose(found, radius(level, sigma), rtol=tolerance)


@pytest.mark.parametrize("stretched", [0.5, 1.0, 2.0])
def test_coverage_of_normal_errors(stretched):
    """Errors of different spreads, whose radii are stated right or all too wide by a factor."""
    rng = np.random.default_rng(5)
    sigma = rng.uniform(0.01, 1.0, 20_000)
    error = np.linalg.norm(sigma[:, None] * rng.normal(size=(len(sigma), 2)), axis=1)
    stated = (stretched * rayleigh(level, sigma) for level in (SD_LEVEL, 0.95))
    for one in coverage(error, *stated):
        held = 1.0 - (1.0 - one.level) ** (stretched**2)
        assert one.held == pytest.approx(held, abs=0.01)
        assert one.width == pytest.approx(stretched, rel=0.03)


def test_the_needed_radius_holds_just_what_it_says():
    """Of 20 equal radii, the 19th largest error is the one that 95 % need."""
    error = np.arange(1.0, 21.0)
    (found,) = [
        one for one in coverage(error, np.full(20, 5.0), np.full(20, 38.0)) if one[0] == 0.95
    ]
    assert found.held == 1.0
    assert found.width == pytest.approx(38.0 / 19.0)


@pytest.fixture
def localized(tmp_path):
    """A reference, and poses of ``synfeal localize`` that state 2 cm and 5 cm, 1 and 2 degrees."""
    truth = random_table(COUNT, 3).world_from_cam
    poses = foreign.disturbed(truth, 0.03, 1.0)
    names = [f"photo-{index:02d}.jpg" for index in range(COUNT)]
    columns = ("tx", "ty", "tz", "qw", "qx", "qy", "qz")
    for file, matrices in (("truth.csv", truth), ("poses.csv", poses)):
        values = np.concatenate([matrices[:, :3, 3], quat_wxyz_of(matrices)], axis=1)
        table = pd.DataFrame(values, columns=columns)
        table.insert(0, "image", names)
        if file == "poses.csv":
            table["status"], table["inliers"], table["confidence"] = "localized", 50, 1.0
            for name, radius in zip(STATED, (0.02, 0.05, 1.0, 2.0), strict=True):
                table[name] = radius
            table.loc[7, [*columns, *STATED]] = np.nan
            table.loc[7, "status"] = "not localized"
        table.to_csv(tmp_path / file, index=False)
    there = np.arange(COUNT) != 7
    return tmp_path, pose_error(poses[there], truth[there])


def test_evaluate_scores_stated_errors(localized, capsys):
    """The photograph without a pose states nothing, and is left out."""
    folder, (error_m, error_rad) = localized
    words = ["evaluate", str(folder / "truth.csv"), str(folder / "poses.csv")]
    assert main([*words, "--out", str(folder / "scores")]) == 0
    said = capsys.readouterr().out
    held_m, held_deg = np.mean(error_m <= 0.05), np.mean(np.degrees(error_rad) <= 2.0)
    needed_m = np.sort(error_m)[int(np.ceil(0.95 * len(error_m))) - 1]
    assert f"95 %: {100 * held_m:.1f} % ({0.05 / needed_m:.2f})" in said
    scores = pd.read_csv(folder / "scores/scores.csv").set_index("score")["value"]
    assert scores["position_m_95_held"] == pytest.approx(held_m)
    assert scores["position_m_95_stated_over_needed"] == pytest.approx(0.05 / needed_m)
    assert scores["orientation_deg_95_held"] == pytest.approx(held_deg)
    assert (folder / "scores/errors.png").is_file()


def test_an_error_of_nothing_is_refused(localized, capsys):
    folder, _ = localized
    table = pd.read_csv(folder / "poses.csv")
    table.loc[3, "position_95_m"] = 0.0
    table.to_csv(folder / "poses.csv", index=False)
    said = refused(capsys, "evaluate", folder / "truth.csv", folder / "poses.csv")
    assert "line 5: states an error of 0, which must be above 0" in said
