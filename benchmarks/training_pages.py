"""What the benchmarks of trainings share: their options, their pages, means over seeds."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from statistics import mean

from benchmarks.trainings import Row, Training, measure_missing
from synfeal.config import load_config
from synfeal.config.models import Config
from synfeal.errors import exit_status
from synfeal.files import atomic_path

CONFIG = Path("config/config.yaml")
OUT = Path("results/benchmarks")


def options_of(module: str, doc: str | None, repetitions: int) -> argparse.ArgumentParser:
    """The options of a benchmark that trains."""
    parser = argparse.ArgumentParser(prog=f"python -m benchmarks.{module}", description=doc)
    parser.add_argument(
        "--results",
        type=Path,
        required=True,
        help="results tree of the profile: frames, labels, pretrained backbones",
    )
    parser.add_argument("--config", type=Path, default=CONFIG, help=f"its profile ({CONFIG})")
    parser.add_argument("--jobs", type=int, default=2, help="trainings side by side (2)")
    parser.add_argument(
        "--repetitions", type=int, default=repetitions, help=f"seeds of each ({repetitions})"
    )
    parser.add_argument("--samples", type=int, help="images shown, else as the benchmark has it")
    parser.add_argument(
        "--out", type=Path, default=OUT / module, help=f"without ending ({OUT / module})"
    )
    return parser


def run(
    options: argparse.Namespace,
    trainings_of: Callable[[Config, argparse.Namespace], Sequence[Training]],
    write: Callable[[Config, argparse.Namespace, list[Row]], None],
) -> int:
    """Make what the table lacks, then write the page: exit status of the command."""

    def action() -> None:
        config, table = load_config(options.config), options.out.with_suffix(".csv")
        trainings = trainings_of(config, options)
        rows = measure_missing(trainings, config, options.results, table, options.jobs)
        write(config, options, rows)

    return exit_status(action, "rows that were measured are kept; the same command goes on")


def chosen(rows: Iterable[Row], **values: object) -> list[Row]:
    """Rows whose columns have these values."""
    wanted = {name: str(value) for name, value in values.items()}
    return [row for row in rows if wanted.items() <= row.items()]


def numbers(rows: Iterable[Row], column: str) -> list[float]:
    """A column."""
    return [float(row[column]) for row in rows]


def with_range(values: Sequence[float], digits: int) -> str:
    """Mean, and the least and the largest where there are several."""
    text = f"{mean(values):.{digits}f}"
    if len(values) == 1:
        return text
    return f"{text} ({min(values):.{digits}f} – {max(values):.{digits}f})"


def write_page(
    path: Path, title: str, notes: str, columns: Sequence[str], lines: Iterable[Sequence[str]]
) -> None:
    """A Markdown page with one table."""
    table = [columns, ["---"] * len(columns), *lines]
    text = "\n".join(f"| {' | '.join(cells)} |" for cells in table)
    with atomic_path(path) as temporary:
        temporary.write_text(f"# `{title}`\n\n{notes}\n\n{text}\n", encoding="utf-8")
