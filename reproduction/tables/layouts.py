"""Wording of the tables: titles, headings, captions, labels of rows."""

from __future__ import annotations

from typing import Any

import pandas as pd

from baselines.config.learning import LOCALIZERS
from baselines.labels.injected import LABEL_ERRORS
from baselines.labels.methods import METHODS, SIMULATOR
from reproduction.design.experiments import FROM_SCRATCH, split_init
from reproduction.design.label_sets import LabelSet

TITLES = {name: kind.title for name, kind in LOCALIZERS.items()}
SOURCES = {**{name: method.title for name, method in METHODS.items()}, "synfeal": "Synfeal"}
ERRORS = {name: kind.title for name, kind in LABEL_ERRORS.items()}
STARTS = {"pretrained": "transfer learning", "scratch": "from scratch"}
PARTS = {"": "", "half": ", half of the images", "quarter": ", a quarter of the images"}
# What has not been trained, printed beside the localizers: columns of metrics.
REFERENCES = {"baseline": "Mean pose", "floor": "True pose"}
BLOCKS = {"": "", "orientation": "Ori.", "position": "Pos.", "both": "Pos.+Ori."}
CAPTIONS = {
    "table2_ground_truth": "Median localization error with labels from different data collection "
    "techniques.",
    "table3_inconsistencies": "Median localization error with different levels of inconsistencies "
    "in the labels.",
    "table4_size": "Median localization error on data sets of different size.",
    "table5_from_scratch": "Median localization error without transfer learning on data sets of "
    "different size, and the change against the same run with transfer learning.",
    "table6_label_errors": "Median localization error with labels of the same median error and "
    "different kinds of it; this table is not in the paper.",
    "table7_images_shown": "Median localization error after fewer images, each a training run of "
    "its own length; this table is not in the paper.",
}
HEADINGS = {
    "table2_ground_truth": "Ground truth provided by",
    "table3_inconsistencies": "Inconsistencies",
    "table4_size": "(# train, # test)",
    "table5_from_scratch": "(# train, # test)",
    "table6_label_errors": "Errors of the labels",
    "table7_images_shown": "Images shown",
}
REMARK = (
    "Errors are against the labels the test set carries (the paper's protocol) and against the "
    "true poses of the simulator."
)
PUBLISHED = (
    "Lines marked paper: the values the paper printed, on its own meshes and at its own scale. Its "
    "position errors are root mean squares over the three axes; lines marked paper's unit are ours "
    "in that unit."
)
UNTRAINED = (
    "Mean pose: the error of always answering the mean pose of the training labels. True pose: "
    "that of the true poses against the labels, what a perfect localizer would score."
)
YARDSTICK = (
    "Yardstick alone: what the same localizer, trained on clean labels, would score against test "
    "labels with that noise. So much of the error is the noise of the test labels, and none of it "
    "harm to the localizer."
)
DOSE = (
    "Positions of labels are moved by √3 times the metres that a row names, as the published code "
    "moves them."
)
CHANGE = (
    "Red: worse than with transfer learning; green: not worse. Changes come from unrounded errors; "
    "some printed in the paper differ from what its rounded cells give."
)
ONE_RUN = (
    "Cells of one training run: 95 % limits cover other test paths only; another training run "
    "would differ beyond them."
)
UNITS = {"position_m": " m", "orientation_deg": "°"}


def scene_title(scene: str) -> str:
    """Title a scene as it is printed, e.g. ``Large Room``."""
    return scene.replace("_", " ").title()


def data_set_titles(table: pd.DataFrame) -> pd.Series:
    """Title data sets of a table with ``scene`` and ``size``, as in ``Large Room, 6k``."""
    return table.scene.map(scene_title) + ", " + table["size"]


def label_title(labels: str) -> str:
    """Title a label set as tables do: ``noise-p0.1-r5`` is noise 0.1 m, 5°."""
    named = LabelSet.parse(labels)
    if not named.is_injected:
        return SOURCES.get(labels, labels)
    return f"{named.source} {named.noise_m:g} m, {named.noise_deg:g}°"


def row_label(name: str, cell: Any) -> str:
    """Title a row: label source, noise, or size with the frames actually used."""
    if name == "table2_ground_truth":
        return SOURCES.get(cell.labels, str(cell.label_id))
    if name == "table3_inconsistencies":
        return f"{_level(cell.noise_m)} m, {cell.noise_deg:g}°"
    if name == "table6_label_errors":
        size = f"{_level(cell.noise_m)} m, {cell.noise_deg:g}°"
        return "none" if cell.labels == SIMULATOR else f"{ERRORS[cell.labels]}, {size}"
    if name == "table7_images_shown":
        start, part = split_init(cell.init)
        return STARTS[start] + PARTS[part]
    return f"{cell.size}: ({cell.n_train}, {cell.n_test})"


def published_labels(name: str, cells: pd.DataFrame) -> dict[Any, str]:
    """Return, by row, its label in print: frames, or another one than it is run under, or none."""
    rows = cells[cells.published_position_m.notna()].groupby("row").first()
    if name not in ("table4_size", FROM_SCRATCH):
        return dict(rows.published_printed_row)
    frames = zip(rows.index, rows.published_n_train, rows.published_n_test, strict=True)
    return {row: f"({train / 1000:g}k, {test / 1000:g}k)" for row, train, test in frames}


def _level(noise_m: float) -> str:
    """Format a noise level with the paper's two digits, or as many as it needs; 0 stays 0."""
    if noise_m == 0 or round(noise_m, 2) != noise_m:
        return f"{noise_m:g}"
    return f"{noise_m:.2f}"
