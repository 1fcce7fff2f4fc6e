"""Images, conda and lock files agree with the project; that they work only building them tells."""

import re
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parent.parent
CPU, CUDA = "requirements.lock", "requirements-cuda.lock"


def read(name):
    return (ROOT / name).read_text(encoding="utf-8")


def pins(name):
    """Versions by canonical name; a name twice is an error."""
    lines = [line for line in read(name).splitlines() if line and line[0] not in "#-"]
    pairs = [re.fullmatch(r"([\w.-]+)={2,3}([\w.]+)", line) for line in lines]
    assert all(pairs), "every line is an exact pin"
    found = {canonicalize_name(pair[1]): pair[2] for pair in pairs if pair}
    assert len(found) == len(lines)
    return found


def test_every_dependency_is_locked_within_its_range():
    project = tomllib.loads(read("pyproject.toml"))["project"]
    locked = pins(CPU)
    for text in (*project["dependencies"], *project["optional-dependencies"]["dev"]):
        requirement = Requirement(text)
        version = locked[canonicalize_name(requirement.name)]
        assert requirement.specifier.contains(version, prereleases=True), requirement


def test_the_locks_differ_in_what_cuda_needs():
    lines, cpu, cuda = read(CUDA).splitlines(), pins(CPU), pins(CUDA)
    assert f"--requirement {CPU}" in lines
    assert f"torch==={cpu['torch']}" in lines  # no local build: "==" would take "+cpu" too
    assert cuda.keys() & cpu.keys() == {"torch"}
    assert any(name.startswith("nvidia-cudnn") for name in cuda)
    assert not [name for name in cpu if name.startswith(("nvidia-", "cuda-"))]


@pytest.mark.parametrize("name", ["Dockerfile", "apptainer.def"])
def test_images_are_built_by_the_makefile_and_the_one_list_of_packages(name):
    text = read(name)
    base = re.search(r"^(?:FROM|From:) (\S+)$", text, re.MULTILINE)
    assert base is not None
    assert base[1] == "debian:bookworm-slim"
    assert "setup/container.sh" in text
    assert re.search(r"make LOCK=\S*( \}\})?.* \.venv/installed", text)
    assert "LOCK=requirements.lock" in text
    assert "apt-get" not in text
    assert "pip install" not in text
