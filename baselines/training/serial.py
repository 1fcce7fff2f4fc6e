"""Tensors as bytes."""

from __future__ import annotations

import io
from typing import Any

import torch


def serialised(value: Any) -> memoryview:
    """What ``torch.save`` writes, made in memory: the same value gives the same bytes.

    Writing to a path, torch puts the name of the file, here a temporary one, into every record, and
    what it says of a full disk is ``unexpected pos``.
    """
    buffer = io.BytesIO()
    torch.save(value, buffer)
    return buffer.getbuffer()
