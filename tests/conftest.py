"""What every test module leaves behind as it found it."""

from __future__ import annotations

import sys
from collections.abc import Iterator

import pytest
from hypothesis import settings

# No test is about time, and the machine may be busy.
settings.register_profile("calm", deadline=None)
settings.load_profile("calm")


@pytest.fixture(autouse=True, scope="module")
def _denormal_numbers() -> Iterator[None]:
    """Opening a device has the processor flush denormal numbers, for good and in all of numpy."""
    yield
    if "torch" in sys.modules:
        sys.modules["torch"].set_flush_denormal(False)
