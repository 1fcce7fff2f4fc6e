"""The workflow as a user meets it: what a dry run plans, and how a wrong configuration ends."""

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def snakemake(*arguments):
    command = [sys.executable, "-m", "snakemake", "--cores", "2", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def planned_jobs(results, *arguments):
    """Jobs by rule that a dry run into an empty results directory plans."""
    run = snakemake("--dry-run", "--config", f"results={results}", *arguments)
    assert run.returncode == 0, run.stdout + run.stderr
    return {name: int(n) for name, n in re.findall(r"^(\w+) +(\d+)$", run.stdout, re.MULTILINE)}


def test_default_profile_plans_the_papers_tables(tmp_path):
    jobs = planned_jobs(tmp_path)
    # 20 data sets (4 label sources, 9 noises, 3 + 4 more sizes) and 4 starts from scratch, 5 models
    assert jobs["train"] == 120
    assert "score" not in jobs  # what trains scores, too
    assert jobs["scene"] == 2
    assert jobs["erroneous_labels"] == 9 * 2
    assert jobs["sfm"] == jobs["rgbd"] == 24 + 10  # 1,500 and 625 frames in batches of 63
    assert jobs["posegraph"] == 2 * jobs["rgbd"]
    assert "estimate" not in jobs  # KinectFusion cannot follow frames this far apart
    assert jobs["chain"] == 3
    assert jobs["image_references"] == 20
    assert jobs["structure_references"] == 5  # true poses, SfM's, largest noise of three blocks
    assert jobs["table"] == 4
    assert jobs["side_table"] == 7  # neither shapes of errors nor robustness
    assert not jobs.keys() & {"adjusted_references", "coordinate_references", "train_varied"}


def test_the_complete_profile_adds_our_own_tables(tmp_path):
    jobs = planned_jobs(tmp_path, "--configfile", "config/complete.yaml")
    assert jobs["train"] == 185  # 37 distinct data set x start x images, 5 models
    assert jobs["erroneous_labels"] == (9 + 9) * 2
    # Each data set once; structure where frames with depth are rendered: all but the larger sizes.
    assert jobs["image_references"] == 29
    assert jobs["structure_references"] == 22
    assert jobs["adjusted_references"] == 13  # those of Tables 2 and 3
    assert jobs["coordinate_references"] == 4  # simulator, largest noise of each block
    assert jobs["descriptors"] == jobs["features"] == jobs["views"] == 2
    assert jobs["correspondences"] == jobs["tracks"] == jobs["robustness"] == 1
    assert jobs["table"] == 6
    assert jobs["side_table"] == 9


@pytest.fixture(scope="module")
def smoke_jobs(tmp_path_factory):
    """Records of all jobs of the smoke profile, on a machine with a GPU of 20 GiB."""
    folder = tmp_path_factory.mktemp("smoke")
    told = folder / "nvidia-smi"
    told.write_text("#!/bin/sh\necho 20480\n")
    told.chmod(0o755)
    out = folder / "jobs.json"
    command = ["tests.support.dry_run", "config/smoke.yaml", str(folder), str(out)]
    subprocess.run(
        [sys.executable, "-m", *command],
        cwd=ROOT,
        env=os.environ | {"PATH": f"{folder}:{os.environ['PATH']}"},
        check=True,
        capture_output=True,
    )
    return json.loads(out.read_text())


def test_the_record_of_a_run_reads_what_every_job_took_and_all_asks_every_job_for_an_output(
    smoke_jobs,
):
    """Else the record depends on which jobs happen to have ended, and on a shared file system."""
    (read,) = (set(job["input"]) for job in smoke_jobs if job["rule"] == "provenance")
    unread = {
        job["rule"] for job in smoke_jobs if job["benchmark"] and job["benchmark"] not in read
    }
    assert unread == {"provenance", "report"}  # made beside the record
    # An output of a job that failed is missed only where a target asks for it.
    (asked,) = (set(job["input"]) for job in smoke_jobs if job["rule"] == "all")
    unasked = {
        job["rule"] for job in smoke_jobs if job["output"] and asked.isdisjoint(job["output"])
    }
    assert unasked == {
        "render_packed",
        "render_varied",
        "features",
        "views",
    }  # gone once they are used


def test_jobs_that_train_and_draw_share_the_card_of_this_machine(smoke_jobs):
    asked = {job["rule"]: job["gpu_percent"] for job in smoke_jobs if job["gpu_percent"]}
    assert asked == {
        **dict.fromkeys(("pretrain", "train", "train_varied"), 50),  # two at a time
        **dict.fromkeys(("render", "render_packed", "render_varied"), 7),  # fourteen
    }


def test_a_single_experiment_is_a_target(tmp_path):
    target = f"{tmp_path}/mini/runs/large_room/6k/synfeal/scratch/posenet2/seed0/metrics.json"
    jobs = planned_jobs(tmp_path, "--", target)
    assert jobs["train"] == 1
    assert "sfm" not in jobs
    assert "pretrain" not in jobs
    # Only what one scene's network frames need: no image files, no frames for reconstruction.
    assert jobs["render_packed"] == 20_000 / 10_000 + 1
    assert "render" not in jobs


def test_labels_are_estimated_in_batches_as_long_as_the_papers_without_training(tmp_path):
    jobs = planned_jobs(tmp_path, "--configfile", "config/paper.yaml", "--", "labels")
    assert not {"train", "score", "pretrain", "table"} & set(jobs)
    assert jobs["sfm"] == jobs["rgbd"] == jobs["estimate"] == 24 + 10  # 6,000 and 2,500 by 250
    assert jobs["posegraph"] == 2 * jobs["rgbd"]
    assert jobs["chain"] == 4
    assert jobs["side_table"] == 2  # assistance, label_error


def test_changing_one_noise_level_adds_only_that_rows_jobs(tmp_path):
    changed = tmp_path / "experiments.csv"
    shutil.copy(ROOT / "config/experiments.csv", changed)
    text = changed.read_text()
    row = "orientation,large_room,6k,noise,0,20,"
    assert row in text
    changed.write_text(text.replace(row, "orientation,large_room,6k,noise,0,25,"))
    before = planned_runs(tmp_path)
    after = planned_runs(tmp_path, f"experiments={changed}")
    assert len(after - before) == len(before - after) == 5
    assert all("noise-p0-r25" in path for path in after - before)


def planned_runs(results, *config):
    listing = snakemake("--summary", "--config", f"results={results}", *config, "--", "runs")
    assert listing.returncode == 0, listing.stdout + listing.stderr
    return set(re.findall(r"^\S+/metrics\.json", listing.stdout, re.MULTILINE))


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("scael=0.1", ["scael", "unknown key", "scale"]),
        ("experiments={wrong_labels}", ["labels 'orb'", "rgbd-toro"]),
    ],
)
def test_wrong_configuration_ends_in_one_line(tmp_path, override, words):
    design = (ROOT / "config/experiments.csv").read_text().replace(",sfm,", ",orb,")
    (tmp_path / "design.csv").write_text(design)
    override = override.format(wrong_labels=tmp_path / "design.csv")
    run = snakemake("--dry-run", "--config", override)
    assert run.returncode == 1
    errors = [line for line in run.stderr.splitlines() if line.startswith("error:")]
    assert len(errors) == 1
    assert all(word in errors[0] for word in words), errors[0]
    assert "Traceback" not in run.stderr


