"""Do the localizers localize at all? Checks that need nothing published, and presume no outcome."""

from __future__ import annotations

import pandas as pd

from synfeal.report.layouts import TITLES, scene_title

POSITION, ORIENTATION = "position_m_true", "orientation_deg_true"


def alive_sentences(cells: pd.DataFrame) -> list[str]:
    """What the cells of Table 4 say about each scene, by the errors against the true poses."""
    scenes = cells.groupby("scene", sort=False)
    return [text for scene, found in scenes for text in _sentences(scene_title(str(scene)), found)]


def _sentences(title: str, cells: pd.DataFrame) -> list[str]:
    """Errors at the largest size below half of the mean pose's, and what more frames change."""
    n_train = cells.groupby("size", sort=False).n_train.first()
    sizes = n_train.idxmin(), n_train.idxmax()
    first, last = (cells[cells["size"] == size].set_index("model") for size in sizes)
    half_m = last[f"baseline_{POSITION}"].iloc[0] / 2
    below = int((last[POSITION] < half_m).sum())
    lines = [
        f"{title}, {sizes[1]}: {below} of {len(last)} localizers have a median position error below"
        f" half of the mean-pose baseline ({half_m:.2f} m): {_errors(last[POSITION])}."
    ]
    if pd.isna(half_m):
        lines = [f"{title}, {sizes[1]}: the mean-pose baseline could not be computed."]
    if sizes[0] != sizes[1]:
        falls = [_falls(last[measure] < first[measure]) for measure in (POSITION, ORIENTATION)]
        lines.append(
            f"{title}, {sizes[0]} to {sizes[1]}: the position error falls for {falls[0]}, the"
            f" orientation error for {falls[1]}."
        )
    return lines


def _errors(errors_m: pd.Series) -> str:
    texts = {m: "failed" if pd.isna(e) else f"{e:.2f} m" for m, e in errors_m.items()}
    return ", ".join(f"{TITLES[str(model)]} {text}" for model, text in texts.items())


def _falls(falls: pd.Series) -> str:
    others = [TITLES[str(model)] for model in falls.index[~falls]]
    exceptions = f" (not {', '.join(others)})" if others else ""
    return f"{falls.sum()} of {len(falls)}{exceptions}"
