"""Resuming of interrupted training runs, with the same result as without the interruption."""

from __future__ import annotations

import hashlib
import io
import logging
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

import torch
from torch import Tensor

from synfeal.errors import why
from synfeal.records.files import UNFINISHED, atomic_path

log = logging.getLogger(__name__)

RESUME_EVERY_S = 60.0
# Raised when a step is computed otherwise: a run must not begin with one kind and end with another.
STEP_VERSION = 3
DIGEST_BYTES = 32
# Handlers that stay: whoever ignores a signal wants it ignored.
UNTOUCHED = (signal.SIG_IGN, None)


class Restorable(Protocol):
    """Part of a training run whose state is tensors and plain values."""

    def state_dict(self) -> Mapping[str, Any]:
        """Return the state as it is now."""

    def load_state_dict(self, state: Any, /) -> Any:
        """Take over a state."""


class ResumeFile:
    """The state of a training run on disk; without ``path`` nothing is kept.

    A damaged file, or one of another training run, is ignored and said so. Its last bytes are the
    SHA-256 of the others, because ``torch.load`` does not notice changed values.
    """

    def __init__(self, path: Path | None, fingerprint: str) -> None:
        self._path, self._fingerprint = path, f"{fingerprint}-{STEP_VERSION}"
        self._saved = time.monotonic()

    def load(self, parts: Mapping[str, Restorable]) -> None:
        """Give every part the state it had, if the file is of this training run."""
        content = self._read()
        if content is None:
            return
        for name, part in parts.items():
            part.load_state_dict(content["parts"][name])
        log.info("%s: the training run goes on where it was stopped", self._path)

    def save_if_due(self, parts: Mapping[str, Restorable], now: bool = False) -> None:
        """Write the state, if the last time is ``RESUME_EVERY_S`` ago, or ``now``."""
        if self._path is None or not (now or time.monotonic() - self._saved >= RESUME_EVERY_S):
            return
        states = {name: part.state_dict() for name, part in parts.items()}
        content = serialised({"fingerprint": self._fingerprint, "parts": states})
        with atomic_path(self._path) as temporary, temporary.open("wb") as file:
            file.write(content)
            file.write(hashlib.sha256(content).digest())
        self._saved = time.monotonic()

    def remove(self) -> None:
        """Remove the file once training is finished, and what a kill left of its making."""
        if self._path is not None:
            self._path.unlink(missing_ok=True)
            unfinished = f"{UNFINISHED}-*-{self._path.stem}-*{self._path.suffix}"
            for left in self._path.parent.glob(unfinished):
                left.unlink()

    def _read(self) -> dict[str, Any] | None:
        if self._path is None or not self._path.exists():
            return None
        try:
            content = self._path.read_bytes()
        except OSError as error:
            self._say_ignored(why(error))
            return None
        state, checksum = content[:-DIGEST_BYTES], content[-DIGEST_BYTES:]
        if hashlib.sha256(state).digest() != checksum:
            self._say_ignored("its checksum is wrong")
            return None
        # Whole, hence written by this class: an error from here on is no damage.
        found: dict[str, Any] = torch.load(io.BytesIO(state), "cpu", weights_only=True)
        if found["fingerprint"] != self._fingerprint:
            self._say_ignored("it is of another training run")
            return None
        return found

    def _say_ignored(self, reason: str) -> None:
        log.warning("%s: ignored, %s; training starts anew", self._path, reason)


class RandomState:
    """Torch's global generators, which dropout draws from."""

    def __init__(self, device: torch.device) -> None:
        self._device = device

    def state_dict(self) -> dict[str, Tensor]:
        """Return the states of the processor's generator and of the GPU's in use."""
        state = {"cpu": torch.get_rng_state()}
        if self._device.type == "cuda":
            state["cuda"] = torch.cuda.get_rng_state(self._device)
        return state

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Restore the generators."""
        torch.set_rng_state(state["cpu"])
        if self._device.type == "cuda":
            torch.cuda.set_rng_state(state["cuda"], self._device)


@contextmanager
def stop_signals() -> Iterator[Callable[[], bool]]:
    """Hold SIGTERM and SIGINT back, so that no step is cut in two.

    The first one takes its usual effect when the block ends; the block is never left as if none had
    come.

    Yields:
        A function that tells whether one has come.
    """
    received: list[int] = []
    numbers = [n for n in (signal.SIGTERM, signal.SIGINT) if signal.getsignal(n) not in UNTOUCHED]
    if threading.current_thread() is not threading.main_thread():
        numbers = []  # only the main thread may set handlers
    before = {n: signal.signal(n, lambda number, _: received.append(number)) for n in numbers}
    try:
        yield lambda: bool(received)
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        if received:
            signal.raise_signal(received[0])
            raise KeyboardInterrupt


def digest(*values: object) -> str:
    """Compute the SHA-256 of tensors and mappings by content, of the rest by its ``repr``."""
    total = hashlib.sha256()
    for value in values:
        _add(total, value)
    return total.hexdigest()


def _add(total: Any, value: object) -> None:
    if isinstance(value, Tensor):
        total.update(repr((value.dtype, value.shape)).encode())
        total.update(value.detach().cpu().numpy().tobytes())
    elif isinstance(value, Mapping):
        for key, item in value.items():
            _add(total, key)
            _add(total, item)
    else:
        total.update(repr(value).encode() + b"\x1f")


def serialised(value: Any) -> memoryview:
    """Serialise as ``torch.save`` does, in memory: the same value gives the same bytes.

    Writing to a path, torch puts the name of the file, here a temporary one, into every record, and
    what it says of a full disk is ``unexpected pos``.
    """
    buffer = io.BytesIO()
    torch.save(value, buffer)
    return buffer.getbuffer()
