"""Photographs of other places: how many a map localizes, and which of these poses state an error.

    python -m benchmarks.other_places results/benchmarks/other_places.csv \
        --place corridor --photographs-of kitchen --poses poses.csv

adds a row of what ``synfeal localize`` wrote into ``poses.csv`` of photographs that do not show the
place, with the calibration of their own camera, in place of the row that the table has of both.
Without ``--poses`` it prints what all rows come to.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import pandas as pd

from baselines.references.map_localizer import AMBIGUOUS, FOUND
from reproduction.statistics.limits import share_limits
from synfeal.dataset.pose_table import STATED
from synfeal.records.tables import write_frame

KEYS = ["place", "photographs_of"]
COUNTS = ["photographs", "localized", "ambiguous", "with_stated_error"]
HEADER = (
    "| map of | photographs of the others | localized | ambiguous | not localized"
    " | localized, with a stated error |"
)


def main() -> None:
    """Add a row to the table, and print what all of them come to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("--place", help="place of the map, by its name in the table")
    parser.add_argument("--photographs-of", help="place that the photographs show")
    parser.add_argument("--poses", type=Path, help="what `synfeal localize` wrote of them")
    given = parser.parse_args()
    table = pd.read_csv(given.table) if given.table.exists() else pd.DataFrame(columns=KEYS)
    if given.poses is not None:
        keys = [given.place, given.photographs_of]
        row = pd.DataFrame([dict(zip(KEYS, keys, strict=True)) | counts(given.poses)])
        table = pd.concat([table[(table[KEYS] != keys).any(axis=1)], row]).sort_values(KEYS)
        write_frame(given.table, table)
    print(summary(table))


def counts(poses: Path) -> dict[str, int]:
    """Count what became of the photographs of a file of poses."""
    found = pd.read_csv(poses)
    is_found = found["status"] == FOUND
    states = np.isfinite(found[list(STATED)].to_numpy()).all(axis=1)
    values = (len(found), is_found.sum(), (found["status"] == AMBIGUOUS).sum())
    return dict(zip(COUNTS, map(int, (*values, (is_found & states).sum())), strict=True))


def summary(table: pd.DataFrame) -> str:
    """Write what the rows come to, by the place of the map, as a table in Markdown."""
    lines = [HEADER, "|---" * 6 + "|"]
    by_place = table.groupby("place")[COUNTS].sum()
    lines += [_line(str(place), row) for place, row in by_place.iterrows()]
    total = by_place.sum()
    lines.append(_line("all", total))
    photographs = int(total["photographs"])
    limits = [
        "{} {:.1f} % (95 %: {:.1f} to {:.1f} %)".format(
            words, 100 * count / photographs, *(100 * np.array(share_limits(count, photographs)))
        )
        for words, count in (
            ("without a pose", photographs - int(total["localized"])),
            ("with a pose that states an error", int(total["with_stated_error"])),
        )
    ]
    return "\n".join([*lines, "", f"Of all {photographs}: {limits[0]}, {limits[1]}."])


def _line(name: str, row: pd.Series) -> str:
    photographs, localized, ambiguous, states = (int(row[column]) for column in COUNTS)
    lost = photographs - localized - ambiguous
    return f"| {name} | {photographs} | {localized} | {ambiguous} | {lost} | {states} |"


if __name__ == "__main__":
    main()
