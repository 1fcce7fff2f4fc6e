"""Workflows of the hosting site say what docs/installing.md promises of them."""

import re

import pytest
import yaml

from tests import ROOT

FOLDER = ROOT / ".github/workflows"
NAMES = sorted(path.name for path in FOLDER.glob("*.yml"))


def workflow(name):
    read = yaml.safe_load((FOLDER / name).read_text(encoding="utf-8"))
    read["on"] = read.pop(True)  # YAML 1.1 takes the key `on` for a truth value
    return read


def steps(name):
    return [step for job in workflow(name)["jobs"].values() for step in job.get("steps", [])]


def test_there_is_a_workflow_for_tests_wheels_docs_and_releases():
    assert NAMES == ["ci.yml", "docs.yml", "release.yml", "wheels.yml"]


@pytest.mark.parametrize("name", NAMES)
def test_a_workflow_may_only_read_and_every_job_ends(name):
    read = workflow(name)
    assert read["permissions"] == {"contents": "read"}
    for job in read["jobs"].values():
        assert "uses" in job or job["timeout-minutes"] <= 90
    assert "secrets." not in (FOLDER / name).read_text()


@pytest.mark.parametrize("name", NAMES)
def test_targets_and_scripts_that_a_workflow_runs_exist(name):
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for command in (step["run"] for step in steps(name) if "run" in step):
        assert set(re.findall(r"\bmake ([a-z-]+)", command)) <= targets
        assert all((ROOT / path).is_file() for path in re.findall(r"\.ci/[\w.]+", command))


def test_the_release_is_published_by_identity_after_every_smoke():
    read = workflow("release.yml")
    publish = read["jobs"]["publish"]
    assert publish["permissions"] == {"id-token": "write"}
    assert publish["environment"] == "pypi"
    assert set(publish["needs"]) == {"wheels", "tag"}
    assert read["jobs"]["wheels"]["uses"] == "./.github/workflows/wheels.yml"
    upload = publish["steps"][-1]
    assert upload["uses"].startswith("pypa/gh-action-pypi-publish@")
    assert "with" not in upload  # neither user nor password


def test_every_part_is_smoked_and_every_system_tested():
    smoke = workflow("wheels.yml")["jobs"]["smoke"]
    assert "build" in smoke["needs"]
    assert set(smoke["strategy"]["matrix"]["part"]) == {
        "simulator",
        "scan",
        "baselines",
        "reproduction",
    }
    matrix = workflow("ci.yml")["jobs"]["portable"]["strategy"]["matrix"]
    assert [name.partition("-")[0] for name in matrix["os"]] == ["ubuntu", "macos", "windows"]
    assert matrix["python-version"] == ["3.11", "3.12", "3.13"]
