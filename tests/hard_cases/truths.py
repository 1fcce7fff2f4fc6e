"""Compute the stored reference values of hard cases: ``python -m tests.hard_cases.truths``.

Truths are computed with 50 digits by mpmath, or in rational numbers, for the very doubles that the
functions get: a double is a rational number, so nothing is lost in taking it over. Beside them
stands the error of the formula that somebody would write first. Quaternions are ``wxyz``.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from math import comb

import gtsam
import numpy as np
from mpmath import MPContext
from scipy.spatial.transform import Rotation
from scipy.stats import norm

from baselines.labels.posegraph.graph import PoseGraph
from baselines.labels.posegraph.levenberg_marquardt import factors_of
from synfeal.geometry import poses
from synfeal.records.files import write_json
from tests.hard_cases import cases, estimates, scenes
from tests.hard_cases.values import FILE, REFUSED, error_of

MP = MPContext()  # a context of its own: nobody else's precision is touched
MP.dps = 50
DIGITS = 30
AXIS = (2.0, -3.0, 6.0)
PI = MP.pi
NEARLY_PI = PI - MP.mpf("1e-9")
FAR_M = np.array([1e6, -7e5, 3e5])
OFFSET_M = np.array([5.0, -1.0, 2.0])
PERMUTATION = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
BUFFER_STEPS = np.float32(2**24 - 1)
PARALLEL = 1e-6  # the textbook's threshold on a determinant
BREAKDOWNS = (ArithmeticError, ValueError, RuntimeError, IndexError, np.linalg.LinAlgError)


def computed():
    """All values, by family and case, as :mod:`tests.hard_cases.values` describes them."""
    found = {}
    for key, case in reference_cases().items():
        family = next(f for f in cases.CASES if f.name == key[0] and key[1] in f.cases)
        inputs, truth, naive = case
        record = {"truth": text_of(truth), "naive_error": naive_error(family, naive, truth)}
        if inputs:
            record["inputs"] = {name: np.asarray(v).tolist() for name, v in inputs.items()}
        found.setdefault(key[0], {})[key[1]] = record
    return found


def naive_error(family, naive: Callable, truth):
    """Error of the textbook formula at six digits; None where it gave no answer or no number."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            answer = naive()
        except BREAKDOWNS:
            answer = REFUSED
    error = error_of(answer, text_of(truth), is_turn=family.is_turn)
    return float(f"{error:.6g}") if math.isfinite(error) else None


def text_of(truth):
    """Quotients as they are, other numbers as decimals of 30 digits, in nested lists."""
    if isinstance(truth, str):
        return truth
    if isinstance(truth, MP.matrix):
        return text_of(truth.tolist())
    if isinstance(truth, (list, tuple, np.ndarray)):
        return [text_of(value) for value in truth]
    if isinstance(truth, float) and math.isinf(truth):
        return "inf"
    if isinstance(truth, (float, Fraction)):
        return str(Fraction(truth))
    return MP.nstr(mpf(truth), DIGITS, strip_zeros=True)


