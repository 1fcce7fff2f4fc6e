"""``hard_cases.csv``: all cases with the errors and times of both formulas; a new one is a line."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pandas as pd

from reproduction.hard_cases import estimates, rotations, scenes
from reproduction.hard_cases.exact import MPMATH, RATIONAL, REFUSAL, Family, examine
from reproduction.tables.columns import Column, SideTable
from synfeal.records.tables import COUNT, LIMITLESS, NUMBER, TEXT, frame_of, write_frame

NAME = "hard_cases"
SCHEMA = {
    **dict.fromkeys(("family", "case", "quantity", "unit", "naive", "ours"), TEXT),
    **{"naive_error": LIMITLESS, "our_error": LIMITLESS, "bound": NUMBER},
    **{"ok": COUNT, "reference": TEXT, "naive_seconds": NUMBER, "our_seconds": NUMBER},
}
PI, NEARLY_PI, INF = rotations.PI, rotations.NEARLY_PI, np.inf
GRAPH = ("pose graphs", "position", "m", "Gauss-Newton")
BY_CONSTRUCTION, EXACT_GRAPH = "by construction", "poses the edges were made of"

# fmt: off
CASES = (
    Family("orientation error", "angle", "rad", "2 arccos of the dot product",
           "rotation_angle_rad", MPMATH, 1e-15, {
        "quaternions, 1e-9": lambda: rotations.angle_of_quats(1e-9),
        "quaternions, π − 1e-9": lambda: rotations.angle_of_quats(NEARLY_PI),
        "quaternions, π": lambda: rotations.angle_of_quats(PI),
        "q and −q": lambda: rotations.angle_of_quats(0, -1.0),
    }),
    Family("orientation error", "angle", "rad", "arccos of the trace", "pose_error",
           MPMATH, 2e-15, {
        "poses, 1e-9": lambda: rotations.angle_of_poses(1e-9),
        "poses, π − 1e-9": lambda: rotations.angle_of_poses(NEARLY_PI),
        "poses, π": lambda: rotations.angle_of_poses(PI),
    }),
    Family("quaternion of a matrix", "turn", "rad", "w = √(1 + trace) / 2",
           "quat_wxyz_from_matrix", MPMATH, 1e-14, {
        "five digits of text": lambda: rotations.quat_of_matrices(rotations.read_back()),
        "trace −1 (π)": lambda: rotations.quat_of_matrices(rotations.matrix_turned_by(PI)),
        "trace near −1 (π − 1e-9)": lambda: rotations.quat_of_matrices(
            rotations.matrix_turned_by(NEARLY_PI)),
        "nearly singular": lambda: rotations.quat_of_matrices(
            rotations.matrix_turned_by(2) * np.array([1.0, 1.0, 1e-6])),
    }),
    Family("interpolation", "turn", "rad", "slerp with arccos", "slerp_quat_wxyz", MPMATH, 2e-15, {
        "quaternions, 1e-12": lambda: rotations.arc(1e-12),
        "quaternions, π − 1e-9": lambda: rotations.arc(NEARLY_PI),
        "quaternions, π − 1e-9, other sign": lambda: rotations.arc(NEARLY_PI, -1.0),
    }),
    Family("roll, pitch, yaw", "turn", "deg", "difference of the angles", "step_of",
           MPMATH, 1e-12, {
        "from 179° to −179°": lambda: rotations.across_half_turn(179.0, -179.0),
        "from 350° to 10°": lambda: rotations.across_half_turn(350.0, 10.0),
    }),
    Family("path", "position", "m", "v_j = v_(j−1) + j · step, as printed", "path_vectors",
           RATIONAL, 1e-12, {
        "n = 0: the target is the start": lambda: rotations.frames(0.0, 0.25),
        "n = 100": lambda: rotations.frames(25.0, 0.25),
        "n = 1,000,000": lambda: rotations.frames(1000.0, 0.001),
    }),
    Family("relative pose", "position", "m", "inverse(a) · b", "relative", MPMATH, 1e-15, {
        "cameras 1e6 m from the origin": rotations.motion_far_away,
    }),
    Family("alignment (Sim(3))", REFUSAL, "1", "Arun, no rank test", "umeyama_sim3",
           BY_CONSTRUCTION, 0.0, {
        "collinear centres": lambda: rotations.undetermined(np.zeros(3), 2.0),
        "0.1 m of a line, 1e6 m away": lambda: rotations.undetermined(rotations.FAR_M, 0.1),
    }),
    Family("alignment (Sim(3))", "scale and elements of R", "1", "Arun, E[xy] − E[x] E[y]",
           "umeyama_sim3", RATIONAL, 1e-12, {
        "coplanar centres": lambda: rotations.aligned(np.zeros(3), 0.0),
        "centres 1e6 m away": lambda: rotations.aligned(rotations.FAR_M, 1.0),
    }),
    Family("ray casting", "rays out of a closed surface", "share", "Möller-Trumbore in float32",
           "RayCaster.first_hit_m", "the surface is closed", 0.0, {
        "through corners": lambda: scenes.leaks(scenes.ball(), at_corners=True),
        "through edges": lambda: scenes.leaks(scenes.ball()),
        "slivers of 1 m by 1 µm": lambda: scenes.leaks(scenes.sliver_wall()),
    }),
    Family("ray casting", "hit off its plane", "of the extent", "Möller-Trumbore in float32",
           "RayCaster.first_hit_m", RATIONAL, 1e-6, {
        "grazing, 1e-3 rad": lambda: scenes.wall(0.0, 1e-3),
        "grazing, 1e-5 rad": lambda: scenes.wall(0.0, 1e-5),
        "1e5 m from the origin": lambda: scenes.wall(1e5, 1.0),
    }),
    Family("depth", "depth", "m", "24-bit depth buffer, float32", "RaycastRenderer.render_rgbd",
           RATIONAL, 8e-9, {
        "just behind near_m (0.05 m)": lambda: scenes.depth_of_plane(0.0500005, 0.0),
        "slanted, 0.07 m": lambda: scenes.depth_of_plane(0.07, 0.4),
    }),
    Family("depth", "depth", "m", "24-bit depth buffer, float32", "RaycastRenderer.render_rgbd",
           RATIONAL, 4e-6, {
        "slanted, 60 m": lambda: scenes.depth_of_plane(60.0, 0.4),
        "just before far_m (100 m)": lambda: scenes.depth_of_plane(99.999, 0.0),
    }),
    Family("injected noise", "median", "of the nominal", "the published code", "add_noise",
           "nominal value", 0.01, {
        "position": estimates.median_displacement,
        "orientation, 20°": lambda: estimates.median_turn(20.0),
    }),
    Family("injected noise", "Kolmogorov distance", "1", "the published code",
           "add_noise", "uniform on the sphere", estimates.LARGEST_DISTANCE, {
        "axes of turns": estimates.directions_of_axes,
    }),
    Family("medians", "median", "1", "quantile(0.5)", "medians", RATIONAL, 1e-16, {
        "an even number": lambda: estimates.median_of([0.3, 0.1, 0.7, 0.2]),
        "resampled, some left out": lambda: estimates.median_of([0.4, 0.1, 0.3], [3, 0, 2]),
        "half of them infinite": lambda: estimates.median_of([0.1, 0.2, INF, INF]),
        "near the largest double": lambda: estimates.median_of([1.7e308, 1.7e308]),
    }),
    Family("medians", "limits", "1", "quantile(0.025, 0.975)", "limits", "order statistics", 0.0, {
        "3 % of the resamples infinite": lambda: estimates.limits_of([*range(3880), *[INF] * 120]),
    }),
    Family(*GRAPH, "optimise_lm", EXACT_GRAPH, 1e-9, {
        "LM: a third 170° off": lambda: estimates.turned("lm"),
        "LM: an edge twice": lambda: estimates.edge_twice("lm"),
    }),
    Family(*GRAPH, "optimise_toro", EXACT_GRAPH, 1e-6, {
        "TORO: a third 170° off": lambda: estimates.turned("toro"),
    }),
    Family("pose graphs", "position", "m", "one edge per pair of nodes", "optimise_toro", RATIONAL,
           0.02, {"TORO: an edge twice": lambda: estimates.edge_twice("toro")}),  # it cools down
    Family("pose graphs", REFUSAL, "1", "no test", "solve_graph", BY_CONSTRUCTION, 0.0, {
        "LM: two parts": lambda: estimates.in_two_parts("g2o"),
        "TORO: two parts": lambda: estimates.in_two_parts("toro"),
    }),
    Family("shares", "limits", "1", "p ± 1.96 √(p (1 − p) / n)", "share_limits",
           "bisection, " + MPMATH, 1e-12, {
        "0 of 20": lambda: estimates.share(0, 20),
        "1 of 100": lambda: estimates.share(1, 100),
    }),
    Family("shares", "p of the sign test", "1", "normal approximation", "sign_test", RATIONAL,
           1e-14, {
        "all of 5 fell": lambda: estimates.signs(5, 0),
    }),
)
# fmt: on


def write_hard_cases(out_csv: Path) -> None:
    """Examine all cases and write one row for each; only the times differ between runs."""
    write_frame(out_csv, frame_of(rows_of(CASES), SCHEMA))


def rows_of(families: Iterable[Family]) -> list[dict[str, object]]:
    """Rows by column; ``ok`` is 1 where our error is within the bound. Errors may be ``inf``."""
    return [row_of(family, name) for family in families for name in family.cases]


def row_of(family: Family, name: str) -> dict[str, object]:
    """The row of one case."""
    outcome = examine(family.cases[name]())
    ok = int(outcome["our_error"] <= family.bound)
    return {"family": family.name, "case": name, "ok": ok, **family._asdict(), **outcome}


COLUMNS = (
    Column("What", "family"),
    Column("Case", "case", small="judged"),
    Column("First thought", "naive_error", text="naive_text", small="naive", bad="naive_bad"),
    Column("Ours", "our_error", text="our_text", small="ours", bad="our_bad"),
    Column("Bound", "bound", text="bound_text"),
    Column("Truth", "reference", on_paper=False),
    Column("First, µs a call", "naive_seconds", text="naive_time", on_paper=False),
    Column("Ours, µs a call", "our_seconds", text="our_time", on_paper=False),
)
CAPTION = (
    "Errors against exact answers: of the formula somebody would write first, and of the function"
    " this project uses. ✗ marks errors above the bound that ours promises."
)
REMARK = "None: no answer, or no number; cases without one right answer are to be refused."


def side_table(table: pd.DataFrame) -> SideTable:
    """Every case with both errors, the formulas that made them, the bound and the times."""
    unit = ", " + table.unit
    rows = table.assign(
        judged=table.quantity + unit.where(table.unit != "1", ""),
        bound_text=table.bound.map(short),
        style=(table.family != table.family.shift()).map({True: "first", False: ""}),
    )
    for which in ("naive", "our"):
        error, seconds = table[f"{which}_error"], table[f"{which}_seconds"]
        refusal = error.map(lambda e: "answered" if e else "refused")
        rows[f"{which}_error"] = error.clip(upper=sys.float_info.max)  # to sort by
        rows[f"{which}_text"] = error.map(short).where(table.quantity != REFUSAL, refusal)
        rows[f"{which}_bad"] = error > table.bound
        rows[f"{which}_time"] = [f"{1e6 * s:,.0f}" if s >= 1e-6 else "< 1" for s in seconds]
    return SideTable(NAME, CAPTION, COLUMNS, rows, REMARK, block="family")


def short(error: float) -> str:
    """An error at two digits; ``none`` where there is no finite one."""
    if math.isinf(error):
        return "none"
    if error == 0 or 1e-3 <= error < 1e4:
        return f"{error:.2g}" if error < 100 else f"{error:,.0f}"
    mantissa, exponent = f"{error:.1e}".split("e")
    return f"{mantissa}e{int(exponent)}".replace("-", "\u2212")
