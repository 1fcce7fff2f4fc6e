"""Effects that the claims assert, computed from a run, from a replication, or from the paper.

All are differences of logarithms of median errors: positive where an error is larger, adding where
factors multiply, the mean over localizers being a geometric mean of their ratios. The same
functions read the paper's tables, so that an effect and its printed counterpart mean the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property, partial
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
import pandas as pd

from reproduction.claims.evidence import COMMON, QUANTITIES, Cell
from reproduction.design.experiments import SHARES
from reproduction.tables.cells import published_frame
from synfeal.evaluation.bootstrap import Array
from synfeal.records.tables import rows_of

PAPERS_FIVE = ("posenet", "poselstm", "hourglass", "posenet2resnet", "posenet2")
RIVALS = ("sfm", "rgbd-toro", "rgbd-g2o")
TURNED, MOVED, BOTH = "noise-p0-r20", "noise-p0.3-r0", "noise-p0.3-r20"
SIZES = {"large_room": ("6k", "80k"), "sanctuary": ("6k", "95k")}
# Shares of the images after which Table 7 has errors, by how `init` ends.
LENGTHS = {f"-{name}" if name else "": share for name, share in SHARES.items()}
# A cell's own test set, whose labels the cell's method made; the other one is ``COMMON``.
OWN = "own"
Against = Literal["labels", "true"]
# Size: two thirds of the printed effect. Direction: 5 %. Order: by however little.
Asked = Literal["size", "direction", "order"]


class Effect(NamedTuple):
    """One effect of a claim."""

    claim: str
    part: str
    quantity: str  # position or orientation, or what else is compared
    against: Against
    asked: Asked
    sign: int  # that the paper claims: 1 where errors, or images, become more
    sample: Array  # (1 + B,) logarithm of a ratio: observed, then as its source varies
    compares: bool = False  # two effects of the claim, of which it tells neither


class Source(Protocol):
    """Errors of cells, as logarithms."""

    def log_errors(self, cell: Cell, test_set: str, against: Against) -> Array:
        """Return logarithms (2, 1 + B) of the median position and orientation error of a cell."""


def printed_cell(row: Any) -> Cell:
    """Return the localizer that a row of the paper's tables is about."""
    noise = f"noise-p{row.noise_m:g}-r{row.noise_deg:g}"
    labels = noise if row.labels == "noise" else row.labels
    return Cell(row.model, row.scene, row.size, labels, row.init)


class Printed:
    """Tables 2 to 5 of the paper."""

    @cached_property
    def _cells(self) -> dict[Cell, tuple[float, float]]:
        names = ("table2_ground_truth", "table3_inconsistencies", "table4_size")
        frames = [published_frame(name) for name in (*names, "table5_from_scratch")]
        found = {}
        for row in rows_of(pd.concat(frames)):
            found[printed_cell(row)] = (row.position_m, row.orientation_deg)
        return found

    def log_errors(self, cell: Cell, test_set: str, against: Against) -> Array:
        """Return logarithms (2, 1) of the printed errors; their unit does not matter to ratios."""
        logs: Array = np.log(np.array([self._cells[cell]]).T)
        return logs


def _label_ratio(source: Source, against: Against, new: Cell, old: Cell) -> Array:
    """Compare two label sets, or two networks on one, on the test labels of each (2, 1 + B)."""
    return source.log_errors(new, OWN, against) - source.log_errors(old, OWN, against)


def _mean_label_ratio(source: Source, against: Against, labels: str, instead_of: str) -> Array:
    pairs = [(Cell(m, labels=labels), Cell(m, labels=instead_of)) for m in PAPERS_FIVE]
    ratios = [_label_ratio(source, against, *pair) for pair in pairs]
    return np.asarray(np.mean(ratios, axis=0))


def exact_labels(source: Source, against: Against) -> Iterator[Effect]:
    """Yield the effects of exact labels in place of each rival's, mean over the localizers (C1)."""
    for rival in RIVALS:
        found = _mean_label_ratio(source, against, "synfeal", rival)
        for quantity, sample in zip(QUANTITIES, found, strict=True):
            yield Effect(
                "C1", f"exact labels, not {rival}", quantity, against, "direction", -1, sample
            )


def better_labels(source: Source, against: Against) -> Iterator[Effect]:
    """Yield the effects of exact labels in place of SfM's on PoseNet2 (C2)."""
    found = _label_ratio(source, against, Cell("posenet2"), Cell("posenet2", labels="sfm"))
    for quantity, sample in zip(QUANTITIES, found, strict=True):
        yield Effect("C2", "exact labels, not sfm", quantity, against, "size", -1, sample)


def labels_or_model(source: Source, against: Against) -> Iterator[Effect]:
    """Yield the effects of better labels, of a newer model, and their difference (C3).

    Without the first two the claim could hold because the newer model is worse.
    """
    better = _label_ratio(source, against, Cell("posenet2"), Cell("posenet2", labels="sfm"))
    newer = _label_ratio(source, against, Cell("posenet2"), Cell("posenet"))
    for quantity, by_labels, by_model in zip(QUANTITIES, better, newer, strict=True):
        parts = {
            "better labels": by_labels,
            "newer model": by_model,
            "labels more than model": by_labels - by_model,
        }
        for part, sample in parts.items():
            compares = part == "labels more than model"
            yield Effect("C3", part, quantity, against, "direction", -1, sample, compares)


