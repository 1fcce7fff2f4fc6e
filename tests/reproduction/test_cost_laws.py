"""What a job costs: laws fitted to measurements, and estimates that have a closed form."""

import numpy as np
import pandas as pd
import pytest

from reproduction.plan.jobs import COLUMNS
from reproduction.plan.laws import (
    CPU,
    GPU,
    LAW,
    Machine,
    fit_seconds,
    job_costs,
    stage_costs,
    summed,
    wall_seconds,
)
from reproduction.plan.networks import training_work
from reproduction.runs.job_times import last_look_s
from tests.support.planned_runs import planned


def a_law(name, **values):
    """One law, as :func:`fit_laws` gives it."""
    law = {"fixed_s": 0.0, "rate_other": 0.0, "rate": 0.0, "low": 1.0, "high": 1.0, **values}
    return pd.DataFrame(law, index=[name], columns=list(LAW), dtype=float)


def alike(count, stage, law, **values):
    """Jobs that differ in their names alone."""
    job = {"stage": stage, "law": law, "unit": "", "disk_bytes": 0.0, "held_bytes": 0.0, **values}
    jobs = pd.DataFrame([{"job": str(i), **job} for i in range(count)], columns=list(COLUMNS))
    return jobs.astype({"other": float, "size": float})


def test_multiply_adds_are_the_published_ones():
    config = planned("paper")[0].config
    work = {m: training_work(m, config.network, h) for m, h in config.localizers.items()}
    # He et al. (CVPR 2016, table 1): ResNet-34 takes 3.6e9, its 1000-way classifier included.
    # Szegedy et al. (CVPR 2015, table 1): GoogLeNet takes 1.5e9 with its printed rounding.
    assert work["posenet2resnet"].flop / 2 == pytest.approx(3.6e9, rel=0.05)
    assert work["posenet2"].flop / 2 == pytest.approx(1.5e9, rel=0.07)
    # The weights of ResNet-34 without its classifier are 21.28 million (torchvision).
    assert work["posenet2resnet"].parameter_bytes >= 4 * 21.28e6


def test_a_law_is_found_and_neither_outliers_nor_chance_are_followed():
    rng = np.random.default_rng(0)
    sizes = rng.uniform(1, 10, (40, 2))
    seconds = 2 + sizes @ [0.5, 3]
    fixed_s, rates = fit_seconds(sizes, seconds, 0.3)
    assert (fixed_s, *rates) == pytest.approx((2, 0.5, 3), rel=1e-3)
    seconds[:3] *= 4
    fixed_s, rates = fit_seconds(sizes, seconds, 0.3)
    assert fixed_s + np.dot(rates, (5, 5)) == pytest.approx(19.5, rel=0.05)
    sizes, seconds = np.full((10, 1), 4.0), np.full(10, 9.0)
    assert fit_seconds(sizes, seconds, 1.0) == (1.0, (2.0,))
    assert fit_seconds(np.empty((3, 0)), np.array([1.0, 2.0, 6.0]), 1.0) == (3.0, ())
    sizes = np.linspace(1, 10, 20)[:, None]
    fixed_s, rates = fit_seconds(sizes, 5 * sizes[:, 0] ** 1.5, 0.1)
    assert fixed_s >= 0 < rates[0]
    # Short jobs that take 1 s whatever their size, off by up to 30 %: a thousand times the size
    # must not become a thousand times the time, whichever job happened to be slow.
    rng = np.random.default_rng(0)
    sizes = np.array([25, 60, 25, 60, 50, 200, 25, 60], dtype=float)[:, None]
    for _ in range(20):
        fixed_s, rates = fit_seconds(sizes, rng.uniform(0.9, 1.3, 8), 0.9)
        assert fixed_s >= 0.85
        assert fixed_s + rates[0] * 2000 < 12


def test_rendering_scales_with_samples():
    rates = {"fixed_s": 5.0, "rate_other": 0.01, "rate": 0.1, "low": 0.5, "high": 2.0}
    law = a_law("rendering", **rates, largest=100, base_mb=700)
    sizes = {"other": 1000.0, "size": 1228.8, "held_bytes": 5e6}
    machine = Machine(cores=2, gpus=0, gpu_tflops=1.0)
    jobs = alike(3, "render_packed", "rendering", **sizes)
    [stage] = stage_costs(job_costs(jobs, law, machine), machine)
    seconds = 5 + 10 + 122.88
    assert [stage[c] for c in CPU] == pytest.approx([1.5 * seconds, 3 * seconds, 6 * seconds])
    assert stage["wall_mid"] == pytest.approx(2 * seconds)  # three equal jobs on two cores
    assert stage["wall_high"] == pytest.approx(4 * seconds)
    assert stage["beyond"] == pytest.approx(12.288)
    assert stage["peak_mb"] == pytest.approx(705)


def test_training_on_a_gpu_takes_the_assumed_throughput_or_the_timed_one():
    law = a_law("training", fixed_s=3.0, rate_other=1e-4, rate=8.0, low=0.9, high=1.1)
    jobs = alike(4, "train", "training", other=1e5, size=7200.0)
    machine = Machine(8, 2, 10.0)
    [on_gpu] = stage_costs(job_costs(jobs, law, machine), machine)
    # 4 x 7200 TFLOP at 20, 10 and 5 TFLOP/s; a core drives each, and starts it.
    assert [on_gpu[c] for c in GPU] == pytest.approx([1440, 2880, 5760])
    assert on_gpu["cpu_mid"] == pytest.approx(2880 + 4 * 3)
    assert on_gpu["wall_mid"] == pytest.approx(2 * (720 + 3))
    # Starting ten million layers, at 0.1 ms each, takes longer than the arithmetic.
    cost = job_costs(alike(1, "train", "training", other=1e7, size=7200.0), law, machine)
    assert cost.gpu_mid.tolist() == pytest.approx([1000])
    on_cores = Machine(4, 0, 10.0)
    [on_cpu] = stage_costs(job_costs(jobs, law, on_cores), on_cores)
    assert on_cpu["gpu_mid"] == 0
    assert on_cpu["cpu_mid"] == pytest.approx(4 * (3 + 10 + 57_600))
    law = a_law("training", fixed_s=3.0, rate_other=1e-4, rate=8.0)
    machine = Machine(8, 2, 10.0, gpu_rates=(1e-5, 0.05))
    cost = job_costs(alike(1, "train", "training", other=1e6, size=7200.0), law, machine)
    assert cost.gpu_mid.tolist() == pytest.approx([1e6 * 1e-5 + 7200 * 0.05])


def test_unmeasured_stages_are_said_to_be_and_longest_jobs_start_first():
    machine, laws = Machine(1, 0, 1.0), a_law("other", fixed_s=1.0)
    costs = job_costs(alike(1, "sfm", "sfm", size=1.0, disk_bytes=10.0), laws, machine)
    [stage] = stage_costs(costs, machine)
    assert stage["measured"] == "no"
    assert np.isnan(stage["cpu_mid"])
    whole = summed(costs, machine)
    assert (whole["cpu_mid"], whole["wall_mid"], whole["disk_bytes"]) == (0, 0, 10)
    assert wall_seconds([1, 1, 1, 3], 2) == 3
    assert wall_seconds([2, 2, 2], 2) == 4
    assert wall_seconds([5, 1], 8) == 5
    seen_s = {0.4: 0, 0.6: 0.5, 14.9: 14.5, 15.2: 15, 44.9: 15, 45.1: 45, 100: 75}
    assert {s: last_look_s(s) for s in seen_s} == seen_s
