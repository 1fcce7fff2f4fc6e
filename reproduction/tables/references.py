"""Table of reference methods beside the localizers: one row per data set and method."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np
import pandas as pd

from baselines.config.learning import MODELS
from baselines.config.references import ReferencesConfig
from baselines.labels.methods import SIMULATOR
from baselines.references.registry import REFERENCES, titles_of
from reproduction.design.experiments import Design
from reproduction.design.references import answered_by, data_sets
from reproduction.runs.results import read_result
from reproduction.statistics.limits import MEASURES, REMEDY, combine, read_metrics
from reproduction.tables.cells import LIMITS, MOVED
from reproduction.tables.columns import (
    NOTHING,
    Column,
    SideLayout,
    by_method,
    method_columns,
)
from reproduction.tables.layouts import (
    DOSE,
    SOURCES,
    TITLES,
    data_set_titles,
    label_title,
    scene_title,
)
from reproduction.tables.side import SideTable, Source, Table
from synfeal.evaluation.metrics import BOUNDS
from synfeal.records.tables import (
    COUNT,
    EXTRA,
    MAYBE,
    MAYBE_COUNT,
    NUMBER,
    TEXT,
    frame_of,
    read_frame,
    records_of,
    rows_of,
)

NAME, LOCALIZER = "references", "localizer"
CONSTANT = {"method": "constant", "title": "Mean training pose", "kind": "reference"}
KEYS = ("scene", "size", "labels", "noise_m", "noise_deg", "method", "title", "kind")
WITHIN = ("within_5cm_5deg", "within_5cm_5deg_true")
SCHEMA = {
    **dict.fromkeys(KEYS, TEXT) | dict.fromkeys(("noise_m", "noise_deg"), NUMBER),
    **dict.fromkeys((*MEASURES, *LIMITS, *WITHIN), MAYBE),
    **dict.fromkeys(("n_train", "n_test", "n_seeds"), COUNT),
    "failed": MAYBE_COUNT,
    MOVED: EXTRA,
    # Last, as they are measured.
    "seconds_per_frame": MAYBE,
    "preparation_seconds": EXTRA,
}
TIME, PREPARATION = "Time per frame, one core", "Time to learn or to build the map"
LINES = ["data_set", "labels", "against"]
CAPTION = (
    "Reference methods beside the localizers, all from the labels of the data set: median errors,"
    " and the share of the test frames within 5 cm and 5 degrees."
)
REMARK = "Answers that failed count as infinite errors. The best localizer is so by position."


def references_table(design: Design, references: ReferencesConfig, root: Path) -> pd.DataFrame:
    """Compute the table of reference methods and localizers.

    Args:
        design: The profile's table of experiments.
        references: Groups of methods that were asked, and external localizers.
        root: Results of the profile.

    Returns:
        Columns :data:`SCHEMA`; no score where more than half of the answers failed.
    """
    titles = {**titles_of(references.external), **TITLES}
    rows = {(row.scene, row.size, row.label_id): row for row in design.rows}
    trained = {key: row for key, row in rows.items() if design.runs_of(row.pretrained, MODELS[0])}
    records = []
    for key in data_sets(design.rows):
        folder = root.joinpath("references", *key)
        row = rows[key]
        keys = dict(zip(KEYS, (*key, row.noise_m, row.noise_deg), strict=False))
        keys[MOVED] = design.moved_m(row)
        methods = answered_by(design.rows, key, references)
        models = MODELS if key in trained else ()
        runs = {
            model: [root / "runs" / run.directory for run in design.runs_of(row.pretrained, model)]
            for model in models
        }
        folders = [*(folder / method for method in methods), *(own[0] for own in runs.values())]
        if not folders:
            continue
        any_run = read_metrics(folders[0] / "metrics.json")  # holds the mean pose's scores
        constant = {measure: any_run[f"baseline_{measure}"] for measure in MEASURES}
        counts = {"n_train": any_run["n_train"], "n_test": any_run["n_test"], "n_seeds": 1}
        records.append({**keys, **CONSTANT, **constant, **counts})
        for method in methods:
            kind = "reference" if method in REFERENCES else "external"
            names = {**keys, "method": method, "title": titles[method], "kind": kind}
            records.append(names | _record([folder / method]) | _seconds(folder / method))
        for model, own in runs.items():
            names = {**keys, "method": model, "title": titles[model], "kind": LOCALIZER}
            records.append(names | _record(own))
    return frame_of(records, SCHEMA)


def read_references(path: Path) -> pd.DataFrame:
    """Read the table that the rule ``side_table`` wrote."""
    return read_frame(path, SCHEMA)


def _seconds(folder: Path) -> dict[str, float]:
    """Return processor seconds: of a query, and of what is learned or built from labels before."""
    needed = ("answer_s", "query_s", "prepare_s", "frames")
    facts = read_result(folder / "facts.json", needed, "answer again")
    seconds = facts["answer_s"] / facts["frames"] + facts["query_s"]
    return {"seconds_per_frame": seconds, "preparation_seconds": facts["prepare_s"]}


def _record(folders: Sequence[Path]) -> dict[str, Any]:
    scores = combine([read_metrics(folder / "metrics.json") for folder in folders])
    names = {f"{BOUNDS[0].name}{end}": f"within_5cm_5deg{end}" for end in ("", "_true")}
    every = [read_result(folder / "metrics.json", names, REMEDY) for folder in folders]
    return scores | {column: fmean(m[name] for m in every) for name, column in names.items()}


def side_layout(table: pd.DataFrame) -> SideLayout:
    """Lay out a row per label set and score, a column per method, and what an answer takes.

    Where labels are the true poses, both scores are one.
    """
    inexact = _cells(table[table.labels != SIMULATOR], "labels", "")
    cells = pd.concat([inexact, _cells(table, "true poses", "_true")]).sort_index(kind="stable")
    localizers = cells[cells.kind == LOCALIZER].dropna(subset="number").sort_values("number")
    named = localizers.assign(text=localizers.title + ", " + localizers.text)
    best = named.drop_duplicates(LINES).assign(method="best", title="Best localizer")
    rows = by_method(pd.concat([cells, best, _cost(table)]), LINES)
    followed = rows.against.map({"labels": "labels", "true poses": "true", "": ""})
    columns = [
        Column("Data set", "data_set"),
        Column("Labels", "labels"),
        Column("Against", "against"),
        *method_columns(titles_in(table[table.kind != LOCALIZER]) | titles_in(best)),
        *method_columns(titles_in(table[table.kind == LOCALIZER]), on_paper=False),
    ]
    rows["style"] = followed.where(rows.labels != SOURCES[SIMULATOR], "")
    rows["on_paper"] = ~rows.labels.isin([TIME, PREPARATION])  # paper is the same in every run
    moved = bool((table[MOVED] > table.noise_m).any())
    remark = f"{REMARK} {DOSE}" if moved else REMARK
    return SideLayout(NAME, CAPTION, columns, rows, remark, block="data_set")


def _cells(table: pd.DataFrame, against: str, end: str) -> pd.DataFrame:
    """Return the cells of one of two scores, whose columns have names with this end."""
    return table.assign(
        data_set=data_set_titles(table),
        labels=table.labels.map(label_title),
        against=against,
        number=table[f"position_m{end}"],
        text=[_text(row, end) for row in records_of(table)],
    )


def _cost(table: pd.DataFrame) -> pd.DataFrame:
    """Return cells of what a method's answers take, and of how many failed, over all label sets."""
    methods = table[table.seconds_per_frame.notna()].groupby("method")
    seconds, counts = methods.seconds_per_frame.median(), methods[["failed", "n_test"]].sum()
    prepared = methods.preparation_seconds.median()
    texts = {
        TIME: [f"{1e3 * s:.2g} ms" for s in seconds],
        PREPARATION: [NOTHING if pd.isna(s) else f"{two_digits(s)} s" for s in prepared],
        "Failed answers": [f"{row.failed:,} of {row.n_test:,}" for row in rows_of(counts)],
    }
    same = {"data_set": "All data sets", "against": "", "method": seconds.index, "number": seconds}
    return pd.concat(pd.DataFrame({**same, "labels": k, "text": t}) for k, t in texts.items())