def kinds_of_noise(source: Source, against: Against) -> Iterator[Effect]:
    """Yield the effects of each kind of noise on the error it names, and more than on the other.

    Noise of both kinds is asked to raise both (C5).
    """
    turned, moved, both = (
        _mean_label_ratio(source, against, labels, "synfeal") for labels in (TURNED, MOVED, BOTH)
    )
    for part, quantity, sample in (
        ("orientation noise", "orientation", turned[1]),
        ("orientation noise, more than on position", "orientation", turned[1] - turned[0]),
        ("position noise", "position", moved[0]),
        ("position noise, more than on orientation", "position", moved[0] - moved[1]),
        ("both", "position", both[0]),
        ("both", "orientation", both[1]),
    ):
        compares = "more than" in part
        yield Effect("C5", part, quantity, against, "direction", 1, sample, compares)


def most_noise(source: Source, against: Against) -> Iterator[Effect]:
    """Yield the effects of no noise in place of the most on PoseNet2, the base as in print (C6)."""
    clean = _label_ratio(source, against, Cell("posenet2"), Cell("posenet2", labels=BOTH))
    for quantity, sample in zip(QUANTITIES, clean, strict=True):
        yield Effect("C6", "no noise, not the most", quantity, against, "size", -1, sample)


def _on_common(source: Source, cell: Cell) -> Array:
    return source.log_errors(cell, COMMON, "true")


def more_frames(source: Source, against: Against, claim: str, scene: str) -> Iterator[Effect]:
    """Yield the effects of the largest data set in place of the smallest (C7, C8)."""
    small, large = SIZES[scene]
    changes = [
        _on_common(source, Cell(model, scene, large))
        - _on_common(source, Cell(model, scene, small))
        for model in PAPERS_FIVE
    ]
    for quantity, sample in zip(QUANTITIES, np.mean(changes, axis=0), strict=True):
        yield Effect(claim, f"{large}, not {small}", quantity, against, "size", -1, sample)


def _from_scratch(source: Source, size: str) -> Array:
    """Compare training from scratch with transfer learning, by localizer (5, 2, 1 + B)."""
    return np.array(
        [
            _on_common(source, Cell(model, size=size, init="scratch"))
            - _on_common(source, Cell(model, size=size))
            for model in PAPERS_FIVE
        ]
    )


def scratch_when_small(source: Source, against: Against) -> Iterator[Effect]:
    """Yield the effects of training from scratch on small sets, mean over the localizers (C10)."""
    for size in ("6k", "20k"):
        found = _from_scratch(source, size).mean(axis=0)
        for quantity, sample in zip(QUANTITIES, found, strict=True):
            yield Effect("C10", f"from scratch, {size}", quantity, against, "direction", 1, sample)


def scratch_when_large(source: Source, against: Against) -> Iterator[Effect]:
    """Yield the effects of training from scratch on the largest set, by localizer (C11).

    The third best of the five is not looked for within a run: the best of several noisy numbers is
    better than any of them deserves.
    """
    for model, both in zip(PAPERS_FIVE, _from_scratch(source, "80k"), strict=True):
        for quantity, sample in zip(QUANTITIES, both, strict=True):
            part = f"{model}, from scratch, 80k"
            yield Effect("C11", part, quantity, against, "order", -1, sample)


def best_of_all(source: Source, against: Against) -> Iterator[Effect]:
    """Yield PoseNet2 from scratch at 80k against every other cell, by position error (C12)."""
    claimed = Cell("posenet2", size="80k", init="scratch")
    own = _on_common(source, claimed)[0]
    for init in ("pretrained", "scratch"):
        for size in ("6k", "20k", "80k"):
            for model in PAPERS_FIVE:
                rival = Cell(model, size=size, init=init)
                if rival != claimed:
                    name = f"not {model}, {init}, {size}"
                    sample = own - _on_common(source, rival)[0]
                    yield Effect("C12", name, "position", against, "order", -1, sample)


def longer_training(source: Source, against: Against) -> Iterator[Effect]:
    """Yield the images that have to be shown from scratch for the errors after transfer (C13)."""
    logs = []
    for model in PAPERS_FIVE:
        old, new = (
            np.array(
                [
                    _on_common(source, Cell(model, init=f"{start}{end}")).mean(axis=0)
                    for end in LENGTHS
                ]
            )
            for start in ("pretrained", "scratch")
        )
        logs.append(images_ratio(new, old))
    yield Effect("C13", "from scratch", "images", against, "size", 1, np.mean(logs, axis=0))


