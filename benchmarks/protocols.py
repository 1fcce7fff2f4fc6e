"""What each difference between the corrected and the published way to train is worth.

``python -m benchmarks.protocols --results results/mini`` trains PoseNet (fixed weight) and PoseNet2
(learned weights) on the Large Room, one part of the protocol exchanged at a time. Seeds, and with
them initial weights and held-out paths, are the same for all protocols.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator, Sequence
from itertools import product

from baselines.training.protocol import PROTOCOLS, Protocol
from benchmarks.training_pages import chosen, numbers, options_of, run, with_range, write_page
from benchmarks.trainings import Row, Training, training_of
from synfeal.config.models import Config, LocalizerConfig, ModelName

SIZE, SAMPLES, REPETITIONS = "20k", 8000, 3
MODELS: tuple[ModelName, ...] = ("posenet", "posenet2")
CORRECTED, PUBLISHED = PROTOCOLS["corrected"], PROTOCOLS["published"]
VARIANTS: dict[str, Protocol] = {
    "corrected": CORRECTED,
    "order: collected": CORRECTED._replace(order="collected"),
    "selection: last": CORRECTED._replace(selection="last"),
    "selection: test": CORRECTED._replace(selection="test"),
    "distance: mse": CORRECTED._replace(distance="mse"),
    "schedule: halving": CORRECTED._replace(schedule="halving"),
    "images: plain": CORRECTED._replace(images="plain"),
    "published": PUBLISHED,
}
# Where the two losses of a fixed weight are made to agree: errors as trainings of this size have.
AGREE_AT_M, AGREE_AT_DEG = 0.5, 10.0
MATCHED = ", beta matched"


def matched_beta(beta: float, position_m: float, orientation_deg: float) -> float:
    """The weight with mean squares that gives orientation the share it has with norms.

    At errors ``e`` and ``d = 2 sin(angle / 4)``, the distance of unit quaternions, norms weigh
    ``beta d`` against ``e``, mean squares ``beta' d^2 / 4`` against ``e^2 / 3``.
    """
    distance = 2 * math.sin(math.radians(orientation_deg) / 4)
    return beta * (4 * position_m) / (3 * distance)


def variants_of(
    model: ModelName, hyper: LocalizerConfig
) -> Iterator[tuple[str, Protocol, LocalizerConfig]]:
    """Name, protocol and hyper-parameters; with a fixed weight mean squares also have their own."""
    for name, protocol in VARIANTS.items():
        yield name, protocol, hyper
        if protocol.distance == "mse" and hyper.beta is not None:
            beta = matched_beta(hyper.beta, AGREE_AT_M, AGREE_AT_DEG)
            yield name + MATCHED, protocol, hyper.model_copy(update={"beta": beta})


def trainings(config: Config, options: argparse.Namespace) -> list[Training]:
    """All trainings, one repetition after the other."""
    found = []
    for repetition, model in product(range(options.repetitions), MODELS):
        base = training_of(
            config,
            options.results,
            model,
            SIZE,
            "pretrained",
            repetition,
            options.samples or SAMPLES,
        )
        for name, protocol, hyper in variants_of(model, config.localizers[model]):
            key = {"protocol": name, **base.key}
            found.append(base._replace(key=key, protocol=protocol, hyper=hyper))
    return found


def write(config: Config, options: argparse.Namespace, rows: list[Row]) -> None:
    """The page: a line for each localizer and protocol."""
    names = {
        model: dict.fromkeys(r["protocol"] for r in chosen(rows, model=model)) for model in MODELS
    }
    lines = [
        line_of(model, name, chosen(rows, model=model, protocol=name))
        for model in MODELS
        for name in (n for n, _, _ in variants_of(model, config.localizers[model]))
        if name in names[model]
    ]
    notes = (
        f"Large Room, {SIZE}, pretrained, {rows[0]['samples_seen']} images shown. Median errors on"
        " the test set against the true poses: mean over the seeds, in brackets the least and the"
        " largest. A line names what is exchanged in the corrected protocol; `published` exchanges"
        " all of these at once. Learning rates are the profile's in all"
        " lines. Rows that choose weights on the test set are scored on the same test set; they,"
        " and `selection: last`, learn from the paths that the others hold out."
        f" `{MATCHED.strip(', ')}`: PoseNet's weight of orientation times"
        f" {matched_beta(1, AGREE_AT_M, AGREE_AT_DEG):.1f}, with which mean squares weigh it"
        f" against position as norms do at {AGREE_AT_M:g} m and {AGREE_AT_DEG:g}°; the other rows"
        " keep the profile's."
    )
    columns = ("localizer", "protocol", "seeds", "position, m", "orientation, °")
    write_page(
        options.out.with_suffix(".md"), "python -m benchmarks.protocols", notes, columns, lines
    )


def line_of(model: str, name: str, rows: list[Row]) -> list[str]:
    """A line of the table."""
    position, orientation = (numbers(rows, c) for c in ("position_m", "orientation_deg"))
    return [model, name, str(len(rows)), with_range(position, 3), with_range(orientation, 2)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point: 0, or 1 with ``error: ...`` for what a person can mend."""
    parser = options_of("protocols", __doc__, REPETITIONS)
    return run(parser.parse_args(arguments), trainings, write)


if __name__ == "__main__":
    sys.exit(main())
