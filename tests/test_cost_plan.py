"""What a run costs: counts, laws with a closed form, scaling, and how bad input ends."""

import csv
import re
from pathlib import Path

import numpy as np
import pytest

from baselines.training.device import open_device
from synfeal.cli import main
from synfeal.report.cost import steps
from synfeal.report.cost.compare import compare_cost
from synfeal.report.cost.estimate import (
    Machine,
    by_table,
    job_costs,
    run_wall,
    stage_costs,
    wall_seconds,
)
from synfeal.report.cost.jobs import Job, job_of
from synfeal.report.cost.laws import Law, fit_laws, fit_seconds
from synfeal.report.cost.measured import Measured, last_look_s, read_measured, write_measured
from synfeal.report.cost.networks import training_work
from synfeal.report.cost.profiles import read_run
from synfeal.report.cost.run import compare_runs
from tests.planned_runs import ROOT, planned, run_jobs

HEADER = "s\tmax_rss\tcpu_time\n"
# What the made-up run takes: seconds to start, and per unit of each law.
START_S = 2.0
RATES = {"rendering": (0.004, 0.05), "training": (3e-4, 7.0), "sfm": (3.0,), "rgbd": (2.0,)}


@pytest.fixture(autouse=True)
def _at_the_root(monkeypatch):
    monkeypatch.chdir(ROOT)


@pytest.fixture(scope="module")
def config():
    return planned("smoke")[0].config


def write_job(benchmarks, job, seconds):
    path = benchmarks / job.stage / f"{job.name}.tsv"
    path = path if job.name else benchmarks / f"{job.stage}.tsv"
    path.parent.mkdir(parents=True, exist_ok=True)
    # Busy all the time; what Snakemake knows of it is where it looked last.
    peak_mb = 200 + job.held_bytes / 1e6
    path.write_text(f"{HEADER}{seconds}\t{peak_mb}\t{last_look_s(seconds)}\n")


def true_seconds(job):
    return START_S + sum(r * x for r, x in zip(RATES.get(job.law, ()), job.size, strict=False))


@pytest.fixture(scope="module")
def made_up_run(tmp_path_factory):
    root = tmp_path_factory.mktemp("results") / "smoke"
    for job in run_jobs("smoke"):
        write_job(root / "benchmarks", job, true_seconds(job))
    return root


@pytest.mark.parametrize("name", ["smoke", "paper"])
def test_every_job_of_snakemake_has_a_name_and_a_size_of_its_own(name):
    jobs, keys = run_jobs(name), planned(name)[1].keys
    assert len(jobs) == len(keys) == len(set(keys)) > 90
    assert {job.key for job in jobs} == set(keys)
    # ImageNet weights are downloaded.
    assert all(job.size[-1] > 0 for job in jobs if job.size and job.stage != "pretrain")


def test_sizes_at_the_papers_scale():
    jobs = run_jobs("paper")

    def sums(stage):
        return np.sum([job.size for job in jobs if job.stage == stage], axis=0)

    # 80,000 + 20,000 and 95,000 + 20,000 frames; 640 x 480 pixels with 2 x 2 samples.
    frames = 100_000 + 115_000
    assert sums("plan") == frames
    assert sums("render_packed") == pytest.approx([frames, frames * 640 * 480 * 4 / 1e6])
    assert sums("pack") == pytest.approx(frames * 224 * 224 * 3 / 1e6)
    # 6,000 and 2,500 frames in batches of 250; each shares its first frame with the one before.
    batches = 24 + 10
    assert len([job for job in jobs if job.stage == "sfm"]) == batches
    assert sums("sfm") == pytest.approx((8500 - 2 + batches) * 640 * 480 / 1e6)
    assert sums("render") == pytest.approx([8500, 8500 * 640 * 480 * 4 / 1e6])


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


def test_a_rule_that_nobody_told_the_planner_of_is_counted_as_jobs_that_are_all_alike():
    assert job_of(planned("smoke")[0], "weather", "today") == Job("weather", "today")


