"""Hours of training on one GPU, from measured rates."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pandas as pd

from reproduction.design.experiments import read_design
from reproduction.design.files import Files
from reproduction.plan.jobs import jobs_of
from reproduction.plan.text import duration, number
from reproduction.tables.sheet import text_table
from synfeal.records.tables import COUNT, NUMBER, TEXT, read_frame

# The tracked ones, and the command that measures others.
RATES = Path("results/benchmarks/gpu.csv")
MEASURING = "python -m benchmarks.gpu"
TRAINING = ("train", "train_varied")
WEEKEND_S = 60 * 3600.0
SCHEMA = {
    "localizer": TEXT,
    "input_px": COUNT,
    "width": NUMBER,
    "batch": COUNT,
    "step": TEXT,
    "randomised": TEXT,
    "processes": COUNT,
    "images_per_s": NUMBER,
    "card": TEXT,
}


class TableHours(NamedTuple):
    """Time that training for one table, or for all of them, takes on one card.

    Attributes:
        name: Name of the table.
        runs: Training runs.
        images: Images shown.
        seconds: Time of the runs whose rate was measured.
        unknown: Images of the others.
    """

    name: str
    runs: int
    images: float
    seconds: float
    unknown: float

    @property
    def time(self) -> str:
        """Text of the time: a lower bound where rates of some images are not known."""
        if self.unknown >= self.images:
            return "unknown"
        return f"over {duration(self.seconds)}" if self.unknown else duration(self.seconds)


def gpu_text(files: Files, path: Path) -> str:
    """Tell the hours of a profile's training on one card, by table, and what is not known.

    Args:
        files: Files of the profile.
        path: Rates, as ``benchmarks/gpu.py`` writes them.

    Raises:
        InputError: The rates cannot be read.
    """
    rates = _fitting(read_frame(path, SCHEMA, f"measure it by {MEASURING}"), files)
    rows = [_hours(name, alone, rates) for name, alone in _alone(files)]
    rows.append(_hours("all", files, rates))
    table = [["", "runs", "images", "one GPU"]]
    table += [[row.name, f"{row.runs:,}", number(row.images), row.time] for row in rows]
    missing = [f"missing     {line}\n" for line in _missing(files, rates, rows[-1])]
    title = f"Training on one GPU, one run after the other, by {path}"
    return f"{title}\n\n{text_table(table)}\n{_rates_text(files, rates)}{''.join(missing)}"


def _rates_text(files: Files, rates: pd.DataFrame) -> str:
    """List the rates that the hours rest on; nothing where none is known."""
    if rates.empty:
        return ""
    shape = _shape_text(files)
    table = [["rates", "images/s", "step", "card"]]
    for name, rate in rates.iterrows():
        table.append([str(name), number(rate["images_per_s"]), rate["step"], rate["card"]])
    return f"{text_table(table)}            of {shape}\n\n"


def _shape_text(files: Files) -> str:
    network, training = files.config.network, files.config.training
    randomised = ", randomised" if training.randomisation is not None else ""
    return (
        f"{network.input_px} px, width {network.width:g}, batch {training.batch_size}{randomised}"
    )


def _fitting(rates: pd.DataFrame, files: Files) -> pd.DataFrame:
    """Return the rates of the profile's network, batch and images, one for each localizer."""
    network, training = files.config.network, files.config.training
    same = (rates["input_px"] == network.input_px) & (rates["width"] == network.width)
    same &= (rates["batch"] == training.batch_size) & (rates["processes"] == 1)
    same &= rates["randomised"] == str(training.randomisation is not None)
    # As training is done now, where that was measured: "captured" comes before "plain".
    return rates[same].sort_values("step").drop_duplicates("localizer").set_index("localizer")


def _alone(files: Files) -> list[tuple[str, Files]]:
    """List the tables with the files of a run that makes each of them alone."""
    made = []
    for table in files.design.tables:
        config = files.config.model_copy(update={"tables": (table,)})
        made.append((table, Files(config, read_design(config))))
    return made


def _hours(name: str, files: Files, rates: pd.DataFrame) -> TableHours:
    jobs = jobs_of(files)
    runs = jobs[jobs["rule"].isin(TRAINING)]
    localizer = runs["pace"].str.split().str[-1]
    seconds = runs["count"] / localizer.map(rates["images_per_s"])
    unknown = runs.loc[seconds.isna(), "count"].sum()
    return TableHours(name, len(runs), runs["count"].sum(), seconds.sum(), float(unknown))


def _missing(files: Files, rates: pd.DataFrame, total: TableHours) -> list[str]:
    lines = []
    if total.seconds > WEEKEND_S:
        rate = number(total.images / WEEKEND_S)
        lines.append(f"{rate} images/s over all runs, to be done in a weekend (60 h)")
    if total.unknown:
        lines.append(
            f"rates of {number(total.unknown)} images ({_shape_text(files)}):"
            f" measure them by {MEASURING}"
        )
    plain = rates.index[rates["step"] == "plain"]
    if len(plain):
        lines.append(
            f"rates of captured steps, which training takes now ({', '.join(plain)}):"
            f" measured are plain ones; {MEASURING} measures both"
        )
    lines.append("rendering, labels and references: processor time, in the plan without --gpu")
    return lines
