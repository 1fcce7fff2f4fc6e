"""Shares of a GPU that jobs ask for."""

import pytest

from baselines.config.learning import NetworkConfig
from baselines.training.memory import training_mb
from baselines.training.sharing import card_mb, rendering_percent, training_percent

SMALL = NetworkConfig(input_px=64, width=0.25)
FULL = NetworkConfig(input_px=224, width=1.0)
H200_MB, GAMING_MB = 150_754.0, 8_590.0


def driver(tmp_path, lines):
    """A stand-in for the driver's tool, which answers with these lines of shell."""
    path = tmp_path / "nvidia-smi"
    path.write_text(f"#!/bin/sh\n{lines}\n")
    path.chmod(0o755)
    return path


def test_memory_of_the_first_card_is_read_in_megabytes(tmp_path):
    # 81,559 MiB is what an H100 of 80 GB says.
    said = driver(tmp_path, "echo 81559; echo 24564")
    assert card_mb(said) == pytest.approx(81_559 * 2**20 / 1e6)


@pytest.mark.parametrize(
    "lines", ["exit 9", "echo 'No devices were found'", "echo '[N/A]'", "true"]
)
def test_a_driver_that_tells_nothing_is_no_card(lines, tmp_path):
    assert card_mb(driver(tmp_path, lines)) is None
    assert card_mb(tmp_path / "missing") is None


def test_as_many_runs_share_a_card_as_its_time_and_its_memory_bear():
    assert training_percent(8_500, SMALL, 64, H200_MB) == 50
    assert training_percent(8_500, FULL, 45, H200_MB) == 50
    for card in (GAMING_MB, 24_000.0, H200_MB):
        for frames in (8_500, 115_000):
            share = training_percent(frames, FULL, 45, card)
            at_a_time = 100 // share
            assert at_a_time == 1 or at_a_time * training_mb(frames, FULL, 45) <= card
            assert share <= 100  # one that fits no card still starts, and says what it lacks
    assert training_percent(115_000, FULL, 45, GAMING_MB) == 100


def test_renderers_share_a_card_too():
    assert 100 // rendering_percent(H200_MB) == 14
    assert 100 // rendering_percent(GAMING_MB) == 5  # of 1.5 GB each


def test_without_a_card_no_share_is_asked_for():
    assert training_percent(8_500, FULL, 45, None) == rendering_percent(None) == 0