def test_multiply_adds_are_the_published_ones():
    config = planned("paper")[0].config
    work = {m: training_work(m, config.network, h) for m, h in config.localizers.items()}
    # He et al. (CVPR 2016, table 1): ResNet-34 takes 3.6e9, its 1000-way classifier included.
    # Szegedy et al. (CVPR 2015, table 1): GoogLeNet takes 1.5e9 with its printed rounding.
    assert work["posenet2resnet"].flop / 2 == pytest.approx(3.6e9, rel=0.05)
    assert work["posenet2"].flop / 2 == pytest.approx(1.5e9, rel=0.07)
    # The weights of ResNet-34 without its classifier are 21.28 million (torchvision).
    assert work["posenet2resnet"].parameter_bytes >= 4 * 21.28e6


def test_looks_follow_snakemakes_schedule():
    assert [last_look_s(s) for s in (0.4, 0.6, 14.9, 15.2, 44.9, 45.1, 100)] == [
        *(0, 0.5, 14.5, 15, 15, 45, 75)
    ]


def test_processor_time_is_completed(tmp_path):
    root = tmp_path / "smoke"
    write = {"a": (40, 7.5), "b": (4.4, 2.0), "c": (0.4, 0.0)}
    for name, (wall_s, cpu_s) in write.items():
        path = root / "benchmarks" / "train" / f"{name}.tsv"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{HEADER}{wall_s}\t100\t{cpu_s}\n")
    # Half a core when last seen, after 15 s and 4 s; the shortest is taken to have had that too.
    assert [job.cpu_s for job in read_measured(root)] == pytest.approx([20, 2.2, 0.2])


def test_one_file_keeps_the_measurements(made_up_run, tmp_path):
    before = read_measured(made_up_run)
    write_measured(made_up_run)
    kept = made_up_run / "benchmarks.csv"
    (tmp_path / "benchmarks.csv").write_bytes(kept.read_bytes())
    kept.unlink()
    after = read_measured(tmp_path)
    assert [job.key for job in after] == [job.key for job in before]
    assert [j.cpu_s for j in after] == pytest.approx([j.cpu_s for j in before], abs=0.006)


def test_a_law_is_found_and_outliers_are_not_followed():
    rng = np.random.default_rng(0)
    sizes = rng.uniform(1, 10, (40, 2))
    seconds = 2 + sizes @ [0.5, 3]
    assert fit_seconds(sizes, seconds, 0.3) == (
        pytest.approx(2, rel=1e-3),
        pytest.approx((0.5, 3), rel=1e-3),
    )
    seconds[:3] *= 4
    fixed_s, rates = fit_seconds(sizes, seconds, 0.3)
    assert fixed_s + np.dot(rates, (5, 5)) == pytest.approx(19.5, rel=0.05)


def test_jobs_of_one_size_tell_only_the_rate():
    sizes, seconds = np.full((10, 1), 4.0), np.full(10, 9.0)
    assert fit_seconds(sizes, seconds, 1.0) == (1.0, (2.0,))
    assert fit_seconds(np.empty((3, 0)), np.array([1.0, 2.0, 6.0]), 1.0) == (3.0, ())


def test_chance_is_no_rate():
    # Short jobs that take 1 s whatever their size, off by up to 30 %: a thousand times the size
    # must not become a thousand times the time, whichever job happened to be slow.
    rng = np.random.default_rng(0)
    sizes = np.array([25, 60, 25, 60, 50, 200, 25, 60], dtype=float)[:, None]
    for _ in range(20):
        fixed_s, rates = fit_seconds(sizes, rng.uniform(0.9, 1.3, 8), 0.9)
        assert fixed_s >= 0.85
        assert fixed_s + rates[0] * 2000 < 12


def test_no_part_is_negative():
    sizes = np.linspace(1, 10, 20)[:, None]
    fixed_s, rates = fit_seconds(sizes, 5 * sizes[:, 0] ** 1.5, 0.1)
    assert fixed_s >= 0
    assert rates[0] > 0


def test_the_made_up_runs_costs_are_predicted(made_up_run):
    rows = compare_runs([made_up_run], made_up_run)[str(made_up_run), str(made_up_run)]
    factors = {row.stage: row.factor for row in rows}
    assert factors.keys() >= {"train", "render_packed", "sfm", "total"}
    assert list(factors.values()) == pytest.approx([1.0] * len(factors), abs=0.05)


