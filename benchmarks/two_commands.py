"""Cost and errors of ``synfeal build`` and ``synfeal localize`` on captures, without an option.

    python -m benchmarks.two_commands results/benchmarks/two_commands.csv --place corridor \
        --frames 73 --build-s 350 410 --localize-s 40 48 --capture All_Data --poses poses.csv

adds the rows of a place, in place of those that the table has of it, and prints the whole. Seconds
are of the processor (user and system, as ``time`` tells them) and of the clock, ``--make`` the
command that made the map where it was not ``build``. The capture holds the photographs of
``poses.csv`` and their poses; the place was built from others.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from baselines.references.map_localizer import FOUND
from benchmarks.stated_errors import (
    CLOSE_DEG,
    CLOSE_M,
    ORIENTATION,
    POSITION,
    WRONG_M,
    measured,
)
from synfeal.records.tables import write_frame

HEADER = (
    "| place | frames | `build` | photographs | `localize`, each | localized | error (median)"
    " | within 5 cm, 5° | within the stated 95 % radius | off by more than 50 cm |"
)
LOCALIZE = "synfeal localize"
# Of a row that was measured before the table had the column.
UNKNOWN = "–"


def main() -> None:
    """Add the rows of a place to the table, and print all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("--place", help="name of the place in the table")
    parser.add_argument("--frames", type=int, help="frames it was built from; none of a mesh")
    parser.add_argument("--make", default="synfeal build", help="command that made it")
    for command in ("build", "localize"):
        parser.add_argument(f"--{command}-s", type=float, nargs=2, metavar=("CPU", "WALL"))
    parser.add_argument("--capture", type=Path, help="capture that holds the photographs")
    parser.add_argument("--poses", type=Path, help="what `synfeal localize` wrote of them")
    given = parser.parse_args()
    table = pd.read_csv(given.table) if given.table.exists() else pd.DataFrame({"place": []})
    if given.poses is not None:
        errors = measured(given.place, given.capture, given.poses)
        rows = pd.DataFrame(
            [
                {"command": given.make, **_seconds(given.build_s)},
                {"command": LOCALIZE, **_seconds(given.localize_s), **scores(errors)},
            ]
        )
        rows.insert(0, "place", given.place)
        rows.insert(1, "frames", given.frames)
        table = pd.concat([table[table["place"] != given.place], rows], ignore_index=True)
        whole = ["frames", "photographs", "localized", "over_50cm"]
        write_frame(given.table, table.astype(dict.fromkeys(whole, "Int64")))
    print(summary(table))


def _seconds(cpu_and_wall_s: list[float]) -> dict[str, float]:
    return dict(zip(("cpu_s", "wall_s"), cpu_and_wall_s, strict=True))


def scores(errors: pd.DataFrame) -> dict[str, float]:
    """Summarise errors of photographs, as :func:`benchmarks.stated_errors.measured` has them."""
    found = errors[errors["status"] == FOUND]
    error_m, error_deg = found[POSITION], found[ORIENTATION]
    stated = found[found["position_95_m"].notna()]
    held = (stated[POSITION] <= stated["position_95_m"]).mean() if len(stated) else np.nan
    close = ((error_m <= CLOSE_M) & (error_deg <= CLOSE_DEG)).sum()
    return {
        "photographs": len(errors),
        "localized": len(found),
        "position_m": round(float(error_m.median()), 5),
        "orientation_deg": round(float(error_deg.median()), 3),
        "within_5cm_5deg_percent": round(100 * close / len(errors), 1),
        "within_stated_95_percent": round(100 * float(held), 1),
        "over_50cm": int((error_m > WRONG_M).sum()),
    }


def summary(table: pd.DataFrame) -> str:
    """Write a row for each place, as a table in Markdown."""
    lines = [HEADER, "|---" * 10 + "|"]
    for place, rows in table.groupby("place", sort=False):
        made, found = (
            rows[(rows["command"] == LOCALIZE) == is_it].iloc[0] for is_it in (False, True)
        )
        frames = "mesh" if pd.isna(found["frames"]) else f"{found['frames']:.0f}"
        each_s = found["cpu_s"] / found["photographs"]
        held = found["within_stated_95_percent"]
        cells = (
            place,
            frames,
            f"{made['cpu_s'] / 60:.1f} min",
            f"{found['photographs']:.0f}",
            f"{each_s:.2f} s",
            f"{found['localized']:.0f}",
            f"{100 * found['position_m']:.1f} cm / {found['orientation_deg']:.2f}°",
            f"{found['within_5cm_5deg_percent']:.0f} %",
            UNKNOWN if pd.isna(held) else f"{held:.0f} %",
            UNKNOWN if pd.isna(found["over_50cm"]) else f"{found['over_50cm']:.0f}",
        )
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
