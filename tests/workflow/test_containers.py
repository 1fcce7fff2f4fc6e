"""Images, locks and cluster profiles agree with the project; that they work only use tells."""

import re
import tomllib

import pytest
import torch
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from baselines.localizers.registry import build_localizer
from baselines.training.memory import training_mb
from baselines.training.pretrain import RoomsNetwork
from reproduction.design.profiles import read_profile
from tests import ROOT
from tests.workflow.test_workflow import planned_jobs

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
    slurm, docs = pins("requirements-slurm.lock"), pins("requirements-docs.lock")
    assert not slurm.keys() & locked.keys()
    assert not docs.keys() & locked.keys()
    further = project["optional-dependencies"]
    needed = [*project["dependencies"], *further["dev"], *further["docs"]]
    for name in ("baselines", "reproduction"):
        above = tomllib.loads(read(f"{name}/pyproject.toml"))
        needed += above["tool"]["hatch"]["metadata"]["hooks"]["custom"]["dependencies"]
        extras = above["project"].get("optional-dependencies", {})
        needed += [*extras.get("serve", []), *extras.get("slurm", [])]
    for text in needed:
        requirement = Requirement(text)
        version = (locked | slurm | docs)[canonicalize_name(requirement.name)]
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


PROFILES = {
    name: ROOT / f"workflow/profiles/{name}/profile.yaml" for name in ("slurm", "kubernetes")
}
WORKFLOW = "".join(path.read_text() for path in sorted((ROOT / "workflow/rules").glob("*.smk")))
RULES = frozenset(re.findall(r"^(?:rule|use rule \w+ as) (\w+)", WORKFLOW, re.MULTILINE))


def profile(name):
    return yaml.safe_load(PROFILES[name].read_text())


@pytest.mark.parametrize("name", PROFILES)
def test_a_profile_names_rules_and_loses_no_setting_to_the_default_one(name):
    settings = profile(name)
    assert RULES.issuperset({*settings["set-resources"], *settings["groups"]})
    assert settings["group-components"].keys() <= set(settings["groups"].values())
    default = yaml.safe_load((ROOT / "profiles/default/profile.yaml").read_text())
    assert not default.keys() & settings.keys()


def test_jobs_of_a_group_go_to_one_partition():
    settings = profile("slurm")
    partitions = {}
    for rule, group in settings["groups"].items():
        chosen = {**settings["default-resources"], **settings["set-resources"].get(rule, {})}
        partitions.setdefault(group, set()).add(chosen["slurm_partition"])
    assert all(len(names) == 1 for names in partitions.values()), partitions


def test_the_papers_design_is_planned_for_slurm(tmp_path):
    pytest.importorskip("snakemake_executor_plugin_slurm")
    arguments = ("--profile", "workflow/profiles/slurm", "--configfile", "config/paper.yaml")
    jobs = planned_jobs(tmp_path, *arguments, "--", "all")
    assert jobs["sfm"] == jobs["rgbd"] == jobs["estimate"] == 24 + 10  # 6,000 and 2,500 by 250
    assert jobs["render_packed"] == 80 + 20 + 95 + 20  # thousands of frames of both scenes
    assert jobs["train"] == 125


def held_mb(build, px, batch_size):
    """Memory of a training step: weights, gradients and two moments, and the layers' outputs."""
    outputs = []

    def note(_, __, out):  # a recurrent layer gives its sequence first
        outputs.append((out[0] if isinstance(out, tuple) else out).numel())

    with torch.device("meta"), torch.no_grad():
        network = build().eval()
        for layer in network.modules():
            if list(layer.parameters(recurse=False)) and not list(layer.children()):
                layer.register_forward_hook(note)
        network(torch.empty(1, 3, px, px))
    parameters = sum(p.numel() for p in network.parameters())
    return 4 * (4 * parameters + batch_size * sum(outputs)) / 1e6


@pytest.mark.parametrize(
    ("name", "models"), [("mini", ["hourglass"]), ("paper", ["hourglass", "posenet", "poselstm"])]
)
def test_a_training_asks_for_what_the_largest_network_takes_and_not_for_twice_that(name, models):
    config = read_profile(name).config
    network, px, batch = config.network, config.network.input_px, config.training.batch_size
    hyper = config.localizers
    held = [held_mb(lambda m=m: build_localizer(m, network, hyper[m]), px, batch) for m in models]
    frames = 10_000
    counted_mb = max(held) + frames * 3 * px**2 / 1e6
    asked_mb = training_mb(frames, network, batch)
    assert counted_mb < asked_mb - 900  # the program itself takes 0.5 to 0.9 GB
    assert asked_mb - 1000 < 2 * counted_mb
    rooms = held_mb(
        lambda: RoomsNetwork("resnet34", network.width, 1), px, config.pretraining.batch_size
    )
    assert rooms < training_mb(0, network, batch) - 900