def reference_cases():
    """By family and case: inputs by name, the truth, and the textbook formula's answer."""
    found = {}
    base = quat_of(0.7, (1.0, 5.0, -2.0))  # a rotation along no axis

    def turned(angle):
        return quat_product(quat_of(angle, AXIS), base)

    for name, angle, sign in (
        ("quaternions, 1e-9", 1e-9, 1.0),
        ("quaternions, π − 1e-9", NEARLY_PI, 1.0),
        ("quaternions, π", PI, 1.0),
        ("q and −q", 0, -1.0),
    ):
        a, b = rounded(base), sign * rounded(turned(angle))
        truth = angle_of_quat(quat_product(inverse(exact(a)), exact(b)))
        found["orientation error", name] = (
            {"a": a, "b": b}, truth, lambda a=a, b=b: 2.0 * np.arccos(np.dot(a, b))
        )  # fmt: skip
    for name, angle in (
        ("poses, 1e-9", 1e-9), ("poses, π − 1e-9", NEARLY_PI), ("poses, π", PI)
    ):  # fmt: skip
        a, b = rounded(matrix_of(base)), rounded(matrix_of(turned(angle)))
        truth = angle_of_matrix(nearest_rotation(exact(a)).T * nearest_rotation(exact(b)))
        found["orientation error", name] = (
            {"a": a, "b": b}, truth, lambda a=a, b=b: np.arccos((np.trace(a.T @ b) - 1.0) / 2.0)
        )  # fmt: skip
    text = np.round(Rotation.random(12, rng=np.random.default_rng(0)).as_matrix(), 5)
    singular = rounded(matrix_of(quat_of(2, AXIS))) * np.array([1.0, 1.0, 1e-6])
    for name, matrices in (
        ("five digits of text", text),
        ("trace −1 (π)", rounded(matrix_of(quat_of(PI, AXIS)))[None]),
        ("trace near −1 (π − 1e-9)", rounded(matrix_of(quat_of(NEARLY_PI, AXIS)))[None]),
        ("nearly singular", singular[None]),
    ):
        truth = [quat_of_rotation(nearest_rotation(exact(matrix))) for matrix in matrices]
        found["quaternion of a matrix", name] = (
            {"matrices": matrices}, truth, lambda m=matrices: np.array([*map(textbook_quat, m)])
        )  # fmt: skip
    for name, angle, sign in (
        ("quaternions, 1e-12", 1e-12, 1.0),
        ("quaternions, π − 1e-9", NEARLY_PI, 1.0),
        ("quaternions, π − 1e-9, other sign", NEARLY_PI, -1.0),
    ):
        a, b = rounded(base), sign * rounded(turned(angle))
        first = exact(a)
        step = quat_product(exact(b), inverse(first))
        truth = [unit(quat_product(quat_to_power(step, t), first)) for t in cases.FRACTIONS]
        found["interpolation", name] = (
            {"a": a, "b": b},
            truth,
            lambda a=a, b=b: textbook_slerp(a, b),
        )
    for name, ends_deg in (("from 179° to −179°", (179, -179)), ("from 350° to 10°", (350, 10))):
        ends = np.radians(ends_deg)
        turn = mpf(ends[1]) - mpf(ends[0])
        truth = (turn - 2 * PI * MP.nint(turn / (2 * PI))) * 180 / PI
        found["roll, pitch, yaw", name] = (
            {"ends_rad": ends}, truth, lambda ends=ends: np.degrees(ends[1] - ends[0])
        )  # fmt: skip
    found |= positions() | alignments() | rays_and_depths() | noise() | pose_graphs() | statistics()
    return found


def positions():
    """Frames of a path, and a motion far from the origin."""
    found = {}
    for name, distance_m, spacing_m in (
        ("n = 0: the target is the start", 0.0, 0.25),
        ("n = 100", 25.0, 0.25),
        ("n = 1,000,000", 1000.0, 0.001),
    ):
        count, compared = cases.frames_compared(distance_m, spacing_m)
        ends = cases.path_ends(distance_m)
        x, end = map(Fraction, ends[:, 0].tolist())

        def printed(ends=ends, spacing_m=spacing_m, compared=compared):
            """``v_j = v_(j-1) + j * step``, as the paper prints it."""
            count = round(float(np.linalg.norm(ends[1, :3] - ends[0, :3])) / spacing_m)
            step = (ends[1] - ends[0]) / count if count else np.full(6, np.nan)
            vectors = ends[0] + np.cumsum(np.arange(1, max(count, 1) + 1))[:, None] * step
            return vectors[np.array(compared) - 1, 0]

        found["path", name] = {}, [x + Fraction(j, count) * (end - x) for j in compared], printed
    quats = [rounded(quat_of(angle, (1, 2, 3))) for angle in (0.4, 1.1)]
    a = poses.pose_from_quat(FAR_M + np.array([0.1, 0.2, 0.3]), quats[0])
    b = poses.pose_from_quat(FAR_M + np.array([0.35, 0.1, 0.7]), quats[1])
    motion = exact(a[:3, :3]).T * (exact(b[:3, 3:]) - exact(a[:3, 3:]))
    found["relative pose", "cameras 1e6 m from the origin"] = (
        {"a": a, "b": b}, [row[0] for row in motion.tolist()], lambda: (np.linalg.inv(a) @ b)[:3, 3]
    )  # fmt: skip
    return found


def alignments():
    """Camera centres of dyadic coordinates and their exact images: nothing is rounded."""
    line = np.linspace(0.0, 1.0, 20)[:, None] * [0.3, -0.5, 0.81]
    truth = [Fraction(1, 2), *map(Fraction, PERMUTATION.ravel())]
    found = {}
    for name, source, answer in (
        ("collinear centres", 2.0 * line, REFUSED),
        ("0.1 m of a line, 1e6 m away", FAR_M + 0.1 * line, REFUSED),
        ("coplanar centres", dyadic_cloud(0.0), truth),
        ("centres 1e6 m away", FAR_M + dyadic_cloud(1.0), truth),
    ):
        target = source @ PERMUTATION.T / 2 + OFFSET_M
        found["alignment (Sim(3))", name] = (
            {"source": source, "target": target}, answer,
            lambda source=source, target=target: uncentred(source, target),
        )  # fmt: skip
    return found


