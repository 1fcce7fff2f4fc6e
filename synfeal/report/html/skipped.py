"""What the page does not show, and why."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from synfeal.config import Experiment
from synfeal.config.tables import KEYS
from synfeal.report.claims.model import NOT_TESTABLE
from synfeal.report.html.claims import Claims
from synfeal.report.layouts import BLOCKS, SOURCES, scene_title
from synfeal.report.published import key_of, published_cells

RowKey = tuple[str, str, str, str, float, float, str]


def missing_rows(rows: Sequence[Experiment]) -> list[str]:
    """By table, the paper's rows that this run's table of experiments leaves out."""
    sentences = []
    for table in KEYS:
        own = {key_of(row, "")[:-1] for row in rows if row.table == table}
        printed = dict.fromkeys(key[:-1] for key in published_cells(table))
        absent = [_row_name(table, key) for key in printed if key not in own]
        if absent:
            number = table.split("_")[0].removeprefix("table")
            sentences.append(
                f"Table {number}: {len(absent)} of the paper's {len(printed)} rows are not in this"
                f" profile's table of experiments: {'; '.join(absent)}."
            )
    return sentences


def untested_claims(claims: Claims) -> list[str]:
    """Claims that this run cannot test under one of the two scores, and why."""
    return [
        f"{claim['id']} is not testable here: {claim['reason'] or 'no reason given'}"
        for claim in claims
        if NOT_TESTABLE in (claim["verdict_labels"], claim["verdict_true"])
    ]


def missing_figures(captions: Mapping[str, str], found: Iterable[str]) -> list[str]:
    """Figures that have a caption and were not drawn."""
    names = [name for name in captions if name not in set(found)]
    return [f"Not drawn, for lack of its data in this profile: figure {name}." for name in names]


def _row_name(table: str, key: RowKey) -> str:
    block, scene, size, labels, noise_m, noise_deg, _ = key
    if table == "table2_ground_truth":
        return f"{scene_title(scene)}, {SOURCES[labels]}"
    if block:
        return f"{BLOCKS[block]} {noise_m:g} m, {noise_deg:g}°"
    return f"{scene_title(scene)} {size}"
