"""What a person sees of a run: the time left, the first scores, and what went wrong."""

import heapq
import importlib.util
import io
import logging
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from baselines.config.learning import MODELS
from reproduction.config.load import load_config
from reproduction.design.experiments import Run, read_design
from reproduction.plan.progress import RunPlan, TimeLeft, plan_run, to_do
from reproduction.plan.view import FirstScores, RunView
from synfeal.records.files import write_json
from tests.support.planned_runs import planned
from tests.support.report_results import failed_metrics, metrics

REPOSITORY = Path(__file__).parents[2]


@pytest.mark.parametrize("factor", [1 / 3, 1.0, 4.0])
def test_the_time_left_finds_the_speed_of_the_machine(factor):
    """A list schedule of known jobs, whose training runs are slower than the rest by a half more.

    From a third of the way on, what is said to be left is within 20 % of what is left, or within
    2 % of the whole.
    """
    rng = np.random.default_rng(3)
    expected = {f"render/{i}": float(s) for i, s in enumerate(rng.uniform(5, 40, 40))}
    expected |= {f"train/{i}": float(s) for i, s in enumerate(rng.uniform(20, 90, 60))}
    taken = {
        job: seconds * factor * (1.5 if job.startswith("train") else 1.0) * rng.uniform(0.8, 1.2)
        for job, seconds in expected.items()
    }
    left, now_s = TimeLeft(expected, 2), 0.0
    running = []
    waiting = [str(job) for job in rng.permutation(list(expected))]
    said = []
    while waiting or running:
        while waiting and len(running) < 2:
            job = waiting.pop()
            left.started(job, now_s)
            heapq.heappush(running, (now_s + taken[job], job))
        said.append((now_s, left.seconds(now_s)))
        now_s, job = heapq.heappop(running)
        left.finished(job, now_s)
    assert left.seconds(now_s) == 0
    assert left.share() == pytest.approx(1)
    for at_s, seconds in said:
        if at_s > now_s / 3:
            assert seconds == pytest.approx(now_s - at_s, rel=0.2, abs=0.02 * now_s)


def test_every_job_of_a_profile_has_an_expected_time(monkeypatch):
    monkeypatch.chdir(REPOSITORY)
    config = load_config(REPOSITORY / "config/config.yaml", REPOSITORY / "config/smoke.yaml")
    design = read_design(config)
    keys = ["/".join(filter(None, key)) for key in planned("smoke")[1].keys]
    plan = plan_run(config, design, [f"results/smoke/benchmarks/{k}.tsv" for k in keys], 2)
    assert set(plan.expected_s) == set(keys)
    assert len(set(plan.expected_s.values())) > 10  # laws, not one number for all
    assert plan.expected_s["train/large_room/6k/synfeal/pretrained/posenet/seed0"] > 2


def test_jobs_without_a_measurement_are_taken_for_those_that_run(tmp_path):
    files = {f"{rule}{n}": tmp_path / f"{rule}-{n}.tsv" for rule in "ab" for n in range(3)}
    measured = {rule: [str(files[f"{rule}{n}"]) for n in range(3)] for rule in "ab"}
    files["a0"].touch()
    assert to_do(measured, {"a": 2, "total": 2}) == [str(files["a1"]), str(files["a2"])]
    assert len(to_do(measured, {"a": 3, "b": 1, "target": 1})) == 4


def test_a_job_that_was_not_expected_takes_the_place_of_one_that_was():
    left = TimeLeft({"train/a": 10.0, "train/b": 30.0, "report": 5.0}, 1)
    left.started("train/c", 0.0)
    assert left.expected_s == {"train/c": 10.0, "train/b": 30.0, "report": 5.0}
    left.started("figures", 0.0)
    left.finished("train/c", 10.0)
    left.finished("figures", 10.0)
    assert left.expected_s["figures"] == 10.0
    assert left.count("train") == (1, 2)


@pytest.fixture
def runs(tmp_path):
    """Two repetitions of every localizer on one data set, one of one on another."""
    both = [Run("room", "6k", "sfm", "scratch", model, seed) for model in MODELS for seed in (0, 1)]
    return (*both, Run("room", "6k", "synfeal", "pretrained", "posenet", 0))


def write_scores(root, run, scores):
    path = root / "runs" / run.directory / "metrics.json"
    write_json(path, scores)
    return path


