"""What a run found, against what the paper printed: how much each change moves the errors.

A change (more frames, exact labels, noisy labels, no transfer learning) multiplies the median error
of a localizer by a factor; factors of different scales, rooms and networks can be compared where
errors in metres cannot.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from synfeal.files import atomic_path
from synfeal.frames import TEXT, Schema, read_frame
from synfeal.report.cells import schema_of
from synfeal.report.figures.style import BLUE, RC, VERMILION, Style
from synfeal.report.layouts import scene_title

MEASURES = ("position_m", "orientation_deg")
HERE, PAPER = "here", "paper"
COLUMNS = ("group", "change", "spoken", "model", "measure", "source", "factor")


def read_table(root: Path, name: str, schema: Schema | None = None) -> pd.DataFrame:
    """A published table; of localizers, where no columns are named."""
    return read_frame(root / "tables" / f"{name}.csv", schema or schema_of(name), "publish again")


def effects(root: Path) -> pd.DataFrame:
    """Factors by which the median errors of published results change.

    Columns ``COLUMNS``, one row per change (in the order of the tables), localizer, measure
    (``MEASURES``) and source (``HERE`` or ``PAPER``), where both errors are known.
    """
    return pd.concat(_changes(root), ignore_index=True)


def mean_factor(found: pd.DataFrame, change: str, measure: str, source: str) -> float:
    """Geometric mean of a change over the localizers; NaN where there is none."""
    chosen = (found.change == change) & (found.measure == measure) & (found.source == source)
    return float(np.exp(np.log(found.factor[chosen]).mean()))


def sentences(root: Path) -> list[str]:
    """What there is to say: each group of changes in one sentence, and how the claims fared."""
    groups = effects(root).groupby("group", sort=False)
    claims = read_frame(root / "claims.csv", {"verdict_true": TEXT}, "publish again")
    verdicts = claims.verdict_true.value_counts(sort=False)
    counts = ", ".join(f"{count} {verdict}" for verdict, count in verdicts.items())
    return [
        *(_group_sentence(found) for _, found in groups),
        f"Verdicts on {verdicts.sum()} claims, by the true poses: {counts}.",
    ]


def _changes(root: Path) -> Iterator[pd.DataFrame]:
    """Every change, in the order in which it is told."""
    size = read_table(root, "table4_size")
    for scene, rows in size.groupby("scene", sort=False):
        first, last = rows["size"].iloc[[0, -1]]
        title = scene_title(str(scene))
        name = ("size", f"{last} frames, not {first}, {title}")
        spoken = f"From {first} to {last} frames of the {title}"
        yield _factors(name, spoken, rows[rows["size"] == first], rows[rows["size"] == last])
    rows = read_table(root, "table2_ground_truth")
    for source, title in (("sfm", "SfM"), ("rgbd-toro", "RGB-D SLAM")):
        name = ("labels", f"exact labels, not {title}'s")
        spoken = f"With exact labels in place of those of {title}"
        yield _factors(name, spoken, rows[rows.labels == source], rows[rows.labels == "synfeal"])
    rows = read_table(root, "table3_inconsistencies").query("block == 'both'")
    clean, noisy = rows[rows.noise_m == 0], rows[rows.noise_m == rows.noise_m.max()]
    noise = f"{rows.noise_m.max():g} m and {rows.noise_deg.max():g}°"
    spoken = f"With noise of {noise} in the labels, measured against those labels as in the paper,"
    name = ("noise", f"label noise of {noise}, against the labels")
    yield _factors(name, spoken, clean, noisy, score="")
    name = ("noise", f"label noise of {noise}, against the truth")
    found = _factors(name, "measured against the true poses", clean, noisy)
    yield found.query("source == @HERE")
    scratch = read_table(root, "table5_from_scratch")
    for last in scratch["size"].iloc[[0, -1]]:
        rows = scratch[scratch["size"] == last]
        pretrained = size[(size["size"] == last) & size.scene.isin(rows.scene)]
        spoken = f"Without pretrained weights and with {last} frames"
        yield _factors(("start", f"from scratch, {last} frames"), spoken, pretrained, rows)


def _factors(
    names: tuple[str, str],
    spoken: str,
    before: pd.DataFrame,
    after: pd.DataFrame,
    score: str = "_true",
) -> pd.DataFrame:
    """One change, from the rows of a table without it and with it."""
    both = before.merge(after, on="model", suffixes=("_before", "_after"), validate="1:1")
    parts = []
    for measure in MEASURES:
        columns = {HERE: f"{measure}{score}", PAPER: f"published_{measure}"}
        for source, column in columns.items():
            factor = both[f"{column}_after"] / both[f"{column}_before"]
            part = pd.DataFrame({"model": both.model, "factor": factor})
            parts.append(part.assign(measure=measure, source=source))
    found = pd.concat(parts).assign(group=names[0], change=names[1], spoken=spoken)
    return found.dropna(subset="factor")[list(COLUMNS)]


def _group_sentence(found: pd.DataFrame) -> str:
    """The changes of a group, the paper's figures in brackets."""
    parts: list[str] = []
    for change, spoken in found[["change", "spoken"]].drop_duplicates().to_numpy():
        position, orientation = (_printed(found, change, measure) for measure in MEASURES)
        if parts:
            parts.append(f"{spoken[0].lower()}{spoken[1:]} by {position} and {orientation}")
        else:
            errors = f"the position error changes by {position}", f"orientation by {orientation}"
            parts.append(f"{spoken} {' and '.join(errors)}")
    return "; ".join(parts) + "."