def dyadic_cloud(thickness):
    spread = np.array([1.0, 1.0, thickness])
    return np.round(64 * np.random.default_rng(1).normal(size=(20, 3)) * spread) / 64


def uncentred(source, target):
    """Covariances as means of products less products of means, no look at rank or reflection."""
    mean_a, mean_b = source.mean(axis=0), target.mean(axis=0)
    covariance = target.T @ source / len(source) - np.outer(mean_b, mean_a)
    u, singular, vt = np.linalg.svd(covariance)
    spread = (source**2).sum(axis=1).mean() - mean_a @ mean_a
    return np.array([singular.sum() / spread, *(u @ vt).ravel()])


def rays_and_depths():
    """No ray leaves a closed surface, hits lie on their plane, depths are those of a plane."""
    ball, slivers = scenes.ball(), scenes.sliver_wall()
    textbook = {"caster": moller_trumbore}
    found = {
        ("ray casting", name): ({}, 0, naive)
        for name, naive in {
            "through corners": lambda: scenes.leaking_share(ball, at_corners=True, **textbook),
            "through edges": lambda: scenes.leaking_share(ball, **textbook),
            "slivers of 1 m by 1 µm": lambda: scenes.leaking_share(slivers, **textbook),
            "grazing, 1e-3 rad": lambda: scenes.off_the_wall(0.0, 1e-3, **textbook),
            "grazing, 1e-5 rad": lambda: scenes.off_the_wall(0.0, 1e-5, **textbook),
            "1e5 m from the origin": lambda: scenes.off_the_wall(1e5, 1.0, **textbook),
        }.items()
    }
    for name, plane in {
        "just behind near_m (0.05 m)": scenes.Plane(0.0500005, 0.0),
        "slanted, 0.07 m": scenes.Plane(0.07, 0.4),
        "slanted, 60 m": scenes.Plane(60.0, 0.4),
        "just before far_m (100 m)": scenes.Plane(99.999, 0.0),
    }.items():
        truth = plane_depths(plane)
        exact_m = np.array([float(depth) for depth in truth])
        found["depth", name] = {}, truth, lambda exact_m=exact_m: buffered(exact_m)
    return found


def moller_trumbore(vertices, faces, origins, directions):
    """The textbook test, in float32 as on a graphics card: distances (N,), ``inf`` for none."""
    unit_ = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    corners, start, way = (x.astype(np.float32) for x in (vertices[faces], origins, unit_))
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    nearest = np.full(len(origins), np.inf, np.float32)
    for corner, a, b in zip(corners[:, 0], first, second, strict=True):
        across, offset = np.cross(way, b), start - corner
        determinant = across @ a
        beside = np.cross(offset, a)
        u = (offset * across).sum(axis=1) / determinant
        v = (way * beside).sum(axis=1) / determinant
        distance = beside @ b / determinant
        met = (np.abs(determinant) > PARALLEL) & (u >= 0) & (v >= 0) & (u + v <= 1)
        nearest = np.where(met & (distance > 0), np.minimum(nearest, distance), nearest)
    return nearest.astype(np.float64)


def plane_depths(plane):
    """Where the rays of a row of pixels meet the plane ``z = a + b x`` of its corners."""
    fx, _, cx, _ = map(Fraction, scenes.CAMERA.intrinsics)
    ends = plane.corners()[:2]
    (x0, _, z0), (x1, _, z1) = ([Fraction(value) for value in end] for end in ends.tolist())
    b = (z1 - z0) / (x1 - x0)
    width = scenes.CAMERA.width
    return [(z0 - b * x0) / (1 - b * (u + Fraction(1, 2) - cx) / fx) for u in range(width)]


def buffered(depth_m):
    """Depths that went through a buffer of 24 bits, made metres again in float32."""
    near, far = np.float32(scenes.CAMERA.near_m), np.float32(scenes.CAMERA.far_m)
    device = (far + near) / (far - near) - 2 * far * near / (far - near) / np.float32(depth_m)
    kept = np.round((device + 1) / 2 * BUFFER_STEPS) / BUFFER_STEPS
    return 2 * far * near / (far + near - (2 * kept - 1) * (far - near))