def test_rendering_scales_with_samples():
    law = {"rendering": Law(5.0, (0.01, 0.1), (0.5, 2.0), 9, 100.0, 700.0)}
    jobs = [Job("render_packed", str(i), (1000.0, 1228.8), 0, 5e6) for i in range(3)]
    machine = Machine(cores=2, gpus=0, gpu_tflops=1.0)
    costs = job_costs(jobs, law, machine)
    [stage] = stage_costs(costs, law, machine)
    seconds = 5 + 10 + 122.88
    assert stage.cpu_s == pytest.approx((1.5 * seconds, 3 * seconds, 6 * seconds))
    assert stage.wall_s.mid == pytest.approx(2 * seconds)  # three equal jobs on two cores
    assert stage.wall_s.high == pytest.approx(4 * seconds)
    assert stage.beyond == pytest.approx(12.288)
    assert stage.peak_mb == pytest.approx(705)


def test_trainings_on_a_gpu_take_the_assumed_throughput():
    law = {"training": Law(3.0, (1e-4, 8.0), (0.9, 1.1), 9, 1.0, 400.0)}
    jobs = [Job("train", str(i), (1e5, 7200.0)) for i in range(4)]
    [on_gpu] = stage_costs(job_costs(jobs, law, Machine(8, 2, 10.0)), law, Machine(8, 2, 10.0))
    # 4 x 7200 TFLOP at 20, 10 and 5 TFLOP/s; a core drives each, and starts it.
    assert on_gpu.gpu_s == pytest.approx((1440, 2880, 5760))
    assert on_gpu.cpu_s.mid == pytest.approx(2880 + 4 * 3)
    assert on_gpu.wall_s.mid == pytest.approx(2 * (720 + 3))
    # Starting ten million layers, at 0.1 ms each, takes longer than the arithmetic.
    [cost] = job_costs([Job("train", "a", (1e7, 7200.0))], law, Machine(8, 2, 10.0))
    assert cost.gpu_s.mid == pytest.approx(1000)
    [on_cpu] = stage_costs(job_costs(jobs, law, Machine(4, 0, 10.0)), law, Machine(4, 0, 10.0))
    assert on_cpu.gpu_s.mid == 0
    assert on_cpu.cpu_s.mid == pytest.approx(4 * (3 + 10 + 57_600))


def test_unmeasured_stages_are_said_to_be():
    jobs = [Job("sfm", "a", (1.0,), 10)]
    [stage] = stage_costs(job_costs(jobs, {}, Machine(1, 0, 1.0)), {}, Machine(1, 0, 1.0))
    assert not stage.known
    assert (stage.cpu_s.mid, stage.disk_bytes) == (0, 10)


def test_longest_jobs_start_first():
    assert wall_seconds([1, 1, 1, 3], 2) == 3
    assert wall_seconds([2, 2, 2], 2) == 4
    assert wall_seconds([5, 1], 8) == 5


def test_tables_add_up_to_the_run():
    jobs, needed = run_jobs("smoke"), planned("smoke")[1].needed
    law = {job.law: Law(1.0, (0.0,) * len(job.size), (1.0, 1.0), 1, None, None) for job in jobs}
    costs = job_costs(jobs, law, Machine(1, 0, 1.0))
    rows = by_table(costs, needed, Machine(1, 0, 1.0))
    assert sum(row.own.jobs for row in rows) == len(jobs)
    assert sum(row.own.cpu_s.mid for row in rows) == pytest.approx(len(jobs))
    assert run_wall(costs, Machine(1, 0, 1.0)).mid == pytest.approx(len(jobs))
    # By itself a table needs the training runs of its own rows, and from the meshes on.
    rows4 = [e for e in planned("smoke")[0].experiments if e.table == "table4_size"]
    keys = needed["table4_size"]
    trained = {name for stage, name in keys if stage == "train"}
    starts = [f"{e.scene}/{e.size}/{e.label_id}/{e.init}" for e in rows4]
    assert {name.rsplit("/", 2)[0] for name in trained} == set(starts)
    assert {("tables", "table4_size"), ("scene", "large_room")} <= keys
    assert not any(stage in ("claims", "report", "hard_cases") for stage, _ in keys)


