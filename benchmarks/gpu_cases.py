"""Training steps that :mod:`benchmarks.gpu` measures, and what it finds; free of torch."""

from __future__ import annotations

from typing import Literal, NamedTuple

from baselines.config.learning import ModelName


class Case(NamedTuple):
    """Training steps to measure.

    Attributes:
        localizer: Name of the localizer.
        input_px: Side of the images.
        width: Factor on the channels.
        batch: Images per step.
        step: Kind of step: as training takes it on a GPU, or one operation after the other.
        randomised: Images are shown under random light, lens and sensor.
        rotated: Images are turned at random.
        processes: Processes that do the same at the same time.
    """

    localizer: ModelName
    input_px: int = 224
    width: float = 1.0
    batch: int = 45
    step: Literal["plain", "captured"] = "captured"
    randomised: bool = False
    rotated: bool = False
    processes: int = 1


class Rate(NamedTuple):
    """Rate of a case, of all its processes together.

    Attributes:
        images_per_s: Images learned from in a second.
        step_ms: Duration of a step, of the slowest process.
        memory_mb: Most memory that one process held on the GPU.
    """

    images_per_s: float
    step_ms: float
    memory_mb: float


class Machine(NamedTuple):
    """Machine and code that were measured.

    Attributes:
        card: Name of the GPU; ``processor`` without one.
        driver: Version of its driver; empty without one.
        torch: Version of PyTorch.
        commit: Commit of the code.
    """

    card: str
    driver: str
    torch: str
    commit: str


# The paper's networks, then what changes their rates, most important first.
CASES = (
    Case("posenet2"),
    Case("posenet2", batch=256),
    Case("posenet2", step="plain"),
    Case("posenet2", batch=256, step="plain"),
    Case("posenet2", randomised=True),
    Case("posenet2", batch=256, randomised=True),
    Case("posenet2", randomised=True, rotated=True),
    Case("posenet"),
    Case("poselstm"),
    Case("hourglass"),
    Case("posenet2resnet"),
    Case("posenet2", input_px=64, width=0.25, batch=64),
    Case("posenet2", input_px=64, width=0.25, batch=64, randomised=True),
    Case("posenet2", input_px=64, width=0.25, batch=64, step="plain"),
    Case("posenet2", input_px=64, width=0.25, batch=64, processes=4),
    Case("posenet2", processes=2),
    Case("posenet2", processes=4),
)
TOY_CASES = (
    Case("posenet2", input_px=32, width=0.125, batch=4, step="plain"),
    Case("posenet2", input_px=32, width=0.125, batch=4, randomised=True, rotated=True),
    Case("posenet2", input_px=32, width=0.125, batch=4, processes=2),
)
