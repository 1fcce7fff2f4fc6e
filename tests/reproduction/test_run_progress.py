"""Display of a run: one line with the time left, and what went wrong."""

import heapq
import importlib.util
import io
import logging
import os
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from reproduction.design.profiles import read_profile
from reproduction.plan.progress import RunView, TimeLeft, seconds_by_rule
from tests import ROOT


@pytest.mark.parametrize("factor", [1 / 3, 1.0, 4.0])
def test_the_time_left_finds_the_speed_of_the_machine(factor):
    """A list schedule of known jobs, whose training runs are slower than the rest by a half more.

    From a third of the way on, what is said to be left is within 20 % of what is left, or within
    2 % of the whole.
    """
    rng = np.random.default_rng(3)
    expected_s = {"render": 22.0, "train": 55.0}
    rules = ["render"] * 40 + ["train"] * 60
    slower = {"render": 1.0, "train": 1.5}
    taken_s = [expected_s[r] * factor * slower[r] * rng.uniform(0.6, 1.4) for r in rules]
    left, now_s = TimeLeft({"render": 40, "train": 60}, expected_s, 2), 0.0
    running, said = [], []
    waiting = [int(job) for job in rng.permutation(len(rules))]
    while waiting or running:
        while waiting and len(running) < 2:
            job = waiting.pop()
            left.started(job, rules[job], now_s)
            heapq.heappush(running, (now_s + taken_s[job], job))
        said.append((now_s, left.seconds(now_s)))
        now_s, job = heapq.heappop(running)
        left.finished(job, now_s)
    assert left.seconds(now_s) == 0
    assert left.share() == pytest.approx(1)
    for at_s, seconds in said:
        if at_s > now_s / 3:
            assert seconds == pytest.approx(now_s - at_s, rel=0.2, abs=0.02 * now_s)


def test_rules_of_a_profile_have_expected_times_from_the_published_runs(monkeypatch):
    monkeypatch.chdir(ROOT)
    seconds = seconds_by_rule(read_profile("smoke"))
    # A training run of 320 images is nearly all start; rendering and labels take as long.
    assert 1 < seconds["train"] < 20
    assert {"scene", "plan", "render_packed", "sfm", "rgbd", "chain", "claims"} <= seconds.keys()
    assert seconds_by_rule(read_profile("paper"))["train"] > 1000 * seconds["train"]


def test_a_rule_that_was_not_expected_counts_as_much_as_others():
    left = TimeLeft({"train": 2, "weather": 1}, {"train": 10.0}, 1)
    assert left.seconds(0.0) == pytest.approx(30)
    left.started(1, "train", 0.0)
    left.finished(1, 10.0)
    assert left.done["train"] == 1
    assert left.seconds(10.0) == pytest.approx(20)
    left.finished(7, 11.0)  # a job that nobody saw begin
    left.started(2, "unknown", 11.0)  # a rule that was not counted
    left.finished(2, 12.0)
    assert left.seconds(12.0) < 30


@pytest.mark.parametrize("terminal", [True, False])
def test_the_view_keeps_one_line(terminal):
    text, now_s = io.StringIO(), [0.0]
    console = Console(file=text, force_terminal=terminal, width=100, height=12)
    view = RunView(console, lambda: now_s[0])
    view.begin(TimeLeft({"train": 4, "report": 1}, {"train": 100.0, "report": 10.0}, 2))
    for job in range(4):
        view.started(job, "train")
        assert f"train {job} of 4" in view.line()
        now_s[0] += 50
        view.finished(job)
        view.progress(job + 1, 5)
    assert "train" not in view.line()  # none is at work
    assert "4 of 5 jobs" in view.line()
    assert "1.2 jobs/min" in view.line()  # four in 200 s
    view.started(4, "report")
    assert "report" in view.line()
    assert "s left" in view.line()
    view.progress(5, 5)
    lines = text.getvalue().splitlines()
    assert sum("jobs" in line for line in lines) >= 2
    assert "5 of 5 jobs done in 3.3 min" in lines[-1]


def test_a_fault_of_the_display_shows_its_traceback_and_ends_nothing(capsys):
    path = ROOT / "workflow/plugins/snakemake_logger_plugin_synfeal/__init__.py"
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
from snakemake.logging import logger

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
    logger.info(None, extra={"expected_s": {"good": 1.0, "bad": 1.0}, "cores": 1})
"""


def test_snakemake_shows_a_run_by_the_plugin(tmp_path):
    (tmp_path / "Snakefile").write_text(SNAKEFILE)
    command = [sys.executable, "-m", "snakemake", "--logger", "synfeal", "--cores", "1"]
    path = os.pathsep.join(map(str, (ROOT, ROOT / "workflow/plugins")))
    run = subprocess.run(
        [*command, "--keep-going", "--show-failed-logs", "--quiet", "host"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 1
    assert "0 of 3 jobs" in run.stderr
    assert "error: bad failed\nbad.log:\n    the disk is full\n" in run.stderr
    assert "1 of 3 jobs done in" in run.stderr
    assert "Complete log" in run.stderr
    assert "Select jobs" not in run.stderr
    (log,) = (tmp_path / ".snakemake/log").glob("*.log")
    assert "rule good" in log.read_text()
