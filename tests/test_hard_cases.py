"""The table of hard cases: ours keeps its promises, and the table would say so if it did not."""

from __future__ import annotations

import math
import statistics
import xml.etree.ElementTree as ET
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from baselines.groundtruth.posegraph import lm
from baselines.hard_cases import losses as hard_losses
from baselines.localizers import losses
from synfeal import bootstrap
from synfeal.geometry import alignment, poses, rotations
from synfeal.hard_cases import case as cases
from synfeal.hard_cases import depth, exact, far_poses, medians
from synfeal.hard_cases import noise as hard_noise
from synfeal.hard_cases import rotations as hard_rotations
from synfeal.hard_cases.exact_rays import distance_m, first_crossings
from synfeal.labels import noise
from synfeal.mesh import collision, rays
from synfeal.planning import path
from synfeal.render import raycast_backend
from synfeal.report import stats
from synfeal.report.hard_cases import shares
from synfeal.report.hard_cases import table as hard_table
from synfeal.report.hard_cases.latex import hard_cases_latex
from synfeal.report.hard_cases.table import CASES, COLUMNS, rows_of, write_hard_cases
from synfeal.report.hard_cases.text import short
from synfeal.report.html.hard_cases import hard_cases_table
from synfeal.report.results import read_table
from synfeal.report.tables import write_rows
from tests.ray_truth import box, crossings, directions_of

Array = NDArray[np.float64]
FAMILIES = list(dict.fromkeys(case.family for case in CASES))


@pytest.fixture(autouse=True)
def _once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cases, "N_TIMINGS", 1)
    torch.set_num_threads(1)


def row(name: str) -> dict[str, Any]:
    return rows_of([case for case in CASES if case.name == name])[0]


@pytest.fixture(scope="module")
def all_rows() -> list[dict[str, Any]]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cases, "N_TIMINGS", 1)
        return rows_of(CASES)


def test_every_case_keeps_its_bound(all_rows: list[dict[str, Any]]) -> None:
    assert [(row["case"], row["our_error"]) for row in all_rows if not row["ok"]] == []


@pytest.mark.parametrize("family", FAMILIES)
def test_each_family_shows_what_goes_wrong(family: str, all_rows: list[dict[str, Any]]) -> None:
    rows = [row for row in all_rows if row["family"] == family]
    assert any(row["naive_error"] > row["bound"] for row in rows)


def test_no_case_is_there_twice() -> None:
    assert len({(case.family, case.name) for case in CASES}) == len(CASES)


class NoCentre(rays.RayCaster):
    """World coordinates rounded to float32, as Embree itself would take them."""

    def __init__(self, vertices: Array, faces: NDArray[np.int64]) -> None:
        super().__init__(np.float32(vertices), faces)


class TextbookVectors:
    """As SciPy's ``Rotation``, with the logarithm somebody would write first."""

    def __init__(self, matrix: Array) -> None:
        self.matrix = matrix

    @classmethod
    def from_matrix(cls, matrix: Array) -> TextbookVectors:
        return cls(matrix)

    def as_rotvec(self) -> Array:
        return hard_rotations._textbook_log(self.matrix)


def arccos_angle(a: Array, b: Array) -> Array:
    return 2 * np.arccos(np.clip(np.dot(a, b), -1, 1))


def long_way_round(start: Array, target: Array, n_frames: int) -> Array:
    return (target - start) / n_frames


def as_printed(start: Array, target: Array, n_frames: int) -> Array:
    steps = np.cumsum(np.arange(1, n_frames + 1))[:, None]
    return start + steps * (target - start) / n_frames


def straight_chord(a: Array, b: Array, t: Any) -> Array:
    return a + np.asarray(t)[:, None] * (b - a)


def two_percent_more(
    table: Any, metres: float, degrees: float, rng: np.random.Generator, add: Any = noise.add_noise
) -> Any:
    return add(table, 1.02 * metres, 1.02 * degrees, rng)


def half_precision(
    self: Any, pose: Array, draw: Any = raycast_backend.RaycastRenderer.render_rgbd
) -> Any:
    rgb, depth_m = draw(self, pose)
    return rgb, depth_m.astype(np.float16)


