"""Cost of a run: its jobs as Snakemake lists them, and what measured runs say of them."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from baselines.training.memory import training_mb
from reproduction.design.profiles import read_profile
from reproduction.plan.jobs import jobs_of
from reproduction.plan.pace import paces_of, read_run, seconds_of
from reproduction.runs.job_times import last_look_s, read_measured, write_measured
from reproduction.runs.published import MEASURED
from synfeal.cli import main
from tests import ROOT
from tests.support.dry_run import measured_jobs
from tests.support.report_results import read

HEADER = "s\tmax_rss\tcpu_time\n"
MINI, NIGHT = MEASURED
SMOKE = Path("results/benchmarks/smoke")


@pytest.fixture(autouse=True)
def _at_the_root(monkeypatch):
    monkeypatch.chdir(ROOT)


def test_processor_time_is_completed_and_one_file_keeps_the_measurements(tmp_path):
    root = tmp_path / "smoke"
    (root / "benchmarks" / "train").mkdir(parents=True)
    for name, line in {"a": "40\t100\t7.5", "b": "4.4\t100\t2.0", "c": "0.4\t100\t0.0"}.items():
        (root / "benchmarks" / "train" / f"{name}.tsv").write_text(f"{HEADER}{line}\n")
    # Half a core when last seen, after 15 s and 4 s; the shortest is taken to have had that too.
    measured = read_measured(root)
    assert measured.cpu_s.tolist() == pytest.approx([20, 2.2, 0.2])
    write_measured(measured, root)
    shutil.rmtree(root / "benchmarks")
    pd.testing.assert_frame_equal(read_measured(root), measured)
    seen_s = {0.4: 0, 0.6: 0.5, 14.9: 14.5, 15.2: 15, 44.9: 15, 45.1: 45, 100: 75}
    assert {s: last_look_s(s) for s in seen_s} == seen_s


@pytest.mark.parametrize("profile", ["smoke", "paper"])
def test_jobs_are_those_that_snakemake_lists_and_called_alike(profile):
    jobs = jobs_of(read_profile(profile))
    listed = measured_jobs(profile)
    assert listed.pop("provenance") == {"provenance"}  # made after all that is measured
    assert listed.pop("report") == {"report"}
    assert {rule: set(group["job"]) for rule, group in jobs.groupby("rule")} == listed
    assert jobs["job"].is_unique
    assert (jobs["cost"] > 0).all()


def test_sizes_at_the_papers_scale():
    jobs = jobs_of(read_profile("paper"))
    counts = jobs.groupby("rule")["count"].sum()
    # 80,000 + 20,000 and 95,000 + 20,000 frames, packed as 224 x 224 pixels.
    frames = 100_000 + 115_000
    assert counts["render_packed"] == counts["pack"] == frames
    assert jobs.loc[jobs["rule"] == "pack", "cost"].sum() == frames * 224 * 224
    # 6,000 and 2,500 frames in batches of 250; each shares its first frame with the one before.
    assert counts["sfm"] == counts["rgbd"] == 8500 - 2 + 24 + 10
    # 300 epochs of 6,000 frames, and a pass forward of 2,500.
    run = jobs[jobs["job"] == "train/large_room/6k/synfeal/pretrained/posenet/seed0"]
    assert run["count"].tolist() == pytest.approx([300 * 6000 + 2500 / 3])
    half = jobs[jobs["job"] == "train/large_room/6k/synfeal/pretrained-half/posenet/seed0"]
    assert half["count"].tolist() == pytest.approx([150 * 6000 + 2500 / 3])


def test_a_start_shows_where_jobs_differ_in_size_and_sums_are_met():
    rng = np.random.default_rng(0)
    cost = pd.Series([10.0] * 20 + [1000.0] * 5)
    work = pd.DataFrame({"pace": "train posenet", "cost": cost})
    work["cpu_s"] = (4 + 0.05 * cost) * rng.uniform(0.95, 1.05, len(cost))
    alike = pd.DataFrame({"pace": "summary", "cost": 1.0, "cpu_s": [2.0, 2.4]})
    paces = paces_of([work, alike])
    assert paces.loc["train posenet", "start_s"] == pytest.approx(4, rel=0.1)
    assert paces.loc["train posenet", "px_s"] == pytest.approx(0.05, rel=0.05)
    assert seconds_of(work, paces).sum() == pytest.approx(work["cpu_s"].sum())
    assert seconds_of(alike, paces).tolist() == pytest.approx([2.2, 2.2])
    unknown = pd.DataFrame({"pace": ["weather"], "cost": [1.0]})
    assert seconds_of(unknown, paces).isna().all()


def test_large_jobs_that_happen_to_be_quick_are_not_free():
    cost = pd.Series([10.0, 10.0, 100.0, 100.0])
    jobs = pd.DataFrame({"pace": "sfm", "cost": cost, "cpu_s": [5.0, 5.0, 4.0, 4.0]})
    seconds = seconds_of(jobs, paces_of([jobs]))
    assert seconds.sum() == pytest.approx(18)
    assert (seconds >= 4).all()


@pytest.mark.parametrize("other", [NIGHT, SMOKE], ids=str)
def test_measured_runs_predict_each_other_within_the_factor_that_is_promised(
    other, capsys, tmp_path
):
    out = tmp_path / "check.csv"
    arguments = ["--measured", str(other), "--compare", str(MINI), "--csv", str(out)]
    assert main(["plan", *arguments]) == 0
    totals = [row for row in read(out) if row["rule"] == "total"]
    assert [row["predicted"] for row in totals] == [str(MINI), str(other)]
    for row in totals:
        assert 1 / 1.5 < float(row["factor"]) < 1.5, row
    assert f"{MINI} predicted from {other}" in capsys.readouterr().out


def test_a_run_at_half_the_speed_takes_twice_as_long(tmp_path, capsys):
    slow, out = tmp_path / "mini", tmp_path / "check.csv"
    slow.mkdir()
    write_measured(read_measured(MINI).assign(cpu_s=lambda jobs: 2 * jobs["cpu_s"]), slow)
    arguments = ["--measured", str(MINI), "--compare", str(slow), "--csv", str(out)]
    assert main(["plan", *arguments]) == 0
    factors = [float(row["factor"]) for row in read(out) if row["rule"] == "total"]
    assert factors == pytest.approx([0.5, 2.0], rel=1e-3)


@pytest.mark.parametrize("more", [("--cores", "2"), ("--profile", "mini")], ids=lambda m: m[0])
def test_comparing_measured_runs_refuses_options_of_a_plan(more, capsys):
    assert main(["cost", "--measured", str(MINI), "--compare", str(SMOKE), *more]) == 1
    assert f"error: {more[0]}: is of a plan; leave out --compare" in capsys.readouterr().err


def test_the_command_prints_and_writes_plans(tmp_path, capsys):
    out = tmp_path / "plan.csv"
    options = ["--profile", "mini", "--measured", str(MINI), "--cores", "1", "4"]
    assert main(["plan", *options, "--csv", str(out)]) == 0
    text = capsys.readouterr().out
    assert "Profile mini on 1 core: " in text
    assert "Profile mini on 4 cores: " in text
    rows = {(row["cores"], row["part"], row["name"]): row for row in read(out)}
    # What was measured is planned: jobs of mini by their sum, stage by stage.
    measured = read_run(MINI)
    known = measured[measured["rule"].isin(["train", "sfm"])].groupby("rule")["cpu_s"].sum()
    for rule, seconds in known.items():
        assert float(rows["1", "rule", rule]["cpu_s"]) == pytest.approx(seconds, rel=0.01)
    # One core works all the time; four cannot be quicker than a quarter.
    one, four = (rows[cores, "run", "total"] for cores in "14")
    assert float(one["wall_s"]) == pytest.approx(float(one["cpu_s"]), rel=0.01)
    assert float(one["cpu_s"]) / 4 <= float(four["wall_s"]) < float(one["cpu_s"])
    # A table by itself takes less than the run, and more than nothing.
    table = rows["4", "table alone", "table4_size"]
    assert 0 < float(table["cpu_s"]) < float(four["cpu_s"])


def test_a_rule_that_no_run_measured_is_said_to_be_and_left_out(tmp_path, capsys):
    part = tmp_path / "mini"
    part.mkdir()
    measured = read_measured(MINI)
    write_measured(measured[measured["stage"] == "sfm"], part)
    assert main(["plan", "--measured", str(part), "--cores", "1"]) == 0
    text = capsys.readouterr().out
    (line,) = (line for line in text.splitlines() if line.startswith("train "))
    assert "unknown" in line
    (total,) = (line for line in text.splitlines() if line.startswith("total "))
    assert "unknown" not in total


@pytest.mark.parametrize("root", MEASURED, ids=str)
def test_training_asks_for_more_memory_than_any_published_run_took(root):
    config = read_profile(root.name).config
    files = read_profile(root.name)
    most_mb = max(files.n_of_size(*key) for key in files.sizes)
    asked_mb = training_mb(most_mb, config.network, config.training.batch_size)
    measured = read_measured(root)
    peak_mb = measured.loc[measured["stage"] == "train", "peak_mb"].max()
    assert peak_mb < asked_mb < 4 * peak_mb
