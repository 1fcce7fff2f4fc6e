"""Progress of a training run: its history, and the best weights on held-out frames."""

from __future__ import annotations

import logging
import math
import time
from pathlib import Path
from typing import Any, Literal, NamedTuple

import torch
from torch import Tensor, nn

from baselines.localizers.base import Localizer
from baselines.localizers.losses import PosePrediction, quat_chords
from baselines.training.data import ImageStatistics, LabelledFrames
from baselines.training.device import Precision, autocast
from synfeal.records.tables import write_numbers

log = logging.getLogger(__name__)

# Evaluations of a run. Validation takes at most this share of its time, if predicting takes
# a third of the time of learning, and is looked at less often where that is not enough.
EVALUATIONS = 20
TIME_SHARE = 0.05
PREDICTIONS_PER_SAMPLE = 3
# Images per prediction.
BATCH = 100


SelectionKind = Literal["validation", "test", "last", "averaged"]


class HeldOutErrors(NamedTuple):
    """Loss of the main predictions, and median errors."""

    loss: float
    position_m: float
    orientation_deg: float

    def score(self, selection: SelectionKind) -> float:
        """Return the selection criterion; lower is better.

        ``test``: the loss, as the paper's authors do. ``validation``: the product of the two median
        errors. No unit and no weight enters, so losses whose weights are learned can be compared
        over a run; it is smallest where the sum of logarithms is, which is what the loss with
        learned weights comes to at its best weights (Kendall and Cipolla, CVPR 2017, eq. 4).
        """
        return self.loss if selection == "test" else self.position_m * self.orientation_deg


