"""What a run costs: counts, laws with a closed form, scaling, and how bad input ends."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from baselines.training.device import open_device
from reproduction.plan import steps
from reproduction.plan.jobs import job_of
from reproduction.plan.laws import (
    ALONE,
    OWN,
    Machine,
    compare_cost,
    fit_laws,
    job_costs,
    matched,
    seconds_of,
    summed,
    table_costs,
)
from reproduction.plan.networks import training_work
from reproduction.plan.runs import read_runs
from reproduction.runs.job_times import last_look_s, read_measured, write_measured
from synfeal.cli import main
from tests import ROOT
from tests.reproduction.test_cost_laws import a_law
from tests.support.planned_runs import planned, run_jobs
from tests.support.report_results import read

HEADER = "s\tmax_rss\tcpu_time\n"
# What the made-up run takes: seconds to start, and per unit of each law.
START_S = 2.0
RATES = {"rendering": (0.004, 0.05), "training": (3e-4, 7.0), "sfm": (3.0,), "rgbd": (2.0,)}


@pytest.fixture(autouse=True)
def _at_the_root(monkeypatch):
    monkeypatch.chdir(ROOT)


def write_job(benchmarks, job, seconds):
    path = benchmarks / job.stage / f"{job.job}.tsv"
    path = path if job.job else benchmarks / f"{job.stage}.tsv"
    path.parent.mkdir(parents=True, exist_ok=True)
    # Busy all the time; what Snakemake knows of it is where it looked last.
    peak_mb = 200 + job.held_bytes / 1e6
    path.write_text(f"{HEADER}{seconds}\t{peak_mb}\t{last_look_s(seconds)}\n")


def true_seconds(job):
    *other, rate = RATES.get(job.law, (0.0,))
    sizes = np.nan_to_num([job.other, job.size])
    return START_S + sizes @ [*other, rate][-2:] if other else START_S + rate * sizes[1]


@pytest.fixture(scope="module")
def made_up_run(tmp_path_factory):
    root = tmp_path_factory.mktemp("results") / "smoke"
    for job in run_jobs("smoke").itertuples():
        write_job(root / "benchmarks", job, true_seconds(job))
    return root


@pytest.mark.parametrize("name", ["smoke", "paper"])
def test_every_job_of_snakemake_has_a_name_and_a_size_of_its_own(name):
    jobs, keys = run_jobs(name), planned(name)[1].keys
    assert len(jobs) == len(keys) == len(set(keys)) > 90
    assert set(zip(jobs.stage, jobs.job, strict=True)) == set(keys)
    # ImageNet weights are downloaded.
    assert (jobs["size"][jobs.stage != "pretrain"].dropna() > 0).all()


def test_sizes_at_the_papers_scale_and_of_a_rule_that_nobody_told_of():
    jobs = run_jobs("paper")

    def sums(stage):
        sizes = jobs.loc[jobs.stage == stage, ["other", "size"]]
        return sizes.sum().tolist() if sizes.other.notna().any() else sizes["size"].sum()

    # 80,000 + 20,000 and 95,000 + 20,000 frames; 640 x 480 pixels with 2 x 2 samples.
    frames = 100_000 + 115_000
    assert sums("plan") == frames
    assert sums("render_packed") == pytest.approx([frames, frames * 640 * 480 * 4 / 1e6])
    assert sums("pack") == pytest.approx(frames * 224 * 224 * 3 / 1e6)
    # 6,000 and 2,500 frames in batches of 250; each shares its first frame with the one before.
    batches = 24 + 10
    assert (jobs.stage == "sfm").sum() == batches
    assert sums("sfm") == pytest.approx((8500 - 2 + batches) * 640 * 480 / 1e6)
    assert sums("render") == pytest.approx([8500, 8500 * 640 * 480 * 4 / 1e6])
    assert "size" not in job_of(planned("smoke")[0], "weather", "today")


@pytest.mark.parametrize(
    ("stage", "name"),
    [
        ("plan", "cellar/train"),
        ("labels", "large_room/7k/synfeal/train"),
        ("render_packed", "large_room/seq-99"),
        ("sfm", "large_room/6k/train/batch-999"),
        ("train", "large_room/6k/synfeal/pretrained/posenet3/seed0"),
        ("score", ""),
    ],
)
def test_a_measurement_of_another_design_is_left_out(stage, name):
    assert job_of(planned("smoke")[0], stage, name) is None


def test_processor_time_is_completed_and_one_file_keeps_the_measurements(tmp_path, made_up_run):
    root = tmp_path / "smoke"
    (root / "benchmarks" / "train").mkdir(parents=True)
    for name, line in {"a": "40\t100\t7.5", "b": "4.4\t100\t2.0", "c": "0.4\t100\t0.0"}.items():
        (root / "benchmarks" / "train" / f"{name}.tsv").write_text(f"{HEADER}{line}\n")
    # Half a core when last seen, after 15 s and 4 s; the shortest is taken to have had that too.
    assert read_measured(root).cpu_s.tolist() == pytest.approx([20, 2.2, 0.2])
    before = read_measured(made_up_run)
    write_measured(read_measured(made_up_run), made_up_run)
    kept = made_up_run / "benchmarks.csv"
    (tmp_path / "benchmarks.csv").write_bytes(kept.read_bytes())
    kept.unlink()
    after = read_measured(tmp_path)
    pd.testing.assert_frame_equal(after, before, rtol=0, atol=0.06)
    assert after.cpu_s.tolist() == pytest.approx(before.cpu_s.tolist(), abs=0.006)


def test_tables_add_up_to_the_run():
    jobs, needed = run_jobs("smoke"), planned("smoke")[1].needed
    laws = pd.concat([a_law(name, fixed_s=1.0) for name in jobs.law.unique()])
    machine = Machine(1, 0, 1.0)
    costs = job_costs(jobs, laws, machine)
    rows = pd.DataFrame(table_costs(costs, needed, machine))
    own, alone = rows[rows.part == OWN], rows[rows.part == ALONE]
    assert own.jobs.sum() == len(jobs)
    assert own.cpu_mid.sum() == pytest.approx(len(jobs))
    assert alone.set_index("name").jobs.to_dict() == {t: len(keys) for t, keys in needed.items()}
    assert summed(costs, machine)["wall_mid"] == pytest.approx(len(jobs))
    # By itself a table needs the training runs of its own rows, and from the meshes on.
    keys = needed["table4_size"]
    trained = {name.rsplit("/", 2)[0] for stage, name in keys if stage == "train"}
    rows4 = planned("smoke")[0].design.rows_of("table4_size")
    assert trained == {f"{e.scene}/{e.size}/{e.label_id}/{e.init}" for e in rows4}
    assert {("tables", "table4_size"), ("scene", "large_room")} <= keys
    assert not any(stage in ("claims", "report", "hard_cases") for stage, _ in keys)


def test_a_step_is_trained_and_timed_and_rates_are_found(monkeypatch):
    config = planned("smoke")[0].config
    hyper = config.localizers["posenet2"]
    assert 0 < steps._step_s("posenet2", hyper, config, open_device("cpu")) < 60
    batch = config.training.batch_size

    def step_s(name, hyper, *_):
        layers, tflop = training_work(name, config.network, hyper).size(batch, batch, 0)
        return 3e-4 * layers + 20 * tflop

    monkeypatch.setattr(steps, "_step_s", step_s)
    assert steps.timed_rates(config).rates == pytest.approx((3e-4, 20))


def test_steps_that_are_timed_tell_what_a_small_run_does_not():
    """Mini is predicted from a smoke run whose jobs are each 15 % off, one way or the other."""
    mini, _ = read_runs(Path("results/published/mini"))
    laws = fit_laws(mini)
    jobs = run_jobs("smoke")
    jobs = jobs[jobs.law.isin(laws.index)]
    rates = tuple(laws.loc["training", ["rate_other", "rate"]])
    for seed in range(4):
        factor = np.exp(np.random.default_rng(seed).normal(0, 0.15, len(jobs)))
        run = jobs[["stage", "job"]].assign(cpu_s=seconds_of(jobs, laws) * factor, peak_mb=np.nan)
        total = compare_cost(fit_laws(matched(jobs, run), rates), mini).iloc[-1]
        assert total.stage == "total"
        assert 1 / 1.5 < total.factor < 1.5


def test_the_command_prints_and_writes_the_plan(made_up_run, tmp_path, capsys):
    out = tmp_path / "plan.csv"
    options = ["--profile", "smoke", "--measured", str(made_up_run)]
    assert main(["plan", *options, "--cores", "1", "4", "--csv", str(out)]) == 0
    text = capsys.readouterr().out
    assert "Profile smoke on 1 core: " in text
    assert "Profile smoke on 4 cores: " in text
    assert "GPU" not in text
    rows = {(row["cores"], row["part"], row["name"]): row for row in read(out)}
    jobs = list(run_jobs("smoke").itertuples())
    expected_s = sum(true_seconds(job) for job in jobs if job.stage == "train")
    for cores in ("1", "4"):
        cpu_h = float(rows[cores, "stage", "train"]["cpu_h"])
        assert cpu_h * 3600 == pytest.approx(expected_s, rel=0.05)
    # One core works all the time, and a table by itself takes less than the run.
    total = rows["1", "run", "total"]
    assert float(total["wall_h"]) == pytest.approx(float(total["cpu_h"]), rel=0.01)
    assert float(total["cpu_h"]) * 3600 == pytest.approx(sum(map(true_seconds, jobs)), rel=0.05)
    alone = rows["4", "table alone", "table4_size"]
    assert 0 < float(alone["wall_h"]) < float(rows["4", "run", "total"]["wall_h"])


def test_runs_are_predicted_from_each_other(made_up_run, tmp_path, capsys):
    out = tmp_path / "check.csv"
    # Twice the time for every job: one direction is twice too high, the other half.
    slow = tmp_path / "smoke"
    for job in run_jobs("smoke").itertuples():
        write_job(slow / "benchmarks", job, 2 * true_seconds(job))
    options = ["--measured", str(made_up_run), "--compare", str(slow), "--csv", str(out)]
    assert main(["plan", *options]) == 0
    text = capsys.readouterr().out
    assert f"{slow} predicted from {made_up_run}" in text
    assert f"{made_up_run} predicted from {slow}" in text
    rows = [row for row in read(out) if row["stage"] == "total"]
    assert [float(row["factor"]) for row in rows] == pytest.approx([0.5, 2.0], rel=0.05)