def noise():
    """The published code moves by sqrt(3) times the nominal value, and turns about four axes."""
    clean, n = estimates.clean_poses(), estimates.N_POSES
    step = np.random.default_rng(1).normal(size=(n, 3))
    step *= np.sqrt(3.0) / np.linalg.norm(step, axis=1, keepdims=True)
    signs = np.random.default_rng(2).choice([-1.0, 1.0], (n, 3))
    angles = estimates.NOISE_DEG / np.sqrt(3.0) * signs
    turn = Rotation.from_euler("xyz", angles, degrees=True)
    quat = turn * Rotation.from_quat(clean.quat_wxyz, scalar_first=True)
    turned = replace(clean, quat_wxyz=quat.as_quat(canonical=True, scalar_first=True))
    moved = replace(clean, position_m=clean.position_m + estimates.NOISE_M * step)
    return {
        ("injected noise", "position"): ({}, 1, lambda: estimates.displacement_share(moved)),
        ("injected noise", "orientation, 20°"): ({}, 1, lambda: estimates.turn_share(turned)),
        ("injected noise", "axes of turns"): (
            {}, 0, lambda: estimates.distance_from_uniform(turned)
        ),
    }  # fmt: skip


def pose_graphs():
    """The spiral's truth is where its exact motions lead; an edge measured thrice has a mean."""
    turned, doubled, parts = (
        estimates.turned_spiral(), estimates.doubled_edge(), estimates.two_parts()
    )  # fmt: skip
    last = PoseGraph(doubled.first_from_cam, tuple({(e.i, e.j): e for e in doubled.edges}.values()))
    found = {}
    for name, method in (("LM", estimates.by_lm), ("TORO", estimates.by_toro)):
        found["pose graphs", f"{name}: a third 170° off"] = (
            {}, 0, lambda: estimates.spiral_error_m(gauss_newton(turned))
        )  # fmt: skip
        found["pose graphs", f"{name}: an edge twice"] = (
            {}, Fraction(4, 3), lambda method=method: method(last)[1, 0, 3]
        )  # fmt: skip
        found["pose graphs", f"{name}: two parts"] = {}, REFUSED, lambda: parts.first_from_cam
    return found


def gauss_newton(graph):
    """Poses (N, 4, 4) by Gauss-Newton: every step taken as it comes."""
    optimizer = gtsam.GaussNewtonOptimizer(*factors_of(graph), gtsam.GaussNewtonParams())
    result = optimizer.optimize()
    return np.array([result.atPose3(node).matrix() for node in range(len(graph))])