def test_the_table_fills_as_scores_come(tmp_path, runs):
    scores = FirstScores(tmp_path, runs)
    row = "room 6k sfm scratch"
    for run in runs:
        if run.model == "hourglass":
            continue
        path = write_scores(tmp_path, run, metrics("6k", run.repetition + 1.0, 10.0))
        assert scores.add(path) == (row if run.labels == "sfm" else "room 6k")
    assert not scores.complete(row)
    name, *cells = scores.cells(row)
    assert name == row
    assert cells == ["1.50 10°", "1.50 10°", "…", "1.50 10°", "1.50 10°"]
    assert scores.cells("room 6k")[:2] == ["room 6k", "1.00 10°"]
    for run in runs:
        scores.add(write_scores(tmp_path, run, failed_metrics("6k")))
    assert scores.cells(row)[1:] == ["failed"] * 5
    assert scores.add(tmp_path / "another/metrics.json") is None


@pytest.mark.parametrize("terminal", [True, False])
def test_the_view_keeps_rows_and_one_line(terminal, tmp_path, runs):
    text, now_s = io.StringIO(), [0.0]
    console = Console(file=text, force_terminal=terminal, width=100, height=12)
    view = RunView(console, lambda: now_s[0])
    view.begin(RunPlan(tmp_path, {f"train/{i}": 100.0 for i in range(4)}, runs[-1:], 2))
    for done in range(4):
        view.started(f"train/{done}")
        now_s[0] += 50
        if done == 0:
            view.scored(write_scores(tmp_path, runs[-1], metrics("6k", 0.25, 5.0)))
        view.finished(f"train/{done}")
        view.progress(done + 1, 5)
    assert "train" not in view.line()  # none is at work
    view.started("report")
    assert "report" in view.line()
    view.progress(5, 5)
    lines = text.getvalue().splitlines()
    assert any("0.25 5°" in line for line in lines)
    assert sum("jobs" in line for line in lines) >= 2
    assert "5 of 5 jobs done in 3.3 min" in lines[-1]


def test_a_fault_of_the_display_shows_its_traceback_and_ends_nothing(capsys):
    path = REPOSITORY / "workflow/plugins/snakemake_logger_plugin_synfeal/__init__.py"
    spec = importlib.util.spec_from_file_location("snakemake_logger_plugin_synfeal", path)
    plugin = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(plugin)
    handler = plugin.LogHandler(SimpleNamespace(nocolor=True, dryrun=False), None)
    handler.view.say = lambda text: text.absent
    handler.emit(logging.makeLogRecord({"levelno": logging.WARNING, "msg": "disk full"}))
    handler.close()
    shown = capsys.readouterr().err
    assert "in <lambda>" in shown
    assert "AttributeError: 'str' object has no attribute 'absent'" in shown
    assert "disk full" in shown


SNAKEFILE = """
from pathlib import Path
from snakemake.logging import logger
from reproduction.plan.progress import RunPlan

rule all:
    input: "made", "broken"
rule good:
    output: "made"
    benchmark: "results/benchmarks/good.tsv"
    shell: "touch {output}"
rule bad:
    output: "broken"
    log: "bad.log"
    benchmark: "results/benchmarks/bad.tsv"
    shell: "echo the disk is full > {log}; exit 1"
onstart:
    def plan(counts):
        expected_s = {name: 1.0 for name in ("good", "bad") if counts[name] == 1}
        return RunPlan(Path("results"), expected_s, (), 1)
    logger.info(None, extra={"plan": plan})
"""


def test_snakemake_shows_a_run_by_the_plugin(tmp_path):
    (tmp_path / "Snakefile").write_text(SNAKEFILE)
    command = [sys.executable, "-m", "snakemake", "--logger", "synfeal", "--cores", "1"]
    path = os.pathsep.join(map(str, (REPOSITORY, REPOSITORY / "workflow/plugins")))
    run = subprocess.run(
        [*command, "--keep-going", "--show-failed-logs", "--quiet", "host"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 1
    assert "0 of 2 jobs" in run.stderr
    assert "error: bad failed\nbad.log:\n    the disk is full\n" in run.stderr
    assert "1 of 3 jobs done in" in run.stderr
    assert "Complete log" in run.stderr
    assert "Select jobs" not in run.stderr
    (log,) = (tmp_path / ".snakemake/log").glob("*.log")
    assert "rule good" in log.read_text()
