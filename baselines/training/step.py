"""A training step: as it reads, and captured in a CUDA graph.

A step of a narrow network is two thousand small kernels, which a processor starts more slowly than
a GPU carries them out. A CUDA graph holds all of them and is started at once. It repeats what it
recorded to the letter: on the same memory, with the same numbers wherever these came from the
processor. So what changes from step to step lies in tensors of the device: the frames to learn
from, the learning rates, and the states of the generators. Nothing in a step copies from the
processor or waits for the device.

:class:`PlainStep` says what a step does. :class:`CapturedStep` takes the same step from a recording
of it, and differs in nothing but rounding.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import torch
from torch import Tensor

from baselines.localizers.base import Localizer
from baselines.training.data import ImageStatistics, LabelledFrames
from baselines.training.device import Precision, autocast
from baselines.training.optimizer import Optimisation
from baselines.training.resume import Restorable

log = logging.getLogger(__name__)

# Steps before the recording. In the first ones optimisers make their momenta, and libraries choose
# among algorithms, neither of which may be recorded.
WARM_UP_STEPS = 3


class Randomisation(Restorable, Protocol):
    """Changes how images look before they are normalised; its state is its generator's."""

    generator: torch.Generator

    def __call__(self, images: Tensor, /) -> Tensor:
        """Randomise images (B, 3, H, W) uint8 to float grey levels (B, 3, H, W)."""


class Augmentation(Restorable, Protocol):
    """Changes training images and the labels with them; its state is where its generator stands."""

    generator: torch.Generator

    def __call__(self, images: Tensor, quat_wxyz: Tensor) -> tuple[Tensor, Tensor]:
        """Augment images (B, 3, H, W), normalised, and their unit quaternions (B, 4)."""


class TrainingStep(Protocol):
    """Takes one step of a training run."""

    def __call__(self, chosen: Tensor) -> Tensor:
        """Learn from the frames with these indices (B,), and return the loss, a scalar."""


@dataclass
class PlainStep:
    """A training step, one operation after the other.

    Attributes:
        localizer: Localizer in training mode, on the device of the frames.
        frames: Frames to learn from.
        statistics: Statistics of the images.
        optimisation: Optimisers with their rates.
        precision: Precision of the network; losses and weights are float32.
        randomise: Changes each batch of images before it is normalised.
        augment: Changes each batch of normalised images, and its labels.
    """

    localizer: Localizer
    frames: LabelledFrames
    statistics: ImageStatistics
    optimisation: Optimisation
    precision: Precision
    randomise: Randomisation | None
    augment: Augmentation | None

    def __call__(self, chosen: Tensor) -> Tensor:
        """Learn from the frames with these indices (B,), and return the loss, a scalar."""
        loss = self.on_device(chosen)
        self.optimisation.advance()
        return loss

    def on_device(self, chosen: Tensor) -> Tensor:
        """Do the part of a step in which the processor decides nothing, and return the loss."""
        images, position_m, quat_wxyz = self.frames.batch(chosen)
        if self.randomise is not None:
            images = self.randomise(images)
        normalised = self.statistics.normalise(images)
        if self.augment is not None:
            normalised, quat_wxyz = self.augment(normalised, quat_wxyz)
        with autocast(chosen.device, self.precision):
            predictions = self.localizer(normalised)
        loss = self.localizer.loss(predictions, position_m, quat_wxyz)
        self.optimisation.descend(loss)
        return loss.detach()

    @property
    def generators(self) -> list[torch.Generator]:
        """The run's own generators, beside torch's global one that dropout draws from."""
        drawing = (self.randomise, self.augment)
        return [part.generator for part in drawing if part is not None]


Work = Callable[[], Tensor]


class Recorder(Protocol):
    """Records work on a device, to be repeated as it was recorded."""

    def warm_up(self, work: Work) -> Tensor:
        """Do work that will be recorded later, and return its result."""

    def record(self, work: Work) -> Work:
        """Record work without doing it; return what does it, into one and the same tensor."""


class CapturedStep:
    """A training step that is recorded once and repeated.

    Args:
        plain: The step.
        recorder: Records it.
    """

    def __init__(self, plain: PlainStep, recorder: Recorder) -> None:
        self._plain, self._recorder = plain, recorder
        self._chosen: Tensor | None = None
        self._warm = 0
        self._repeat: Work | None = None

    def __call__(self, chosen: Tensor) -> Tensor:
        """Learn from the frames with these indices (B,), and return the loss, a scalar."""
        loss = self._loss_of(self._held(chosen))
        self._plain.optimisation.advance()
        return loss

    def _held(self, chosen: Tensor) -> Tensor:
        """Copy indices to the tensor that is recorded."""
        if self._chosen is None:
            self._chosen = torch.empty_like(chosen)
        return self._chosen.copy_(chosen)

    def _loss_of(self, held: Tensor) -> Tensor:
        def work() -> Tensor:
            return self._plain.on_device(held)

        if self._warm < WARM_UP_STEPS:
            self._warm += 1
            return self._recorder.warm_up(work)
        if self._repeat is None:
            self._repeat = self._recorder.record(work)
        return self._repeat().clone()  # the next step writes the same tensor


class CudaRecorder:
    """Records work in a CUDA graph.

    Where the device's libraries cannot be recorded, it says so and does the work plainly.

    Args:
        device: GPU that works.
        generators: Generators on it that the work draws from, beside torch's global one.
    """

    def __init__(self, device: torch.device, generators: Sequence[torch.Generator]) -> None:
        self._device = device
        self._generators = list(generators)
        self._stream = torch.cuda.Stream(device)  # type: ignore[no-untyped-call]

    def warm_up(self, work: Work) -> Tensor:
        """Do the work on the stream that will record: gradients are tied to their first stream."""
        outside = torch.cuda.current_stream(self._device)
        self._stream.wait_stream(outside)
        with torch.cuda.stream(self._stream):
            result = work()
        outside.wait_stream(self._stream)
        result.record_stream(outside)
        return result

    def record(self, work: Work) -> Work:
        """Record work without doing it; return what does it, into one and the same tensor."""
        drawing = [*self._generators, self._global_generator()]
        before = [generator.clone_state() for generator in drawing]
        graph = torch.cuda.CUDAGraph()
        for generator in self._generators:
            graph.register_generator_state(generator)
        outside = torch.cuda.current_stream(self._device)
        try:
            # The outer context comes back to its stream where a failure leaves the inner one open.
            with torch.cuda.stream(outside), torch.cuda.graph(graph, stream=self._stream):
                result = work()
        except torch.OutOfMemoryError:
            raise
        except RuntimeError as error:
            log.warning("steps are taken one operation at a time, because %s", _first_line(error))
            for generator, state in zip(drawing, before, strict=True):
                generator.graphsafe_set_state(state)  # one that was recording refuses to draw
            return lambda: self.warm_up(work)

        def repeat() -> Tensor:
            graph.replay()
            return result

        return repeat

    def _global_generator(self) -> torch.Generator:
        index = self._device.index
        return torch.cuda.default_generators[
            torch.cuda.current_device() if index is None else index
        ]


def _first_line(error: RuntimeError) -> str:
    return str(error).partition("\n")[0]


def training_step(plain: PlainStep) -> TrainingStep:
    """Return the step for the device of the frames: captured on a GPU, plain on a processor."""
    device = plain.frames.images.device
    if device.type != "cuda":
        return plain
    torch.backends.cudnn.benchmark = True  # convolutions of one shape, many times
    return CapturedStep(plain, CudaRecorder(device, plain.generators))
