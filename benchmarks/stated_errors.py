"""Errors of photographs that a place was not built from, beside those that their poses state.

    python -m benchmarks.stated_errors results/benchmarks/stated_errors.csv \
        --place corridor --capture corridor-capture/All_Data --poses poses.csv

adds a row for each photograph that ``synfeal localize`` wrote into ``poses.csv``, in place of those
that the table has of the place, and prints what all of them come to. The capture holds these
photographs and their poses; the place was built from others.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from baselines.references.map_localizer import FOUND
from synfeal.dataset.pose_table import IMAGE, STATED
from synfeal.dataset.poses_in import read_pose_list
from synfeal.evaluation.captured import captured_frames
from synfeal.evaluation.coverage import coverage
from synfeal.geometry.poses import pose_error, pose_from_quat
from synfeal.records.tables import write_frame

POSITION, ORIENTATION = "position_error_m", "orientation_error_deg"
POSE = ["tx", "ty", "tz", "qw", "qx", "qy", "qz"]
CLOSE_M, CLOSE_DEG = 0.05, 5.0
# A pose that is farther off is of another place that looks alike.
WRONG_M = 0.5
HEADER = (
    "| place | photographs | localized | error (median) | within 5 cm, 5°"
    " | off by more than 50 cm | of these with a stated error |"
)
COVERAGE_HEADER = "| | 50 % | 68 % | 80 % | 90 % | 95 % | 99 % | 95 % radius (median) |"


def main() -> None:
    """Add the photographs of a place to the table, and print what all of them come to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("--place", help="name of the place in the table")
    parser.add_argument("--capture", type=Path, help="capture that holds the photographs")
    parser.add_argument("--poses", type=Path, help="what `synfeal localize` wrote of them")
    given = parser.parse_args()
    table = pd.read_csv(given.table) if given.table.exists() else pd.DataFrame({"place": []})
    if given.poses is not None:
        own = measured(given.place, given.capture, given.poses)
        table = pd.concat([table[table["place"] != given.place], own], ignore_index=True)
        write_frame(given.table, table)
    print(summary(table))


def measured(place: str, capture: Path, poses: Path) -> pd.DataFrame:
    """Compare poses with those of the capture; photographs that it has no pose of are left out.

    Args:
        place: Name of the place.
        capture: The capture.
        poses: File that ``synfeal localize`` wrote.
    """
    frames = captured_frames(capture, read_pose_list(poses), poses)
    found = pd.read_csv(poses).set_index(IMAGE).loc[list(frames.names)]
    localized = (found["status"] == FOUND).to_numpy()
    values = found.loc[localized, POSE].to_numpy()
    answers = pose_from_quat(values[:, :3], values[:, 3:])
    error_m, error_deg = np.full((2, len(found)), np.nan)
    error_m[localized], error_rad = pose_error(answers, frames.world_from_cam[localized])
    error_deg[localized] = np.degrees(error_rad)
    return pd.DataFrame(
        {
            "place": place,
            "photograph": [Path(name).name for name in frames.names],
            "status": found["status"].to_numpy(),
            POSITION: error_m,
            ORIENTATION: error_deg,
            **{name: found[name].to_numpy() for name in STATED},
        }
    )


def summary(table: pd.DataFrame) -> str:
    """Write what the photographs of each place come to, as two tables in Markdown."""
    lines = [HEADER, "|---" * 7 + "|"]
    held = [COVERAGE_HEADER, "|---" * 8 + "|"]
    for place, rows in table.groupby("place"):
        found = rows[rows["status"] == FOUND]
        error_m, error_deg = found[POSITION].to_numpy(), found[ORIENTATION].to_numpy()
        states = np.isfinite(found[list(STATED)].to_numpy()).all(axis=1)
        is_wrong = error_m > WRONG_M
        close = np.sum((error_m <= CLOSE_M) & (error_deg <= CLOSE_DEG))
        lines.append(
            f"| {place} | {len(rows)} | {len(found)} | {100 * np.median(error_m):.1f} cm /"
            f" {np.median(error_deg):.2f}° | {close / len(rows):.0%} |"
            f" {is_wrong.sum()} | {(is_wrong & states).sum()} |".replace("%", " %")
        )
        for name, error, radii, unit, scale in (
            ("position", error_m, STATED[:2], "cm", 100.0),
            ("orientation", error_deg, STATED[2:], "°", 1.0),
        ):
            levels = coverage(error[states], *found.loc[states, list(radii)].to_numpy().T)
            cells = " | ".join(f"{100 * one.held:.0f} % ({one.width:.2f})" for one in levels)
            middle = f"{scale * found[radii[1]].median():.1f} {unit}".replace(" °", "°")
            held.append(f"| {place}, {name} | {cells} | {middle} |")
    return "\n".join([*lines, "", *held])


if __name__ == "__main__":
    main()