def statistics():
    """Medians and limits by rank, shares by bisection, signs by counting."""
    found = {}
    for name, values, counts in (
        ("an even number", [0.3, 0.1, 0.7, 0.2], None),
        ("resampled, some left out", [0.4, 0.1, 0.3], [3, 0, 2]),
        ("half of them infinite", [0.1, 0.2, math.inf, math.inf], None),
        ("near the largest double", [1.7e308, 1.7e308], None),
    ):
        taken = np.repeat(values, counts or [1] * len(values))
        ranked = sorted(taken.tolist())
        low, high = ranked[(len(ranked) - 1) // 2], ranked[len(ranked) // 2]
        truth = high if math.isinf(high) else (Fraction(low) + Fraction(high)) / 2
        found["medians", name] = {}, truth, lambda taken=taken: np.quantile(taken, 0.5)
    drawn = sorted(cases.SOME_INFINITE)
    beyond = len(drawn) * 25 // 1000
    found["medians", "3 % of the resamples infinite"] = (
        {}, [drawn[beyond], drawn[-1 - beyond]], lambda: np.quantile(drawn, [0.025, 0.975])
    )  # fmt: skip
    for count, total in ((0, 20), (1, 100)):
        truth = [lower_limit(count, total), 1 - lower_limit(total - count, total)]
        found["shares", f"{count} of {total}"] = {}, truth, lambda c=count, t=total: wald(c, t)
    found["shares", "all of 5 fell"] = (
        {}, Fraction(2, 2**5), lambda: 2.0 * norm.sf(5 / math.sqrt(5))
    )  # fmt: skip
    return found


def wald(count, total):
    """Limits of a normal distribution."""
    observed = count / total
    half = float(norm.ppf(0.975)) * math.sqrt(observed * (1.0 - observed) / total)
    return np.array([observed - half, observed + half])


def lower_limit(count, total):
    """The share at which ``count`` or more of ``total`` have a chance of 2.5 %, by bisection."""
    low, high = mpf(0.0), mpf(1.0)
    for _ in range(170):  # 2^-170 < 1e-50
        middle = (low + high) / 2
        fewer = sum(comb(total, k) * middle**k * (1 - middle) ** (total - k) for k in range(count))
        low, high = (middle, high) if 1 - fewer < mpf(Fraction(1, 40)) else (low, middle)
    return low if count else mpf(0.0)


def textbook_quat(matrix):
    w = np.sqrt(1.0 + np.trace(matrix)) / 2.0
    skew = matrix - matrix.T
    quat = np.array([w, *(np.array([skew[2, 1], skew[0, 2], skew[1, 0]]) / (4.0 * w))])
    return quat / np.linalg.norm(quat)


def textbook_slerp(a, b):
    angle = np.arccos(np.dot(a, b))
    weights = [(np.sin((1.0 - t) * angle), np.sin(t * angle)) for t in cases.FRACTIONS]
    return np.array([(u * a + v * b) / np.sin(angle) for u, v in weights])


def mpf(value):
    """A number with 50 digits; doubles and integers as they are, quotients rounded."""
    if isinstance(value, Fraction):
        return MP.mpf(value.numerator) / value.denominator
    return value if isinstance(value, MP.mpf) else MP.mpf(float(value))


def exact(values):
    """An array (N,) of doubles as a list, or (N, M) as a matrix, of numbers with 50 digits."""
    array = np.asarray(values)
    numbers = [[mpf(v) for v in row] for row in np.atleast_2d(array)]
    return MP.matrix(numbers) if array.ndim == 2 else numbers[0]


def rounded(values):
    """The nearest doubles, as an array in the shape of a matrix or of nested lists."""
    nested = values.tolist() if isinstance(values, MP.matrix) else values
    return np.array(nested, dtype=object).astype(np.float64)


def quat_of(angle, axis):
    """Unit quaternion of a turn about an axis of any length."""
    length = MP.sqrt(sum(mpf(v) ** 2 for v in axis)) or mpf(1)
    sine, cosine = MP.sin(mpf(angle) / 2), MP.cos(mpf(angle) / 2)
    return [cosine, *(sine * mpf(v) / length for v in axis)]


def quat_product(a, b):
    """Hamilton product of two quaternions."""
    w, x, y, z = a
    rows = ((w, -x, -y, -z), (x, w, -z, y), (y, z, w, -x), (z, -y, x, w))
    return [sum(p * q for p, q in zip(row, b, strict=True)) for row in rows]


def inverse(quat):
    """The inverse turn, of the same length."""
    return [quat[0], *(-value for value in quat[1:])]


def unit(quat):
    """The same turn, of length 1."""
    length = MP.sqrt(sum(v**2 for v in quat))
    return [value / length for value in quat]


def angle_of_quat(quat):
    """Angle in [0, pi] of the turn of a quaternion of any length but 0."""
    return 2 * MP.atan2(MP.sqrt(sum(v**2 for v in quat[1:])), abs(quat[0]))


def quat_to_power(quat, power):
    """The turn of a quaternion, the short way round, ``power`` times."""
    sign = -1 if quat[0] < 0 else 1
    return quat_of(mpf(power) * angle_of_quat(quat), [sign * v for v in quat[1:]])


def matrix_of(quat):
    """Rotation matrix of a quaternion of any length but 0."""
    w, x, y, z = unit(quat)
    return MP.matrix(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def angle_of_matrix(r):
    """Angle in [0, pi] of a rotation matrix."""
    doubled_sine = [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]
    return MP.atan2(MP.norm(doubled_sine), r[0, 0] + r[1, 1] + r[2, 2] - 1)


def nearest_rotation(matrix):
    """The rotation nearest to a matrix of positive determinant, by its singular values."""
    u, _, vt = MP.svd_r(matrix)
    return u * vt


def quat_of_rotation(r):
    """Unit quaternion of a rotation matrix, from the largest of four candidates."""
    traces = [
        1 + r[0, 0] + r[1, 1] + r[2, 2],
        1 + r[0, 0] - r[1, 1] - r[2, 2],
        1 - r[0, 0] + r[1, 1] - r[2, 2],
        1 - r[0, 0] - r[1, 1] + r[2, 2],
    ]
    x, y, z = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    xy, xz, yz = r[0, 1] + r[1, 0], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1]
    rows = ([0, x, y, z], [x, 0, xy, xz], [y, xy, 0, yz], [z, xz, yz, 0])
    largest = max(range(4), key=lambda place: traces[place])
    row = list(rows[largest])
    row[largest] = traces[largest]
    return unit(row)


if __name__ == "__main__":
    write_json(FILE, computed())