class Selection:
    """Looks at held-out frames now and then, and keeps the best weights."""

    def __init__(
        self,
        kind: SelectionKind,
        localizer: Localizer,
        statistics: ImageStatistics,
        held_out: LabelledFrames | None,
        precision: Precision,
    ) -> None:
        self._kind, self._localizer, self._statistics = kind, localizer, statistics
        self._held_out, self._precision = held_out, precision
        self._best: dict[str, Tensor] = {}
        self._score, self._since_best = math.inf, 0

    def due_after(self, steps: int, samples_seen: int) -> frozenset[int]:
        """List the steps after which to evaluate: evenly spread, the last one among them."""
        if self._kind == "last" or not self._held_out:
            return frozenset()
        allowed = TIME_SHARE * PREDICTIONS_PER_SAMPLE * samples_seen / len(self._held_out)
        count = EVALUATIONS if self._kind == "test" else min(EVALUATIONS, max(1, int(allowed)))
        return frozenset(-(-steps * k // count) for k in range(1, count + 1))

    def evaluate(self) -> HeldOutErrors:
        """Compute the errors on the held-out frames; keep the weights if there were no better ones.

        With ``averaged`` no weights are kept.
        """
        assert self._kind != "last"
        assert self._held_out is not None
        errors = held_out_errors(self._localizer, self._held_out, self._statistics, self._precision)
        score = errors.score(self._kind)
        self._since_best += 1
        if self._kind != "averaged" and score < self._score:  # never true of NaN
            self._score, self._since_best = score, 0
            self._best = {k: v.detach().clone() for k, v in self._localizer.state_dict().items()}
        return errors

    def stale(self, patience: int | None) -> bool:
        """Check for ``patience`` evaluations in a row without a new best."""
        return patience is not None and self._since_best >= patience

    def restore(self) -> None:
        """Give the localizer the best weights; the last ones where none were ever looked at."""
        if self._best:
            self._localizer.load_state_dict(self._best)

    def state_dict(self) -> dict[str, Any]:
        """Return the best weights so far."""
        return {"best": self._best, "score": self._score, "since_best": self._since_best}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on with the best weights of another selection."""
        self._best, self._score = state["best"], state["score"]
        self._since_best = state["since_best"]


@torch.no_grad()
def held_out_errors(
    localizer: Localizer, frames: LabelledFrames, statistics: ImageStatistics, precision: Precision
) -> HeldOutErrors:
    """Compute the errors of a localizer's main predictions on held-out frames.

    Args:
        localizer: Network, which is left in training mode.
        frames: Held-out frames with their labels, on the network's device.
        statistics: Statistics of the training images.
        precision: Precision of the forward pass.
    """
    localizer.eval()
    device = frames.images.device
    predictions: list[PosePrediction] = []
    for rows in torch.split(torch.arange(len(frames), device=device), BATCH):
        with autocast(device, precision):
            predictions.append(localizer(statistics.normalise(frames.batch(rows).images))[0])
    localizer.train()
    position_m, quat_wxyz = (torch.cat(values).float() for values in zip(*predictions, strict=True))
    loss = localizer.criterion(
        PosePrediction(position_m, quat_wxyz), frames.position_m, frames.quat_wxyz
    )
    distance_m = torch.linalg.vector_norm(position_m - frames.position_m, dim=1)
    chord = quat_chords(nn.functional.normalize(quat_wxyz, dim=1), frames.quat_wxyz)
    angle_rad = 4 * torch.asin((chord / 2).clamp(max=1.0))
    return HeldOutErrors(float(loss), _median(distance_m), math.degrees(_median(angle_rad)))


def _median(values: Tensor) -> float:
    return float(values.quantile(0.5))


# Seconds between progress lines, and rows of the history of a training run (evaluations add rows).
LOG_EVERY_S = 5.0
HISTORY_ROWS = 50


class HistoryRow(NamedTuple):
    """Mean loss since the row before, and the errors on held-out frames where they were looked at.

    Held out are validation paths or, with the published protocol, the test set.
    """

    samples_seen: int
    loss: float
    learning_rate: float
    held_out_loss: float | None = None
    held_out_position_m: float | None = None
    held_out_orientation_deg: float | None = None


class TrainingProgress:
    """Collects the history and says every few seconds how far the training run is."""

    def __init__(self, steps: int, batch_size: int, device: torch.device) -> None:
        self.rows: list[HistoryRow] = []
        self.done = 0
        self._steps, self._batch_size, self._device = steps, batch_size, device
        self._every = max(1, steps // HISTORY_ROWS)
        self._losses: list[Tensor] = []
        self._done_before = 0
        self._start = self._said = time.monotonic()

    @property
    def diverged(self) -> bool:
        """Check whether the loss has stopped being finite."""
        return bool(self.rows) and not math.isfinite(self.rows[-1].loss)

    @property
    def ended(self) -> bool:
        """Check whether all steps are done, or further ones are pointless."""
        return self.done == self._steps or self.diverged

    def add(self, loss: Tensor) -> None:
        """Note one step. Losses stay on the device until a row is due: a GPU is not waited for."""
        self._losses.append(loss.detach())
        self.done += 1

    def end_step(self, learning_rate: float, errors: HeldOutErrors | None) -> None:
        """Write a row of the history where one is due, or where there are errors to note."""
        if errors is None and self.done % self._every and self.done != self._steps:
            return
        mean = float(torch.stack(self._losses).mean())
        self._losses.clear()
        row = _with_errors(HistoryRow(self.done * self._batch_size, mean, learning_rate), errors)
        self.rows.append(row)
        self._say(row)
        if self.diverged:
            log.warning("the loss is %s after %d steps: training stops", mean, self.done)

    def _say(self, row: HistoryRow) -> None:
        now = time.monotonic()
        if now - self._said < LOG_EVERY_S and self.done != self._steps:
            return
        self._said = now
        steps_per_s = (self.done - self._done_before) / max(now - self._start, 1e-9)
        log.info(
            "%d of %d samples, loss %.4f%s, learning rate %.1e, %.0f samples/s, %.0f s left",
            row.samples_seen,
            self._steps * self._batch_size,
            row.loss,
            self._held_out_text(),
            row.learning_rate,
            steps_per_s * self._batch_size,
            (self._steps - self.done) / steps_per_s,
        )

    def _held_out_text(self) -> str:
        """Return the errors on held-out frames when they were last looked at."""
        looked_at = [row for row in self.rows if row.held_out_position_m is not None]
        if not looked_at:
            return ""
        last = looked_at[-1]
        return f", held out {last.held_out_position_m:.3f} m/{last.held_out_orientation_deg:.1f}°"

    def end(self, errors: HeldOutErrors | None) -> None:
        """Note the errors of the weights that are kept, where these are not the last ones."""
        if errors is not None and self.rows:
            self.rows[-1] = _with_errors(self.rows[-1], errors)

    def state_dict(self) -> dict[str, Any]:
        """Return the rows of the history, the steps done, and losses not yet in a row."""
        rows = [tuple(row) for row in self.rows]
        return {"rows": rows, "done": self.done, "losses": list(self._losses)}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Go on with another history."""
        self.rows = [HistoryRow(*row) for row in state["rows"]]
        self.done = self._done_before = state["done"]
        self._losses = [loss.to(self._device) for loss in state["losses"]]


def _with_errors(row: HistoryRow, errors: HeldOutErrors | None) -> HistoryRow:
    """Return a row with other errors on held-out frames; itself where there are none."""
    if errors is None:
        return row
    return row._replace(
        held_out_loss=errors.loss,
        held_out_position_m=errors.position_m,
        held_out_orientation_deg=errors.orientation_deg,
    )


def kept_errors(rows: list[HistoryRow]) -> HeldOutErrors | None:
    """Return the errors on held-out frames at the end of a run that kept no earlier weights.

    None where nothing was held out.
    """
    _, _, _, loss, position_m, orientation_deg = rows[-1]
    if loss is None or position_m is None or orientation_deg is None:
        return None
    return HeldOutErrors(loss, position_m, orientation_deg)


def write_history(path: Path, rows: list[HistoryRow]) -> None:
    """Write the history as CSV, a column per field; empty: not looked at, or no number."""
    cells = [["" if value is None or math.isnan(value) else value for value in row] for row in rows]
    write_numbers(path, ",".join(HistoryRow._fields), cells)