def in_a_cube(count: int, rng: np.random.Generator) -> Array:
    vectors = rng.uniform(-1, 1, (count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def no_antipode(predicted: torch.Tensor, true: torch.Tensor) -> torch.Tensor:
    return torch.linalg.vector_norm(predicted - true, dim=1).mean()


WITHOUT_ANTIPODE = losses.Distances(losses.position_distance, no_antipode)


def smallest(rungs: Any, min_agreement: float) -> int:
    return len(rungs) - 1


def start_of(graph: Any, iterations: int) -> Array:
    return graph.first_from_cam


BROKEN: dict[str, tuple[str, Any, str, Any]] = {
    "orientation error": ("quaternions, 1e-9", rotations, "rotation_angle_rad", arccos_angle),
    "rotation vectors": ("logarithm at π", hard_rotations, "Rotation", TextbookVectors),
    "quaternion of a matrix": (
        "five digits of text",
        rotations,
        "quat_wxyz_from_matrix",
        lambda matrices: np.array([hard_rotations._textbook_quat(m) for m in matrices]),
    ),
    "interpolation": (
        "quaternions, π − 1e-9, other sign",
        rotations,
        "slerp_quat_wxyz",
        straight_chord,
    ),
    "roll, pitch, yaw": ("from 179° to −179°", path, "step_of", long_way_round),
    "path": ("n = 100", path, "path_vectors", as_printed),
    "relative pose": (
        "cameras 1e6 m from the origin",
        poses,
        "relative",
        lambda a, b: np.linalg.inv(a) @ b,
    ),
    "alignment (Sim(3))": (
        "0.1 m of a line, 1e6 m away",
        alignment,
        "_collinear",
        lambda points: False,
    ),
    "ray casting": ("1e5 m from the origin", rays, "RayCaster", NoCentre),
    "collision mesh": ("screens of 5 mm", collision, "last_agreeing", smallest),
    "depth": (
        "slanted, 60 m",
        raycast_backend.RaycastRenderer,
        "render_rgbd",
        half_precision,
    ),
    "injected noise": ("orientation, 5°", noise, "add_noise", two_percent_more),
    "directions": ("directions", noise, "_unit_vectors", in_a_cube),
    "medians": (
        "an even number",
        bootstrap,
        "_medians",
        lambda ranked, counts: ranked[[len(ranked) // 2]],
    ),
    "losses": ("predicted −q", losses, "DISTANCES", {"norm": WITHOUT_ANTIPODE}),
    "pose graphs": ("LM: a third 170° off", lm, "optimise_lm", start_of),
    "shares": ("0 of 20", stats, "share_limits", shares._wald),
}


@pytest.mark.parametrize("family", BROKEN)
def test_a_broken_function_is_not_ok(family: str, monkeypatch: pytest.MonkeyPatch) -> None:
    name, module, attribute, broken = BROKEN[family]
    monkeypatch.setattr(module, attribute, broken)
    assert row(name)["ok"] == 0


def test_every_family_is_broken_once() -> None:
    assert set(FAMILIES) <= set(BROKEN)


def trial_of(ours: Callable[[], Any], truth: Any) -> cases.Case:
    return replace(CASES[0], bound=0.0, trial=lambda: cases.Trial(ours, ours, truth))


@pytest.mark.parametrize("answer", [np.nan, np.inf, -np.inf])
def test_an_answer_that_is_no_number_is_infinitely_wrong(answer: float) -> None:
    assert cases.examine(trial_of(lambda: np.array([1.0, answer]), [1, 2])).our_error == np.inf


def test_refusals_are_right_only_where_there_is_nothing_to_answer() -> None:
    def refuse() -> None:
        raise ValueError("no")

    assert cases.examine(trial_of(refuse, cases.REFUSED)).our_error == 0
    assert cases.examine(trial_of(refuse, 1)).our_error == np.inf
    assert cases.examine(trial_of(lambda: 1.0, cases.REFUSED)).our_error == np.inf


def test_errors_are_those_of_the_doubles_not_of_rounded_differences() -> None:
    assert exact.max_abs([1.0, 0.5], [1 + Fraction(1, 10**40), Fraction(1, 2)]) == pytest.approx(
        1e-40
    )
    assert exact.max_relative([200.0], [100]) == 1
    assert exact.max_abs(0.1, Fraction(1, 10)) == pytest.approx(5.55e-18, rel=1e-3)


def test_exact_rotations_agree_with_scipy_where_it_is_easy() -> None:
    quat = exact.quat_of(1.1, (1, 2, -2))
    expected = Rotation.from_rotvec(1.1 * np.array([1, 2, -2]) / 3)
    np.testing.assert_allclose(
        exact.rounded(exact.matrix_of(quat)), expected.as_matrix(), atol=1e-15
    )
    other = exact.quat_of(0.7, (3, 1, 1))
    between = (
        expected.inv() * Rotation.from_quat(exact.rounded(other), scalar_first=True)
    ).magnitude()
    assert float(exact.angle_between_quats(quat, other)) == pytest.approx(between, abs=1e-14)
    half = exact.rounded(exact.quat_to_power([-v for v in quat], 0.5))
    slerp = Slerp([0, 1], Rotation.concatenate([Rotation.identity(), expected]))
    np.testing.assert_allclose(half, slerp(0.5).as_quat(scalar_first=True), atol=1e-15)


def test_an_exact_angle_is_that_of_the_triangle_3_4_5() -> None:
    turn = [[Fraction(3, 5), Fraction(-4, 5), 0], [Fraction(4, 5), Fraction(3, 5), 0], [0, 0, 1]]
    numbers = [[exact.mpf(Fraction(v)) for v in line] for line in turn]
    assert float(exact.angle_of_matrix(numbers)) == pytest.approx(math.acos(0.6), abs=1e-15)


def test_the_nearest_rotation_is_that_of_the_singular_values() -> None:
    matrix = Rotation.random(rng=np.random.default_rng(0)).as_matrix()
    matrix += 0.05 * np.random.default_rng(1).normal(size=(3, 3))
    u, _, vt = np.linalg.svd(matrix)
    found = exact.rounded(exact.nearest_rotation(exact.exact(matrix)))
    np.testing.assert_allclose(found, u @ vt, atol=1e-14)


def test_exact_crossings_by_hand() -> None:
    corners = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
    origins = np.array([[0.25, 0.25, -1.0], [0.5, 0.5, -1.0], [0.5, 0.5000001, -1.0], [0, 0, 1.0]])
    ahead = np.tile([0.0, 0.0, 3.0], (4, 1))
    assert first_crossings(origins, ahead, corners) == [Fraction(1, 3), Fraction(1, 3), None, None]
    assert float(distance_m(Fraction(1, 3), ahead[0])) == 1.0


def test_exact_crossings_agree_with_double_precision() -> None:
    mesh, rng = box(np.array([1.0, 0.7, 3.0]))[0], np.random.default_rng(2)
    origins, directions = rng.uniform(0.1, 0.6, (50, 3)), directions_of(rng, 50)
    corners = np.asarray(mesh.vertices)[mesh.faces]
    found = [float(t) for t in first_crossings(origins, directions, corners) if t is not None]
    np.testing.assert_allclose(
        found, crossings(origins, directions, corners, 1e-15).upper, atol=1e-12
    )


def test_horns_alignment_recovers_a_known_one() -> None:
    source = np.random.default_rng(3).normal(size=(9, 3))
    turn = Rotation.from_rotvec([0.3, -1.0, 0.5]).as_matrix()
    scale, rotation = far_poses._horn(source, 0.37 * source @ turn.T + [1, 2, 3])
    assert float(scale) == pytest.approx(0.37)
    np.testing.assert_allclose(exact.rounded(rotation), turn, atol=1e-14)


def test_the_true_depth_of_a_wall_across_the_view_is_its_distance() -> None:
    assert {float(v) for v in depth.plane_at(99.999, 0.0).truth} == {99.999}
    slanted = [float(v) for v in depth.plane_at(2.0, 0.4).truth]
    x = (np.arange(16) + 0.5 - 8) / (8 / np.tan(np.radians(30)))
    np.testing.assert_allclose(slanted[:16], 2 / (1 - 0.4 * x), rtol=1e-14)


def test_the_limits_of_none_have_a_closed_form() -> None:
    low, high = shares.share(0, 20).truth
    assert float(low) == 0
    assert float(high) == pytest.approx(1 - 0.025 ** (1 / 20), rel=1e-14)


def test_true_medians_are_those_of_the_standard_library() -> None:
    values = [0.5, 0.25, 4.0, 1.0, 3.0, 0.125]
    assert float(medians.median_of(values).truth) == statistics.median(values)


def test_exact_gradients_are_those_of_small_steps() -> None:
    start = [*hard_losses.NEAR_POSITION, *hard_losses.NEAR_QUAT]
    slopes = hard_losses._exact_terms(start[:3], start[3:])[1]
    for k, slope in enumerate(slopes):
        ends = []
        for step in (-1e-5, 1e-5):
            moved = [v + step * (i == k) for i, v in enumerate(start)]
            ends.append(float(sum(hard_losses._exact_terms(moved[:3], moved[3:])[0])))
        assert (ends[1] - ends[0]) / 2e-5 == pytest.approx(float(slope), abs=1e-8)


def test_kolmogorovs_distance_tells_a_cube_from_a_sphere() -> None:
    rng = np.random.default_rng(4)
    assert (
        hard_noise._distance_from_uniform(rng.normal(size=(10**5, 3))) < hard_noise.LARGEST_DISTANCE
    )
    assert hard_noise._distance_from_uniform(rng.uniform(-1, 1, (10**5, 3))) > 0.03


def test_the_table_has_the_same_errors_every_time(tmp_path: Any, monkeypatch: Any) -> None:
    some = [c for c in CASES if c.family in ("orientation error", "depth", "ray casting")]
    monkeypatch.setattr(hard_table, "CASES", some)
    texts = []
    for name in ("once.csv", "twice.csv"):
        write_hard_cases(tmp_path / name)
        lines = (tmp_path / name).read_text().splitlines()
        assert lines[0] == ",".join(COLUMNS)
        texts.append([line.rsplit(",", 2)[0] for line in lines])
    assert texts[0] == texts[1]
    assert len(texts[0]) == len(some) + 1


def test_the_page_marks_what_exceeds_the_bound(tmp_path: Any, monkeypatch: Any) -> None:
    chosen = [c for c in CASES if c.name in ("logarithm at 0", "exponential at π")]
    monkeypatch.setattr(hard_table, "CASES", chosen)
    write_hard_cases(tmp_path / "table.csv")
    lines = ET.fromstring(hard_cases_table(tmp_path / "table.csv")).findall(".//tbody/tr")
    naive = ["".join(line[2].itertext()) for line in lines]
    assert naive[0] == "✗ noneθ / (2 sin θ) (R − Rᵀ)"
    assert "✗" not in naive[1]
    assert "✗" not in "".join("".join(line[3].itertext()) for line in lines)


def test_latex_colours_what_exceeds_the_bound_and_has_no_bare_symbols(
    tmp_path: Any, all_rows: list[dict[str, Any]]
) -> None:
    write_rows(tmp_path / "table.csv", COLUMNS, all_rows)
    text = hard_cases_latex(read_table(tmp_path / "table.csv"))
    lines = [line for line in text.splitlines() if line.startswith("rotation vectors")]
    assert r"\textcolor{red!85!black}{\textbf{none}} & 0 &" in lines[0]
    assert "textcolor" not in lines[-1]
    assert {c for c in text if ord(c) > 127} <= {"µ", "ö"}  # those LaTeX knows


@pytest.mark.parametrize(
    ("error", "text"),
    [
        (0.0, "0"),
        (np.inf, "none"),
        (2e-16, "2.0e−16"),
        (0.0346, "0.035"),
        (1237.5, "1,238"),
        (5e8, "5.0e8"),
    ],
)
def test_errors_are_short(error: float, text: str) -> None:
    assert short(error) == text