def images_ratio(new: Array, old: Array) -> Array:
    """Measure the distance of two learning curves along the images, as a logarithm (B,).

    Errors fall about as a power of the images shown. Lines of one slope, the mean of both, are put
    through the logarithms of errors and images; not a number where they do not fall. Runs are
    compared that were trained to their end, each with its own course of the learning rate: within
    one run most of the gain comes when the rate falls, at the same place from whatever start.

    Args:
        new: Logarithms (L, B) of the errors after each share of the images in ``LENGTHS``.
        old: The same of the runs that they are compared with.
    """
    images = np.log(list(LENGTHS.values()))
    images -= images.mean()
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = images @ (new + old) / 2 / (images @ images)
        return np.where(slope < 0, (new.mean(axis=0) - old.mean(axis=0)) / -slope, np.nan)


NETWORKS, IMAGES = "networks", "images"
# What is described and belongs to no claim.
DESCRIBED = (NETWORKS, IMAGES)
# Judged like a claim, though the paper prints an order of networks without a sentence on it.
BEST_NETWORK = "best network"
PRINTED_BEST = "posenet2"  # by position, in all rows of Table 4


def networks(source: Source, against: Against) -> Iterator[Effect]:
    """Yield the error of each network over the geometric mean of the five, over rows of Table 4."""
    logs = _over_sizes(source)
    for model, samples in zip(PAPERS_FIVE, logs - logs.mean(axis=0), strict=True):
        for quantity, sample in zip(QUANTITIES, samples, strict=True):
            yield Effect(NETWORKS, model, quantity, against, "order", 1, sample)


def best_network(source: Source, against: Against) -> Iterator[Effect]:
    """Yield the network that is best in print against each other one, by position error."""
    own = dict(zip(PAPERS_FIVE, _over_sizes(source), strict=True))
    for rival in PAPERS_FIVE:
        if rival != PRINTED_BEST:
            sample = own[PRINTED_BEST][0] - own[rival][0]
            yield Effect(BEST_NETWORK, f"not {rival}", "position", against, "order", -1, sample)


def _over_sizes(source: Source) -> Array:
    """Average each network over the four rows of Table 4 that C7 and C8 compare (5, 2, 1 + B)."""
    rows = [(scene, size) for scene, ends in SIZES.items() for size in ends]
    logs = [[_on_common(source, Cell(m, *row)) for row in rows] for m in PAPERS_FIVE]
    return np.asarray(np.mean(logs, axis=1))


def more_images(source: Source, against: Against) -> Iterator[Effect]:
    """Yield the effects of showing the smallest set twice as often, mean over the localizers.

    Larger sets are shown more images, too, so that this stands beside what their frames do.
    """
    ratios = [
        _on_common(source, Cell(model)) - _on_common(source, Cell(model, init="pretrained-half"))
        for model in PAPERS_FIVE
    ]
    for quantity, sample in zip(QUANTITIES, np.mean(ratios, axis=0), strict=True):
        yield Effect(IMAGES, "twice the images", quantity, against, "direction", -1, sample)


Effects = Callable[[Source, Against], Iterator[Effect]]
# Judged against the test labels, and once more against the true poses.
ABOUT_LABELS: Mapping[str, Effects] = {
    "C1": exact_labels,
    "C2": better_labels,
    "C3": labels_or_model,
    "C5": kinds_of_noise,
    "C6": most_noise,
}
# Judged where labels are the truth.
ABOUT_TRAINING: Mapping[str, Effects] = {
    "C7": partial(more_frames, claim="C7", scene="large_room"),
    "C8": partial(more_frames, claim="C8", scene="sanctuary"),
    "C10": scratch_when_small,
    "C11": scratch_when_large,
    "C12": best_of_all,
    "C13": longer_training,
    NETWORKS: networks,
    BEST_NETWORK: best_network,
    IMAGES: more_images,
}
EVERY_EFFECT: tuple[tuple[str, Against, Effects], ...] = (
    *((claim, "labels", effects) for claim, effects in ABOUT_LABELS.items()),
    *((claim, "true", effects) for claim, effects in ABOUT_LABELS.items()),
    *((claim, "true", effects) for claim, effects in ABOUT_TRAINING.items()),
)
PRINTED_HOURS = {"scratch": 114.0, "pretrained": 72.0}  # section 4.4


def printed_effects() -> dict[tuple[str, str, str, Against], float]:
    """Compute each effect, by claim, part, quantity and score, from the printed tables."""
    printed = Printed()
    found: dict[tuple[str, str, str, Against], float] = {
        effect[:4]: float(effect.sample[0])
        for claim, against, effects in EVERY_EFFECT
        if claim not in ("C13", IMAGES)  # of images, which the paper tells as hours, or not at all
        for effect in effects(printed, against)
    }
    hours = float(np.log(PRINTED_HOURS["scratch"] / PRINTED_HOURS["pretrained"]))
    return {**found, ("C13", "from scratch", "images", "true"): hours}


def effects_of(source: Source) -> list[Effect]:
    """Compute every effect of a source that has all cells; not a number where two failed."""
    with np.errstate(invalid="ignore"):
        return [e for _, against, effects in EVERY_EFFECT for e in effects(source, against)]