# Runs the script of every planned job with its function's twin, which checks arguments and does
# nothing.
CALLED = """
import runpy, sys
from functools import wraps
from pathlib import Path
from types import SimpleNamespace
from pydantic import validate_call
from snakemake.api import SnakemakeApi
from snakemake.settings.types import (
    ConfigSettings, DAGSettings, OutputSettings, ResourceSettings, StorageSettings
)
from reproduction.runs import job

def check(log, function, /, **arguments):
    validate_call(wraps(function)(lambda **_: None))(**arguments)

job.run_job = check
config = {"results": sys.argv[1], "profile": "smoke"}
profiles = [Path("config/smoke.yaml"), Path("examples/external.yaml")]
with SnakemakeApi(OutputSettings(dryrun=True)) as api:
    workflow = api.workflow(
        resource_settings=ResourceSettings(cores=1), storage_settings=StorageSettings(),
        config_settings=ConfigSettings(config=config, configfiles=profiles),
        snakefile=Path("Snakefile"),
    )
    dag = workflow.dag(DAGSettings(targets={"all"}, forceall=True))
    dag.execute_workflow(executor="dryrun")
    for each in workflow._workflow.dag.jobs:
        if each.rule.script:
            names = ("input", "output", "params", "log", "wildcards")
            given = SimpleNamespace(**{name: getattr(each, name) for name in names})
            path = Path("workflow/scripts", Path(each.rule.script).name)
            runpy.run_path(str(path), {"snakemake": given})
            print("called", each.rule.name, path.name)
"""


