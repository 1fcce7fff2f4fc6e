"""docs/adding.md to the letter: its package is built, its profile read, its option taken."""

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile

import numpy as np
import pytest
import trimesh

from reproduction.design.profiles import read_profile
from synfeal.errors import InputError
from tests import ROOT
from tests.support.added_methods import PAGE, block, install

BUILD = "import sys; from setuptools.build_meta import build_wheel; build_wheel(sys.argv[1])"


def python(code, *arguments, cwd, **environment):
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)],
        cwd=cwd,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )


def test_setuptools_builds_the_package_of_the_page(tmp_path):
    (tmp_path / "pyproject.toml").write_text(block("its complete `pyproject.toml`:", "toml"))
    (tmp_path / "my_tables").mkdir()
    (tmp_path / "my_tables/__init__.py").touch()
    (tmp_path / "my_tables/worst.py").write_text(block("`my_tables/worst.py`:", "python"))
    (tmp_path / "sheds.py").write_text(block("`sheds.py`:", "python"))
    built = python(BUILD, "wheels", cwd=tmp_path)
    assert built.returncode == 0, built.stderr
    (wheel,) = (tmp_path / "wheels").glob("*.whl")
    with zipfile.ZipFile(wheel) as content:
        names = content.namelist()
        (entries,) = [name for name in names if name.endswith("entry_points.txt")]
        listed = content.read(entries).decode()
    assert {"my_tables/worst.py", "sheds.py"} < set(names)
    assert "[synfeal.tables]\nworst = my_tables.worst\n" in listed
    assert "[synfeal.scene_builders]\nshed = sheds:build\n" in listed


@pytest.fixture
def shed_profile(tmp_path, monkeypatch):
    """The profile of the page, where its builder is installed."""
    install(
        tmp_path, {"shed": "def build(): ..."}, "shed = rooms.shed:build\n", "rooms",
        "synfeal.scene_builders",
    )  # fmt: skip
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(ROOT)
    path = tmp_path / "my_shed.yaml"
    path.write_text(block("`my_shed.yaml`", "yaml"))
    return path


def test_the_profile_of_the_page_is_of_its_scene_alone(shed_profile):
    files = read_profile(str(shed_profile))
    assert files.scenes == ["shed"]
    assert files.manifests("network") == ["results/my_shed/datasets/shed/network/manifest.json"]


def test_a_scene_that_nothing_is_made_of_is_refused(shed_profile):
    """Otherwise the default profile's hours begin, on scenes that nobody asked for."""
    text = shed_profile.read_text()
    alone = text[: text.index("experiments:")]
    shed_profile.write_text(alone)
    with pytest.raises(InputError, match=r"scenes\.shed: nothing would be made .* scene: shed, "):
        read_profile(str(shed_profile))
    shed_profile.write_text(alone + "datasets: [shed]\n")
    assert read_profile(str(shed_profile)).config.datasets == ("shed",)


OPTION = """
import json
import sys
import synfeal
from synfeal.cli import main
plans = [synfeal.plan("room.glb", frames=30, candidates=k) for k in (1, 8)]
print(json.dumps([plan.position_m[-1].tolist() for plan in plans]))
sys.exit(main(["collect", "room.glb", "--frames", "3", "--out", "made", "--candidates", "0"]))
"""


def test_the_three_lines_of_an_option_are_enough(tmp_path):
    """They are written into a copy of the package, where the page says."""
    rows = re.findall(r"^\|.*\| `(.+)` \|$", PAGE.read_text(), re.MULTILINE)
    field, value, keyword = [row for row in rows if row.startswith(("candidates", '"candidates'))]
    shutil.copytree(ROOT / "synfeal", tmp_path / "synfeal")
    config, api = tmp_path / "synfeal/config/collect.py", tmp_path / "synfeal/api.py"
    add(config, "    mode: Mode = _like(", f"    {field}")
    add(config, '                "mode": self.mode,', f"                {value}")
    add(api, "    mode: Mode\n", f"    {keyword}")
    box = trimesh.creation.box((6.0, 3.0, 5.0))  # y is up
    box.visual.vertex_colors = np.random.default_rng(0).integers(0, 256, (8, 4), np.uint8)
    box.export(tmp_path / "room.glb")
    run = python(OPTION, cwd=tmp_path, PYTHONPATH=str(tmp_path))
    assert run.returncode == 1, run.stderr
    assert "error: --candidates: must be 1 or more, found 0" in run.stderr
    of_one, of_eight = json.loads(run.stdout)
    assert of_one != of_eight  # the farther of eight targets is another


def add(path, before, line):
    text = path.read_text()
    assert text.count(before) == 1
    path.write_text(text.replace(before, f"{line}\n{before}"))
