"""Recordings of torch's operations that repeat them as a CUDA graph does."""

import torch
from torch.utils._python_dispatch import TorchDispatchMode
from torch.utils._pytree import tree_flatten


class OpTape(TorchDispatchMode):
    """Records each operation with its arguments, and repeats all of them on the same memory.

    Numbers that came from Python are repeated as they were, results are written where they were
    written first, and generators go on: what a CUDA graph does, on a processor.
    """

    def __init__(self):
        super().__init__()
        self._operations = []

    def __torch_dispatch__(self, func, types, args=(), kwargs=None):
        kwargs = kwargs or {}
        result = func(*args, **kwargs)
        self._operations.append((func, args, kwargs, result))
        return result

    def repeat(self):
        for func, args, kwargs, first in self._operations:
            with torch._C._AutoDispatchBelowAutograd():  # as when they were recorded
                again = func(*args, **kwargs)
            for old, new in zip(tree_flatten(first)[0], tree_flatten(again)[0], strict=True):
                if isinstance(old, torch.Tensor) and old.data_ptr() != new.data_ptr():
                    with torch.no_grad():
                        old.copy_(new)


class TapeRecorder:
    """A :class:`baselines.training.step.Recorder` for a processor.

    Attributes:
        recordings: How many were made.
    """

    def __init__(self):
        self.recordings = 0

    def warm_up(self, work):
        return work()

    def record(self, work):
        self.recordings += 1
        tape, made = OpTape(), []

        def repeat():
            if made:
                tape.repeat()
            else:  # a processor does what it records
                with tape:
                    made.append(work())
            return made[0]

        return repeat


class OneDevice(TorchDispatchMode):
    """Notes operations that a CUDA graph cannot hold: those that join the processor to a device.

    Attributes:
        joining: Operations with tensors on more than one device.
    """

    def __init__(self):
        super().__init__()
        self.joining = []

    def __torch_dispatch__(self, func, types, args=(), kwargs=None):
        result = func(*args, **(kwargs or {}))
        tensors = [
            x for x in tree_flatten((args, kwargs, result))[0] if isinstance(x, torch.Tensor)
        ]
        if len({tensor.device for tensor in tensors}) > 1:
            self.joining.append(str(func))
        return result