def read_rows(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def test_rates_of_steps_are_found(config, monkeypatch):
    batch = config.training.batch_size

    def step_s(name, hyper, *_):
        layers, tflop = training_work(name, config.network, hyper).size(batch, batch, 0)
        return 3e-4 * layers + 20 * tflop

    monkeypatch.setattr(steps, "_step_s", step_s)
    assert steps.timed_rates(config).rates == pytest.approx((3e-4, 20))


def test_a_step_is_trained_and_timed(config):
    hyper = config.localizers["posenet2"]
    assert 0 < steps._step_s("posenet2", hyper, config, open_device("cpu")) < 60


def test_steps_that_are_timed_tell_what_a_small_run_does_not():
    """Mini is predicted from a smoke run whose jobs are each 15 % off, one way or the other."""
    mini, _ = read_run(Path("results/published/mini"))
    laws = fit_laws(mini)
    jobs = [job for job in run_jobs("smoke") if job.law in laws]
    for seed in range(4):
        rng = np.random.default_rng(seed)
        run = [
            (job, Measured(*job.key, 0.0, laws[job.law].seconds(job.size) * factor, None))
            for job, factor in zip(jobs, np.exp(rng.normal(0, 0.15, len(jobs))), strict=True)
        ]
        *_, total = compare_cost(fit_laws(run, laws["training"].rates), mini)
        assert 1 / 1.5 < total.factor < 1.5


def test_timed_steps_of_a_gpu_replace_the_assumption():
    law = {"training": Law(3.0, (1e-4, 8.0), (0.9, 1.1), 9, 1.0, 400.0)}
    machine = Machine(8, 2, 10.0, gpu_rates=(1e-5, 0.05))
    [cost] = job_costs([Job("train", "a", (1e6, 7200.0))], law, machine)
    assert cost.gpu_s.mid == pytest.approx(1e6 * 1e-5 + 7200 * 0.05)


def test_the_command_prints_and_writes_the_plan(made_up_run, tmp_path, capsys):
    out = tmp_path / "plan.csv"
    options = ["--profile", "smoke", "--measured", str(made_up_run)]
    assert main(["plan", *options, "--cores", "1", "4", "--csv", str(out)]) == 0
    text = capsys.readouterr().out
    assert "Profile smoke on 1 core: " in text
    assert "Profile smoke on 4 cores: " in text
    assert "GPU" not in text
    rows = {(row["cores"], row["part"], row["name"]): row for row in read_rows(out)}
    jobs = run_jobs("smoke")
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
    for job in run_jobs("smoke"):
        write_job(slow / "benchmarks", job, 2 * true_seconds(job))
    options = ["--measured", str(made_up_run), "--compare", str(slow), "--csv", str(out)]
    assert main(["plan", *options]) == 0
    text = capsys.readouterr().out
    assert f"{slow} predicted from {made_up_run}" in text
    assert f"{made_up_run} predicted from {slow}" in text
    rows = [row for row in read_rows(out) if row["stage"] == "total"]
    assert [float(row["factor"]) for row in rows] == pytest.approx([0.5, 2.0], rel=0.05)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["--profile", "large"],
            r"profile 'large': no file of config/ is called so; known: .*mini",
        ),
        (["--profile", "absent.yaml"], r"absent\.yaml: cannot be read as YAML"),
        (["--measured", "{tmp}"], r"holds no benchmarks/\*\*/\*\.tsv and no benchmarks\.csv"),
        (["--cores", "0"], r"--cores: must be at least 1, found 0"),
        (["--gpus", "-1"], r"--gpus: must be at least 0, found -1"),
        (["--gpu-tflops", "nan"], r"--gpu-tflops: must be above 0, found nan"),
    ],
)
def test_bad_input_ends_in_one_line(arguments, message, tmp_path, capsys):
    assert main(["plan", *(a.replace("{tmp}", str(tmp_path)) for a in arguments)]) == 1
    error = capsys.readouterr().err
    assert re.search(message, error)
    assert error.count("\n") == 1


def test_a_broken_measurement_is_named(made_up_run, tmp_path):
    path = tmp_path / "smoke" / "benchmarks" / "sfm" / "a.tsv"
    path.parent.mkdir(parents=True)
    path.write_text(f"{HEADER}fast\t1\t1\n")
    assert main(["plan", "--measured", str(tmp_path / "smoke")]) == 1
