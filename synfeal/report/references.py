"""Reference methods beside the localizers: one row per data set and method."""

from __future__ import annotations

import math
import re
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import fmean
from typing import Any

import pandas as pd

from baselines.groundtruth.methods import SIMULATOR
from baselines.references.registry import (
    REFERENCES,
    Externals,
    answered_by,
    data_sets,
    titles_of,
)
from synfeal.config import MODELS, Design
from synfeal.errors import InputError, why
from synfeal.evaluation.metrics import BOUNDS
from synfeal.files import atomic_path
from synfeal.report.grid import Entry, Grid, Group, Kind, Line
from synfeal.report.grid import Value as Printed
from synfeal.report.latex import write_latex
from synfeal.report.layouts import SOURCES, TITLES, scene_title
from synfeal.report.results import read_result
from synfeal.report.stats import MEASURES, REMEDY, CellScores, Metrics, combine, read_metrics

NAME, LOCALIZER = "references", "localizer"
CONSTANT = {"method": "constant", "title": "Mean training pose", "kind": "reference"}
KEYS = ("scene", "size", "labels", "noise_m", "noise_deg", "method", "title", "kind")
Record = Mapping[Hashable, Any]
LIMITS = tuple(f"{measure}_{end}" for measure in MEASURES for end in ("low", "high"))
WITHIN = ("within_5cm_5deg", "within_5cm_5deg_true")
COLUMNS = (
    *(*KEYS, *MEASURES, *LIMITS, *WITHIN),
    *("n_train", "n_test", "n_seeds", "failed", "seconds_per_frame"),
)


def write_references_table(
    design: Design, external: Externals, root: Path, out_csv: Path, out_tex: Path
) -> None:
    """Write the scores of all reference methods and localizers, data set by data set.

    Args:
        design: of the profile; localizers are those that start pretrained.
        external: localizers of somebody else's.
        root: results directory of the profile, where ``references`` and ``runs`` are.
        out_csv: one row per data set and method.
        out_tex: the same as a table environment, a line per method.

    Raises:
        InputError: scores are missing or unreadable.
    """
    table = references_table(design, external, root)
    with atomic_path(out_csv) as temporary:
        table.to_csv(temporary, index=False, float_format="%.6g", lineterminator="\n")
    write_latex(out_tex, references_grid(table))


def references_table(design: Design, external: Externals, root: Path) -> pd.DataFrame:
    """The table of :data:`COLUMNS`; where more than half of a method's answers failed, no score."""
    titles = {**titles_of(external), **TITLES}
    rows = {(row.scene, row.size, row.label_id): row for row in design.rows}
    trained = {key: row for key, row in rows.items() if design.runs_of(row.pretrained, MODELS[0])}
    records = []
    for key in data_sets(design.rows):
        folder = root.joinpath("references", *key)
        row = rows[key]
        keys = dict(zip(KEYS, (*key, row.noise_m, row.noise_deg), strict=False))
        methods = answered_by(design.rows, key, external)
        constant = _constant_record(read_metrics(folder / methods[0] / "metrics.json"))
        records.append({**keys, **CONSTANT, **constant})
        for method in methods:
            kind = "reference" if method in REFERENCES else "external"
            names = {**keys, "method": method, "title": titles[method], "kind": kind}
            records.append(names | _record([folder / method]) | _seconds(folder / method))
        for model in MODELS if key in trained else ():
            runs = [root / "runs" / r.directory for r in design.runs_of(row.pretrained, model)]
            names = {**keys, "method": model, "title": titles[model], "kind": LOCALIZER}
            records.append(names | _record(runs))
    return pd.DataFrame.from_records(records, columns=list(COLUMNS))


def read_references(path: Path) -> pd.DataFrame:
    """The table that :func:`write_references_table` wrote.

    Raises:
        InputError: it cannot be read or lacks a column.
    """
    texts = dict.fromkeys(("scene", "size", "labels", "method", "title", "kind"), str)
    try:
        return pd.read_csv(path, usecols=list(COLUMNS), dtype=texts)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be read ({why(error)}); make that table again") from None


def _constant_record(metrics: Metrics) -> dict[str, Any]:
    """Scores of always answering the mean training pose, which every run's scores hold."""
    scores = {measure: metrics[f"baseline_{measure}"] for measure in MEASURES}
    return scores | {name: metrics[name] for name in ("n_train", "n_test")} | {"n_seeds": 1}