def _text(row: Mapping[str, Any], end: str) -> str:
    position_m, orientation_deg = row[f"position_m{end}"], row[f"orientation_deg{end}"]
    if pd.isna(position_m):
        return "failed"
    degrees = two_digits(orientation_deg)
    share = row[f"within_5cm_5deg{end}"]
    return f"{two_digits(position_m)} m, {degrees}°" + (
        "" if pd.isna(share) else f", {100 * share:.0f} %"
    )


def titles_in(table: pd.DataFrame) -> dict[str, str]:
    """Return the titles of a table's methods by name, in its order."""
    return dict(zip(table["method"], table["title"], strict=True))


STRUCTURE, ADJUSTED = "structure-depth", "structure-adjusted"
TRUE = ("position_m_true", "orientation_deg_true")


def crossing_findings(table: pd.DataFrame) -> list[str]:
    """List the findings of all scenes and sizes that have one."""
    blocks = [block for _, block in table.groupby(["scene", "size"], sort=False)]
    return [sentence for sentence in map(crossing_finding, blocks) if sentence]


def crossing_finding(table: pd.DataFrame) -> str:
    """Say from which noise, in both parts of a pose, structure stops being better.

    Args:
        table: Rows of ``references.csv`` of one scene and size.

    Returns:
        A sentence that names noise as labels truly had it, whatever the dose; empty where the
        design has no noise in both, or no structure.
    """
    both = table.labels.str.startswith("noise-") & (table.noise_m > 0) & (table.noise_deg > 0)
    noisy = table[both | (table.labels == "synfeal")]
    noisy = noisy.assign(noise_m=noisy[MOVED].fillna(noisy.noise_m))
    errors = noisy.pivot(index=["noise_m", "noise_deg"], columns="method", values=list(TRUE))
    if len(errors) < 2 or not {STRUCTURE, *MODELS} <= set(noisy.method):
        return ""
    failed = errors.fillna(np.inf)
    structure = failed.xs(STRUCTURE, axis=1, level="method")
    localizers = {m: failed.loc[:, [(m, name) for name in MODELS]] for m in TRUE}
    better = [localizers[m].lt(structure[m], axis=0).sum(axis=1) for m in TRUE]
    levels = [f"{noise_m:.3g} m and {noise_deg:g}°" for noise_m, noise_deg in errors.index]
    counts = [
        f"with noise of {level}, {n_m} in position and {n_deg} in orientation"
        for level, n_m, n_deg in zip(levels, *better, strict=True)
    ]
    best_m, best_deg = (localizers[measure].iloc[0].min() for measure in TRUE)
    sentence = (
        f"{scene_title(str(noisy.scene.iloc[0]))}, {noisy['size'].iloc[0]}: with exact labels"
        f" structure-based poses are off by {_off(*structure.iloc[0])}, the best localizer by"
        f" {_off(best_m, best_deg)}. This many of the {len(MODELS)} localizers are closer to the"
        f" truth than structure on the same labels: {'; '.join(counts[1:])}."
    )
    adjusted = [errors.iloc[-1].get((measure, ADJUSTED), np.nan) for measure in TRUE]
    if np.isnan(adjusted).any():  # was not asked, or failed
        return sentence
    return (
        f"{sentence} On a map that was bundle-adjusted from labels with {levels[-1]},"
        f" structure-based poses are off by {_off(*adjusted)}."
    )


def _off(position_m: float, orientation_deg: float) -> str:
    return f"{two_digits(100 * position_m)} cm and {two_digits(orientation_deg)}°"


def two_digits(value: float) -> str:
    """Format a positive number with two significant digits, and all before the point."""
    places = max(0, 1 - math.floor(math.log10(value))) if 0 < value < math.inf else 0
    return f"{value:.{places}f}"


@SideTable(
    name="references",
    title="References",
    rank=20,
    needs=(
        "runs/{run}/metrics.json",
        "references/{reference}/metrics.json",
        "references/{reference}/facts.json",
    ),
    settings=("references",),
    in_document=True,
    in_summary=True,
)
class ReferencesTable(Table):
    """Scores of reference methods and localizers, data set by data set."""

    schema = SCHEMA
    layout = staticmethod(side_layout)

    def rows(self, source: Source) -> pd.DataFrame:
        """Read the scores of all methods."""
        settings = ReferencesConfig.model_validate(source.settings["references"])
        return references_table(source.design, settings, source.root)

    def findings(self, rows: pd.DataFrame) -> list[str]:
        """Say from which noise structure stops being better."""
        return crossing_findings(rows)
