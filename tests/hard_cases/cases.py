"""List hard cases; a new one is a line here and one in ``tests.hard_cases.truths``."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reproduction.statistics import limits
from synfeal.evaluation import bootstrap
from synfeal.geometry import poses, rotations
from synfeal.planning import path
from tests.hard_cases import estimates, scenes
from tests.hard_cases.values import REFUSED, Values, error_of, stored_values

FRACTIONS = (0.0, 0.1, 0.5, 1.0)  # how far from one rotation to the other
REFUSAL = "refusal"  # the quantity of cases without an answer: 0 when refused, else ``inf``
DIGITS_50, RATIONAL = "mpmath, 50 digits", "exact rationals"
BY_CONSTRUCTION = "by construction"
# What a function may refuse with.
REFUSALS = (ArithmeticError, ValueError, RuntimeError, np.linalg.LinAlgError)
Inputs = dict[str, NDArray[np.float64]]
Answer = Callable[[Inputs], Any]


@dataclass(frozen=True)
class Family:
    """Cases that differ only in their inputs.

    Attributes:
        name: Subject of the cases.
        quantity: Quantity that is compared.
        unit: Unit of the errors; ``1`` for none.
        naive: Textbook formula, in words.
        ours: Name of the function that is judged.
        reference: Origin of the truth.
        bound: Largest error we promise.
        cases: By name, the answer of our function from the stored inputs.
        is_turn: Errors are angles between quaternions.
    """

    name: str
    quantity: str
    unit: str
    naive: str
    ours: str
    reference: str
    bound: float
    cases: dict[str, Answer]
    is_turn: bool = field(default=False, kw_only=True)


def examined(families: tuple[Family, ...]) -> Iterator[dict[str, object]]:
    """Yield a row for each case, by column; ``ok`` is 1 where our error keeps its bound."""
    for family in families:
        for name, answer in family.cases.items():
            stored = stored_values()[family.name, name]
            error = error_of_case(family, answer, stored)
            yield {
                "family": family.name,
                "case": name,
                "quantity": family.quantity,
                "unit": family.unit,
                "naive": family.naive,
                "ours": family.ours,
                "naive_error": stored.naive_error,
                "our_error": error,
                "bound": family.bound,
                "ok": int(error <= family.bound),
                "reference": family.reference,
            }


def error_of_case(family: Family, answer: Answer, stored: Values) -> float:
    """Measure how far an answer is from the stored truth; to raise an error is to refuse.

    Args:
        family: Family of the case, which says what kind of number is compared.
        answer: Function that is asked.
        stored: Inputs of the case, and its truth.

    Returns:
        The largest difference, in the unit of the family; see
        :func:`~tests.hard_cases.values.error_of`.
    """
    try:
        found = answer(stored.inputs)
    except REFUSALS:
        found = REFUSED
    return error_of(found, stored.truth, is_turn=family.is_turn)


def _angle_between_poses_rad(given: Inputs) -> float:
    first, second = (poses.pose_matrix(given[name], np.zeros(3)) for name in ("a", "b"))
    return float(poses.pose_error(first, second)[1])


def _angle_between_quats_rad(given: Inputs) -> float:
    return float(rotations.rotation_angle_rad(given["a"], given["b"]))


def _quats_of_matrices(given: Inputs) -> NDArray[np.float64]:
    return rotations.quat_wxyz_from_matrix(given["matrices"])


def _between(given: Inputs) -> NDArray[np.float64]:
    return rotations.slerp_quat_wxyz(given["a"], given["b"], FRACTIONS)


def _step_deg(given: Inputs) -> float:
    ends = np.zeros((2, 6))
    ends[:, 5] = given["ends_rad"]
    return float(np.degrees(path.step_of(ends[0], ends[1], 1)[5]))


def path_ends(distance_m: float) -> NDArray[np.float64]:
    """Return the ends (2, 6) of a path along x: position, metres, and roll, pitch, yaw, radians."""
    start = np.array([0.1, -2.3, 1.1, 0.0, 0.1, 0.2])
    return np.stack([start, start + distance_m * np.eye(6)[0]])


def frames_compared(distance_m: float, spacing_m: float) -> tuple[int, list[int]]:
    """Return the number of frames of such a path, and which ones are compared, counted from 1."""
    count = max(1, round(distance_m / spacing_m))
    return count, sorted({1, (count + 1) // 2, count})


def _frames_m(distance_m: float, spacing_m: float) -> NDArray[np.float64]:
    start, target = path_ends(distance_m)
    _, compared = frames_compared(distance_m, spacing_m)
    vectors = path.path_vectors(start, target, path.n_frames_of(start, target, spacing_m))
    return np.asarray(vectors[np.array(compared) - 1, 0])


def _motion_m(given: Inputs) -> NDArray[np.float64]:
    return np.asarray(poses.relative(given["a"], given["b"])[:3, 3])


def _alignment(given: Inputs) -> NDArray[np.float64]:
    scale, rotation, _ = poses.umeyama_sim3(given["source"], given["target"])
    return np.array([scale, *rotation.ravel()])


def _median(values: list[float], counts: list[int] | None = None) -> float:
    drawn = np.array([counts or [1] * len(values)])
    return float(bootstrap.medians(np.array(values), np.arange(len(values)), drawn)[0])


# Drawn by a resampling whose values are the ranks, 3 % of them infinite.
SOME_INFINITE = [*range(3880), *[math.inf] * 120]
DEPTH = ("depth", "depth", "m", "24-bit depth buffer, float32", "RaycastRenderer.render_rgbd")
CASTING = ("Möller-Trumbore in float32", "RayCaster.first_hit_m")
GRAPH = ("pose graphs", "position", "m", "Gauss-Newton")
EXACT_GRAPH = "poses the edges were made of"
NOISE = ("the published code", "add_noise")

# fmt: off
CASES = (
    Family("orientation error", "angle", "rad", "2 arccos of the dot product",
           "rotation_angle_rad", DIGITS_50, 1e-15, dict.fromkeys(
        ("quaternions, 1e-9", "quaternions, π − 1e-9", "quaternions, π", "q and −q"),
        _angle_between_quats_rad)),
    Family("orientation error", "angle", "rad", "arccos of the trace", "pose_error",
           DIGITS_50, 2e-15, dict.fromkeys(
        ("poses, 1e-9", "poses, π − 1e-9", "poses, π"), _angle_between_poses_rad)),
    Family("quaternion of a matrix", "turn", "rad", "w = √(1 + trace) / 2",
           "quat_wxyz_from_matrix", DIGITS_50, 1e-14, dict.fromkeys(
        ("five digits of text", "trace −1 (π)", "trace near −1 (π − 1e-9)", "nearly singular"),
        _quats_of_matrices), is_turn=True),
    Family("interpolation", "turn", "rad", "slerp with arccos", "slerp_quat_wxyz", DIGITS_50, 2e-15,
           dict.fromkeys(
        ("quaternions, 1e-12", "quaternions, π − 1e-9", "quaternions, π − 1e-9, other sign"),
        _between), is_turn=True),
    Family("roll, pitch, yaw", "turn", "deg", "difference of the angles", "step_of",
           DIGITS_50, 1e-12, dict.fromkeys(
        ("from 179° to −179°", "from 350° to 10°"), _step_deg)),
    Family("path", "position", "m", "v_j = v_(j−1) + j · step, as printed", "path_vectors",
           RATIONAL, 1e-12, {
        "n = 0: the target is the start": lambda _: _frames_m(0.0, 0.25),
        "n = 100": lambda _: _frames_m(25.0, 0.25),
        "n = 1,000,000": lambda _: _frames_m(1000.0, 0.001),
    }),
    Family("relative pose", "position", "m", "inverse(a) · b", "relative", RATIONAL, 1e-15, {
        "cameras 1e6 m from the origin": _motion_m,
    }),
    Family("alignment (Sim(3))", REFUSAL, "1", "Arun, no rank test", "umeyama_sim3",
           BY_CONSTRUCTION, 0.0, dict.fromkeys(
        ("collinear centres", "0.1 m of a line, 1e6 m away"), _alignment)),
    Family("alignment (Sim(3))", "scale and elements of R", "1", "Arun, E[xy] − E[x] E[y]",
           "umeyama_sim3", BY_CONSTRUCTION, 1e-12, dict.fromkeys(
        ("coplanar centres", "centres 1e6 m away"), _alignment)),
    Family("ray casting", "rays out of a closed surface", "share", *CASTING,
           "the surface is closed", 0.0, {
        "through corners": lambda _: scenes.leaking_share(scenes.ball(), at_corners=True),
        "through edges": lambda _: scenes.leaking_share(scenes.ball()),
        "slivers of 1 m by 1 µm": lambda _: scenes.leaking_share(scenes.sliver_wall()),
    }),
    Family("ray casting", "hit off its plane", "of the extent", *CASTING, BY_CONSTRUCTION, 1e-6, {
        "grazing, 1e-3 rad": lambda _: scenes.off_the_wall(0.0, 1e-3),
        "grazing, 1e-5 rad": lambda _: scenes.off_the_wall(0.0, 1e-5),
        "1e5 m from the origin": lambda _: scenes.off_the_wall(1e5, 1.0),
    }),
    Family(*DEPTH, RATIONAL, 8e-9, {
        "just behind near_m (0.05 m)": lambda _: scenes.depths_m(scenes.Plane(0.0500005, 0.0)),
        "slanted, 0.07 m": lambda _: scenes.depths_m(scenes.Plane(0.07, 0.4)),
    }),
    Family(*DEPTH, RATIONAL, 4e-6, {
        "slanted, 60 m": lambda _: scenes.depths_m(scenes.Plane(60.0, 0.4)),
        "just before far_m (100 m)": lambda _: scenes.depths_m(scenes.Plane(99.999, 0.0)),
    }),
    Family("injected noise", "median", "of the nominal", *NOISE, "nominal value", 0.01, {
        "position": lambda _: estimates.displacement_share(
            estimates.noisy_poses(estimates.NOISE_M, 0.0)),
        "orientation, 20°": lambda _: estimates.turn_share(
            estimates.noisy_poses(0.0, estimates.NOISE_DEG)),
    }),
    Family("injected noise", "Kolmogorov distance", "1", *NOISE, "uniform on the sphere",
           estimates.LARGEST_DISTANCE, {
        "axes of turns": lambda _: estimates.distance_from_uniform(
            estimates.noisy_poses(0.0, estimates.NOISE_DEG)),
    }),
    Family("medians", "median", "1", "quantile(0.5)", "medians", RATIONAL, 1e-16, {
        "an even number": lambda _: _median([0.3, 0.1, 0.7, 0.2]),
        "resampled, some left out": lambda _: _median([0.4, 0.1, 0.3], [3, 0, 2]),
        "half of them infinite": lambda _: _median([0.1, 0.2, math.inf, math.inf]),
        "near the largest double": lambda _: _median([1.7e308, 1.7e308]),
    }),
    Family("medians", "limits", "1", "quantile(0.025, 0.975)", "limits", "order statistics", 0.0, {
        "3 % of the resamples infinite":
            lambda _: np.array(bootstrap.limits(np.array([0.0, *SOME_INFINITE]))),
    }),
    Family(*GRAPH, "optimise_lm", EXACT_GRAPH, 1e-9, {
        "LM: a third 170° off":
            lambda _: estimates.spiral_error_m(estimates.by_lm(estimates.turned_spiral())),
        "LM: an edge twice": lambda _: estimates.by_lm(estimates.doubled_edge())[1, 0, 3],
    }),
    Family(*GRAPH, "optimise_toro", EXACT_GRAPH, 1e-6, {
        "TORO: a third 170° off":
            lambda _: estimates.spiral_error_m(estimates.by_toro(estimates.turned_spiral())),
    }),
    Family("pose graphs", "position", "m", "one edge per pair of nodes", "optimise_toro", RATIONAL,
           0.02, {  # it cools down
        "TORO: an edge twice": lambda _: estimates.by_toro(estimates.doubled_edge())[1, 0, 3],
    }),
    Family("pose graphs", REFUSAL, "1", "no test", "solve_graph", BY_CONSTRUCTION, 0.0, {
        "LM: two parts": lambda _: estimates.optimised("rgbd-g2o", estimates.two_parts()),
        "TORO: two parts": lambda _: estimates.optimised("rgbd-toro", estimates.two_parts()),
    }),
    Family("shares", "limits", "1", "p ± 1.96 √(p (1 − p) / n)", "share_limits",
           "bisection, " + DIGITS_50, 1e-12, {
        "0 of 20": lambda _: np.array(limits.share_limits(0, 20)),
        "1 of 100": lambda _: np.array(limits.share_limits(1, 100)),
    }),
    Family("shares", "p of the sign test", "1", "normal approximation", "sign_test", RATIONAL,
           1e-14, {
        "all of 5 fell": lambda _: limits.sign_test([-1.0] * 5)[2],
    }),
)
# fmt: on
