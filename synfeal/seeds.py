"""Seeds by name: adding a model or a scene never shifts the random numbers of another."""

from __future__ import annotations

import hashlib

import numpy as np


def seed_of(*components: object) -> int:
    """A 63-bit seed of the components alone, e.g. ``seed_of(7, "large_room", "train")``."""
    text = "\x1f".join(map(str, components))
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "big") >> 1


def generator_of(*components: object) -> np.random.Generator:
    """A NumPy generator seeded by :func:`seed_of`."""
    return np.random.default_rng(seed_of(*components))
