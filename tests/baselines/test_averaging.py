"""The mean of the last weights of a training run."""

import numpy as np
import pytest
import torch
from torch import nn

from baselines.training import resume
from baselines.training.averaging import EVERY, LAST_SHARE, WeightAverage
from baselines.training.fit import FOR_PHOTOGRAPHS, Fitting
from tests.baselines.test_training_resume import assert_same
from tests.support.colored_frames import train, write_split

STEPS = 100


def network():
    return nn.Sequential(nn.Linear(2, 1), nn.BatchNorm1d(1))


def set_to(built, value):
    with torch.no_grad():
        for tensor in built.state_dict().values():
            tensor.fill_(value)


def test_weights_and_statistics_become_the_mean_of_the_last_steps():
    built = network()
    average = WeightAverage(built, STEPS)
    for done in range(1, STEPS + 1):
        set_to(built, done)
        average.after(done)
    average.apply()
    counted = [d for d in range(1, STEPS + 1) if d >= STEPS * (1 - LAST_SHARE)]
    expected = np.mean([d for d in counted if (STEPS - d) % EVERY == 0])
    for name, value in built.state_dict().items():
        if name.endswith("num_batches_tracked"):
            assert value == STEPS  # a count is no weight
        else:
            assert (value == expected).all(), name


def test_a_run_of_one_step_keeps_its_weights():
    built = network()
    average = WeightAverage(built, 1)
    set_to(built, 3.0)
    average.after(1)
    average.apply()
    assert (built[0].weight == 3.0).all()


@pytest.mark.parametrize("steps", [7, 101, 102, 103, 104])
def test_the_last_weights_are_counted_however_long_the_run_is(steps):
    built = network()
    average = WeightAverage(built, steps)
    for done in range(1, steps + 1):
        set_to(built, float(done == steps))
        average.after(done)
    average.apply()
    assert (built[0].weight > 0).all()


@pytest.fixture(scope="module")
def splits(tmp_path_factory):
    return write_split(tmp_path_factory.mktemp("split"), "train", 60, 0)


def run(split, folder):
    return train(split, folder, samples=320, protocol=FOR_PHOTOGRAPHS)


def test_averaging_is_part_of_what_a_stopped_run_goes_on_with(splits, tmp_path, monkeypatch):
    whole = run(splits, tmp_path / "whole")
    monkeypatch.setattr(resume, "RESUME_EVERY_S", 0.0)
    step, count = Fitting.step, []

    def stopping(self):
        step(self)
        count.append(1)
        if len(count) == 18:  # of 20: some weights are counted already
            raise RuntimeError("stopped here")

    with monkeypatch.context() as patched:
        patched.setattr(Fitting, "step", stopping)
        with pytest.raises(RuntimeError, match="stopped here"):
            run(splits, tmp_path / "stopped")
    assert_same(run(splits, tmp_path / "stopped"), whole)


def test_the_kept_weights_are_those_whose_error_is_told(splits, tmp_path, monkeypatch):
    applied = []
    apply = WeightAverage.apply

    def noting(self):
        apply(self)
        applied.append({name: value.clone() for name, value in self._values().items()})

    monkeypatch.setattr(WeightAverage, "apply", noting)
    model, history = run(splits, tmp_path)
    kept = torch.load(model, weights_only=True)["localizer"]
    assert all(torch.equal(kept[name], value) for name, value in applied[0].items())
    last = history.read_text().splitlines()[-1].split(",")
    assert all(last[3:6])
