"""Our functions keep their bounds where textbook formulas do not."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from reproduction.statistics import limits
from tests.hard_cases import cases
from tests.hard_cases import truths as references
from tests.hard_cases.values import FILE, REFUSED, error_of, stored_values

FAMILIES = list(dict.fromkeys(family.name for family in cases.CASES))


@pytest.fixture(scope="module")
def rows():
    return list(cases.examined(cases.CASES))


def test_every_case_keeps_its_bound(rows):
    assert [(row["case"], row["our_error"]) for row in rows if not row["ok"]] == []
    assert len(stored_values()) == len(rows) >= 45


@pytest.mark.parametrize("family", FAMILIES)
def test_each_family_shows_what_goes_wrong(family, rows):
    assert any(row["naive_error"] > row["bound"] for row in rows if row["family"] == family)


def test_a_broken_function_is_not_ok(monkeypatch):
    monkeypatch.setattr(limits, "share_limits", references.wald)
    broken = [row["case"] for row in cases.examined(cases.CASES[-2:]) if not row["ok"]]
    assert broken == ["0 of 20", "1 of 100"]


@pytest.mark.parametrize(
    ("answer", "truth", "error"),
    [
        ([1.0, np.nan], ["1", "2"], np.inf),
        ([1.0, np.inf], ["1", "2"], np.inf),
        ([1.0, np.inf], ["1", "inf"], 0),
        ([1.0, 2.0], ["1", "inf"], np.inf),
        (REFUSED, REFUSED, 0),
        (REFUSED, "1", np.inf),
        (1.0, REFUSED, np.inf),
        ([1.0, 0.5], [f"1.{'0' * 39}1", "1/2"], 1e-40),
        (0.1, "1/10", 5.55e-18),  # of the double itself
    ],
)
def test_an_error_is_that_of_the_doubles(answer, truth, error):
    assert error_of(answer, truth) == pytest.approx(error, rel=1e-3)


def test_turns_differ_by_the_angle_between_them_whatever_their_signs():
    for angle in (1e-12, 0.3, np.pi):
        quats = [[1.0, 0, 0, 0], [-np.cos(angle / 2), 0, -np.sin(angle / 2), 0]]
        truth = [["1", "0", "0", "0"], ["1", "0", "0", "0"]]
        assert error_of(quats, truth, is_turn=True) == pytest.approx(angle, rel=1e-3)


def test_stored_values_are_those_of_the_script():
    computed = json.loads(json.dumps(references.computed()))
    stored = json.loads(FILE.read_text(encoding="utf-8"))
    assert computed.keys() == stored.keys()
    for family, found in computed.items():
        assert found.keys() == stored[family].keys()
        for case, record in found.items():
            kept = stored[family][case]
            assert record["truth"] == kept["truth"] or record.get("inputs") != kept.get("inputs")
            for name, value in record.get("inputs", {}).items():
                np.testing.assert_allclose(value, kept["inputs"][name], rtol=1e-15, atol=1e-15)


def test_truths_agree_with_scipy_and_closed_forms():
    quat, other = references.quat_of(1.1, (1, 2, -2)), references.quat_of(0.7, (3, 1, 1))
    expected = Rotation.from_rotvec(1.1 * np.array([1, 2, -2]) / 3)
    second = Rotation.from_quat(references.rounded(other), scalar_first=True)
    found = references.rounded(references.matrix_of(quat))
    np.testing.assert_allclose(found, expected.as_matrix(), atol=1e-15)
    product = references.quat_product(references.inverse(quat), other)
    between = (expected.inv() * second).magnitude()
    assert float(references.angle_of_quat(product)) == pytest.approx(between, abs=1e-14)
    matrix = references.matrix_of(product)
    assert float(references.angle_of_matrix(matrix)) == pytest.approx(between)
    half = references.rounded(references.quat_to_power([-v for v in quat], 0.5))
    slerp = Slerp([0, 1], Rotation.concatenate([Rotation.identity(), expected]))
    np.testing.assert_allclose(half, slerp(0.5).as_quat(scalar_first=True), atol=1e-15)
    noisy = expected.as_matrix() + 0.05 * np.random.default_rng(1).normal(size=(3, 3))
    u, _, vt = np.linalg.svd(noisy)
    nearest = references.nearest_rotation(references.exact(noisy))
    np.testing.assert_allclose(references.rounded(nearest), u @ vt, atol=1e-14)
    back = references.rounded(references.quat_of_rotation(nearest))
    turned = Rotation.from_quat(back, scalar_first=True).as_matrix()
    np.testing.assert_allclose(turned, u @ vt, atol=1e-14)
    assert float(references.lower_limit(20, 20)) == pytest.approx(0.025 ** (1 / 20), rel=1e-14)
    slanted = [float(depth) for depth in references.plane_depths(references.scenes.Plane(2.0, 0.4))]
    x = (np.arange(16) + 0.5 - 8) / (8 / np.tan(np.radians(30)))
    np.testing.assert_allclose(slanted, 2 / (1 - 0.4 * x), rtol=1e-14)