def _seconds(folder: Path) -> dict[str, float]:
    facts = read_result(folder / "facts.json", ("answer_s", "frames"), "answer again")
    return {"seconds_per_frame": facts["answer_s"] / facts["frames"]}


def _record(folders: Sequence[Path]) -> dict[str, Any]:
    """Scores of the repetitions of a method, by column."""
    scores = combine([read_metrics(folder / "metrics.json") for folder in folders])
    record = {**_medians(scores), **dict(zip(WITHIN, _within(folders), strict=True))}
    return (
        record
        | {name: getattr(scores, name) for name in ("n_train", "n_test", "n_seeds")}
        | {"failed": scores.failed}
    )


def _medians(scores: CellScores) -> dict[str, float | None]:
    record: dict[str, float | None] = {}
    for measure, score in scores.scores.items():
        record |= {measure: score.value}
        record |= {f"{measure}_low": score.low, f"{measure}_high": score.high}
    return record


def _within(folders: Sequence[Path]) -> list[float]:
    """Share of the frames within 5 cm and 5 degrees of their labels, and of their true poses."""
    names = [f"{BOUNDS[0].name}{end}" for end in ("", "_true")]
    every = [read_result(folder / "metrics.json", names, REMEDY) for folder in folders]
    return [fmean(metrics[name] for metrics in every) for name in names]


def references_grid(table: pd.DataFrame) -> Grid:
    """A block per scene and size, a row per label set, a column per method."""
    titles = titles_in(table[table.kind != LOCALIZER])
    groups = []
    for (scene, size), block in table.groupby(["scene", "size"], sort=False):
        rows = [_row(part, list(titles)) for _, part in block.groupby("labels", sort=False)]
        groups.append(Group(f"{scene_title(str(scene))}, {size}", tuple(rows)))
    return Grid(
        NAME,
        "Reference methods beside the best of the localizers (by position): median errors, and the "
        "share of the test frames within 5 cm and 5 degrees.",
        ("Labels", "Against", *titles.values(), "Best localizer"),
        tuple(groups),
        (
            "Every method answers from the labels of the data set, as the localizers do; answers "
            "that failed count as infinite errors.",
        ),
    )


def titles_in(table: pd.DataFrame) -> dict[str, str]:
    """Titles of the methods of a table by name, in its order."""
    return dict(zip(table["method"], table["title"], strict=True))


def _row(part: pd.DataFrame, methods: Sequence[str]) -> tuple[Line, ...]:
    """The lines of a label set: against its labels and, where they differ, the true poses."""
    records = {str(record["method"]): record for record in part.to_dict("records")}
    labels = str(part.labels.iloc[0])
    lines = [
        _row_line("labels", label_title(labels), "labels", records, methods),
        _row_line("truth", "", "true poses", records, methods),
    ]
    if labels == SIMULATOR:
        return (replace(lines[1], label=label_title(labels)),)
    return tuple(lines)


def _row_line(
    kind: Kind, label: str, against: str, records: Mapping[str, Record], methods: Sequence[str]
) -> Line:
    end = "_true" if kind == "truth" else ""
    trained = [r for r in records.values() if r["kind"] == LOCALIZER]
    scored = [r for r in trained if not math.isnan(r[f"position_m{end}"])]
    best = min(scored, key=lambda r: float(r[f"position_m{end}"]), default=None)
    entries = [*(_entry(records.get(name), end) for name in methods), _entry(best, end, named=True)]
    return Line(kind, label, against, tuple(entries))


def label_title(labels: str) -> str:
    """A label set as tables call it: ``noise-p0.1-r5`` is noise 0.1 m, 5°."""
    found = re.fullmatch(r"(\w+)-p([\d.]+)-r([\d.]+)", labels)
    return f"{found[1]} {found[2]} m, {found[3]}°" if found else SOURCES.get(labels, labels)


def _entry(record: Record | None, end: str, named: bool = False) -> Entry:
    """Errors and share of one method; ``named`` says whose they are."""
    if record is None:
        return Entry((Printed("–"),))
    if math.isnan(record[f"position_m{end}"]):
        return Entry((Printed("failed"),))
    share = record[f"within_5cm_5deg{end}"]
    values = (
        *((Printed(record["title"]),) if named else ()),
        Printed(f"{record[f'position_m{end}']:.2g} m"),
        Printed(f"{record[f'orientation_deg{end}']:.2g}°"),
        *(() if math.isnan(share) else (Printed(f"{100 * share:.0f} %"),)),
    )
    return Entry(values)
