"""A package from outside that builds scenes, found by its entry point as any installed one is."""

import subprocess
import sys

import numpy as np
import pytest
import trimesh
from pydantic import ValidationError

from synfeal.collection.prepare import build_scene
from synfeal.config.collection import SceneConfig
from synfeal.config.load import describe
from synfeal.errors import InputError
from tests.support.added_methods import block

MODULE = (
    block("`sheds.py`:", "python")
    + """

def box(name, seed):
    return trimesh.creation.box()
"""
)
BUILDS = """
from pathlib import Path
from synfeal.collection.prepare import prepare_scene
from synfeal.config.collection import SceneConfig

scene = SceneConfig(source="procedural", builder="shed")
prepare_scene("shed", scene, None, 2, Path("made/mesh.glb"))
"""


@pytest.fixture
def site(tmp_path):
    """A folder of packages that holds one, as pip would leave it there."""
    site = tmp_path / "site"
    info = site / "sheds-1.0.dist-info"
    info.mkdir(parents=True)
    (site / "sheds.py").write_text(MODULE)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: sheds\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[synfeal.scene_builders]\nshed = sheds:build\n")
    return site


def test_a_package_from_outside_adds_a_builder(site, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(site), prepend=":")
    subprocess.run([sys.executable, "-c", BUILDS], cwd=tmp_path, check=True)
    made = trimesh.load(tmp_path / "made" / "mesh.glb", force="mesh")
    np.testing.assert_allclose(sorted(made.extents), [2.0, 3.0, 6.0])  # 4 m and the seed


def test_its_name_is_taken_where_it_is_installed(site, monkeypatch):
    monkeypatch.syspath_prepend(site)
    assert SceneConfig(source="procedural", builder="shed").builder == "shed"


def test_an_unknown_name_is_refused_with_those_that_are_installed():
    with pytest.raises(ValidationError) as caught:
        SceneConfig(source="procedural", builder="shed")
    said = describe(caught.value)
    assert said.startswith("builder: must be a builder that is installed: ")
    assert "large_room" in said
    assert "found 'shed'" in said


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("nowhere:build", "does not load .*nowhere"),
        ("sheds:make", "does not load .*make"),
        ("sheds", "sheds is no function; .*sheds:build"),
        ("sheds:box", "returned a Trimesh, not a TexturedMesh"),
    ],
)
def test_an_entry_point_that_is_no_builder_is_refused(value, said, site, monkeypatch):
    entries = site / "sheds-1.0.dist-info" / "entry_points.txt"
    entries.write_text(f"[synfeal.scene_builders]\nshed = {value}\n")
    monkeypatch.syspath_prepend(site)
    with pytest.raises(InputError, match=f"entry point shed of synfeal.scene_builders: {said}"):
        build_scene("shed", 0)