def _printed(found: pd.DataFrame, change: str, measure: str) -> str:
    here, paper = (mean_factor(found, change, measure, source) for source in (HERE, PAPER))
    return percent(here) + (f" ({percent(paper)})" if np.isfinite(paper) else "")


def percent(factor: float) -> str:
    """A factor as a change in percent."""
    change = round(100 * (factor - 1))  # an integer has no minus zero
    return f"{change:+d} %".replace("-", "−") if change else "0 %"


STYLES: dict[str, Style] = {
    PAPER: {"color": VERMILION, "marker": "D", "label": "in the paper"},
    HERE: {"color": BLUE, "marker": "o", "label": "here"},
}
TITLES = dict(zip(MEASURES, ("position", "orientation"), strict=True))
ASIDE = {PAPER: -0.17, HERE: 0.17}  # of the distance between two changes
TICKS = {0.2: "÷ 5", 0.5: "÷ 2", 1.0: "same", 2.0: "× 2", 5.0: "× 5"}
DPI = 150
SOURCE = "Source"  # of the picture: what it was drawn from


def write_findings_figure(found: pd.DataFrame, out_png: Path) -> None:
    """Draw the factors of :func:`effects`: the answer in one figure, here and in print."""
    with matplotlib.rc_context(rc=RC), atomic_path(out_png) as temporary:
        metadata = {"Software": None, SOURCE: _digest(found)}
        findings_figure(found).savefig(temporary, dpi=DPI, metadata=metadata)


def is_drawn_from(png: Path, found: pd.DataFrame) -> bool:
    """Whether a picture there is shows these factors."""
    if not png.is_file():
        return False
    with Image.open(png) as picture:
        return picture.info.get(SOURCE) == _digest(found)


def findings_figure(found: pd.DataFrame) -> Figure:
    """One line per change, one panel per measure."""
    changes = list(found.change.unique())
    figure = Figure(figsize=(8.2, 0.9 + 0.38 * len(changes)), layout="constrained")
    panels = figure.subplots(1, len(MEASURES), sharex=True, sharey=True)
    for axes, measure in zip(panels, MEASURES, strict=True):
        for source, style in STYLES.items():
            _draw(axes, found[found.measure == measure], changes, source, style)
        _finish(axes, TITLES[measure])
    panels[0].set_yticks(range(len(changes)), changes)
    panels[0].invert_yaxis()
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=2)
    return figure


def _draw(axes: Axes, found: pd.DataFrame, changes: list[str], source: str, style: Style) -> None:
    for place, change in enumerate(changes):
        factors = found.factor[(found.change == change) & (found.source == source)]
        y = place + ASIDE[source]
        small = {key: style[key] for key in ("color", "marker")}
        axes.plot(factors, np.full(len(factors), y), ls="", ms=3, alpha=0.45, mew=0, **small)
        mean = mean_factor(found, change, str(found.measure.iloc[0]), source)
        label = style["label"] if place == 0 else None
        axes.plot(mean, y, ls="", ms=7, mec="white", mew=0.6, **small, label=label)


def _finish(axes: Axes, title: str) -> None:
    axes.axvline(1, color="0.3", linewidth=0.8, zorder=0)
    axes.set_xscale("log")
    axes.set_xticks(list(TICKS), list(TICKS.values()))
    axes.minorticks_off()
    axes.grid(axis="x", color="0.92")
    axes.set_axisbelow(True)
    axes.spines["left"].set_visible(False)
    axes.tick_params(axis="y", length=0)
    axes.set_xlabel(f"median {title} error")


def _digest(found: pd.DataFrame) -> str:
    return hashlib.sha256(found.to_csv(index=False, float_format="%.6g").encode()).hexdigest()
