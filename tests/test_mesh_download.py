"""A scene as its author published it: what is found in it, and the same scene in other formats."""

import os
from pathlib import Path

import numpy as np
import pytest

from synfeal.config.models import CameraConfig
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.load import load_mesh
from synfeal.mesh.save import save_glb
from synfeal.render import open_renderer

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif("SYNFEAL_TEST_MESHES" not in os.environ, reason="no downloaded meshes"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning:OpenGL.*"),
]
VIEWS = ((0.3, -1.5, -0.5), (2.4, 1.3, -1.3), (4.3, 0.5, 1.5))  # yaw, x, y
# Mean difference of two renders of one scene, of 255; the sharper the renderer, the more it shows
# of what one colour every 4 cm loses.
LIMIT = 2.5


@pytest.fixture(scope="module")
def greenhouse():
    folder = Path(os.environ["SYNFEAL_TEST_MESHES"]) / "botanists-greenhouse"
    return load_mesh(folder / "scene.gltf")


def views(mesh):
    with open_renderer(mesh, CameraConfig(width=320, height=240)) as renderer:
        poses = [
            pose_matrix(rotation_from_rpy([0.0, 0.1, yaw]), [x, y, 1.5]) for yaw, x, y in VIEWS
        ]
        return [renderer.render(pose).astype(np.float64) for pose in poses]


def test_it_stands_upright(greenhouse):
    assert greenhouse.n_faces > 7000
    room = next(part for part in greenhouse.parts if "Room" in part.name)
    leaves = next(part for part in greenhouse.parts if "Plants" in part.name)
    assert leaves.alpha_cutoff == pytest.approx(0.9077, abs=1e-4)
    assert room.vertices_m[:, 2].max() == greenhouse.bounds_m[1, 2]  # the roof is on top


def test_every_problem_is_named(greenhouse):
    findings = "\n".join(greenhouse.findings)
    for words in (
        "'textures/M_Glass_01_baseColor.png' of material 'M_Glass_01' is missing",
        "'M_Glass_01': its transparency was in its texture; drawn opaque",
        "14 missing textures hold no colour and are not needed",
        "'M_Plants_01': alpha-tested at 0.91",
        "'M_Vines_01': alpha-tested at 0.89",
        "'M_Light_01': texture converted from LA to 8-bit RGBA",
        "'M_Light_01': blended transparency becomes an alpha test at 0.5",
        "'Greenhouse_M_Light_01_0': nowhere opaque enough to be seen",
    ):
        assert words in findings
    assert len(greenhouse.findings) == 8


def test_saved_and_read_again_it_looks_the_same(greenhouse, tmp_path):
    save_glb(tmp_path / "mesh.glb", greenhouse)
    again = load_mesh(tmp_path / "mesh.glb")
    for image, expected in zip(views(again), views(greenhouse), strict=True):
        assert expected.std() > 10.0  # something is to be seen
        assert np.abs(image - expected).mean() < LIMIT