def test_every_script_gives_its_function_what_it_asks_for(tmp_path):
    """Else a rule and a signature that no longer fit are found hours into a run."""
    command = [sys.executable, "-c", CALLED, str(tmp_path)]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    called = dict(re.findall(r"^called (\w+) ([\w.]+)$", run.stdout, re.MULTILINE))
    assert {"scene", "train", "external_reference", "robustness", "report"} <= called.keys()
    scripts = {path.name for path in (ROOT / "workflow/scripts").glob("*.py")}
    # `smoke` neither places objects nor has these methods; `score` is the other Snakefile's.
    assert scripts - set(called.values()) <= {"run_cartons.py", "run_estimate.py", "run_score.py"}


def test_no_script_is_called_like_a_module_that_jobs_may_import():
    """Snakemake puts the folder of a script before all others that modules are looked for in."""
    names = {path.stem for path in (ROOT / "workflow/scripts").rglob("*.py")}
    assert {name for name in names if importlib.util.find_spec(name) is not None} == set()
    assert all(name.startswith("run_") for name in names)


WORKFLOW = sorted(
    path
    for path in (ROOT / "Snakefile", *(ROOT / "workflow").rglob("*"))
    if path.suffix in (".smk", ".py") or path.name == "Snakefile"
)
# Names inside Snakemake that any version may change.
PRIVATE = [
    r"\.set_log\b",
    r"\.log_modifier\b",
    r"\.benchmark_modifier\b",
    r"\bworkflow\.modifier\b",
    r"\bworkflow\.rules\b",
    r"\bworkflow\.dag\b",
    r"\bworkflow\._",
    r"\bis_producer\b",
    r"\bget_wildcards\b",
    r"\bexpand_(input|output|benchmark)\b",
    r"\bneedrun_jobs\b",
    r"\bis_flagged\b",
    r"\bsnakemake\.(io|dag|rules|jobs|workflow|path_modifier)\b",
]


# Attributes of ``workflow``: those of Snakemake's documentation, and those that have no other way.
DOCUMENTED = {"basedir", "cores", "source_path"}
UNDOCUMENTED = {"configfiles", "storage_settings"}


def test_rules_use_two_undocumented_attributes_of_the_workflow_and_say_why():
    names = {path: re.findall(r"\bworkflow\.(\w+)", path.read_text()) for path in WORKFLOW}
    found = {path.name: set(used) - DOCUMENTED for path, used in names.items()}
    assert {name: used for name, used in found.items() if used} == {"common.smk": UNDOCUMENTED}
    lines = (ROOT / "workflow/rules/common.smk").read_text().splitlines()
    comments = "\n".join(line for line in lines if line.startswith("#"))
    assert all(f"`{name}`" in comments for name in UNDOCUMENTED)


def test_rules_use_no_private_name_of_snakemake():
    text = {path.relative_to(ROOT).as_posix(): path.read_text() for path in WORKFLOW}
    assert {"Snakefile", "workflow/rules/training.smk", "workflow/real/Snakefile"} <= text.keys()
    found = [
        (name, line)
        for name, lines in text.items()
        for line in lines.splitlines()
        if any(re.search(pattern, line) for pattern in PRIVATE)
    ]
    assert found == []


RULE = re.compile(
    r"^ *(?P<of>use )?rule (?:\w+ as )?(?P<name>\w+)(?: with)?:\n(?P<body>(?: +.*\n|\n(?= ))+)",
    re.MULTILINE,
)


def test_every_rule_that_makes_something_names_its_log_benchmark_and_code():
    texts = [path.read_text() for path in WORKFLOW if path.suffix != ".py"]
    rules = [rule for text in texts for rule in RULE.finditer(text) if "output:" in rule["body"]]
    assert len(rules) > 60
    for rule in rules:
        sections = re.findall(r"^ +(\w+):$", rule["body"], re.MULTILINE)
        assert {"log", "benchmark"} <= set(sections), rule["name"]
        if rule["of"] is None:  # else it has those of the rule that it uses
            assert sections.count("script") + sections.count("shell") == 1, rule["name"]
