"""What is removed from a mesh, what is kept, and that both are said."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import Findings, MeshPart
from synfeal.mesh.repair import repaired
from tests.mesh_samples import FACE, TRIANGLE


def repair(part):
    findings = Findings(Path("mesh.glb"))
    return repaired(part, findings), findings.sentences


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_points_and_lines_are_removed_but_slivers_stay(scale, offset):
    sliver = 1e-8 if offset == 0.0 else 1e-5
    vertices = np.array(
        [
            [0.1, 0.2, 0.3],
            [0.7, 0.2, 0.3],
            [0.1, 0.2 + sliver, 0.3],  # a sliver with the first two
            [0.2, 0.4, 0.6],
            [0.3, 0.6, 0.9],  # on one line with the first and the fourth
            [0.1, 0.2, 0.3],  # a copy of the first
        ]
    )
    faces = np.array([[0, 1, 2], [0, 3, 4], [0, 5, 1], [1, 1, 2], [0, 1, 4]])
    part, findings = repair(MeshPart("wall", vertices * scale + offset, faces))
    assert part.vertices_m[part.faces].shape == (2, 3, 3)
    assert findings[0] == "part 'wall': 3 zero-area faces removed"
    assert findings[1] == "part 'wall': 2 unused vertices removed"
    np.testing.assert_array_equal(part.faces, [[0, 1, 2], [0, 1, 3]])


def test_surfaces_open_and_non_manifold_are_kept_and_duplicates_removed(tmp_path):
    vertices = np.vstack([TRIANGLE, TRIANGLE, TRIANGLE + 9])
    faces = np.array([[0, 1, 2], [1, 2, 0], [2, 1, 0], [3, 4, 5], [6, 7, 8]])
    part, findings = repair(MeshPart("wall", vertices, faces))
    np.testing.assert_array_equal(part.faces, [[0, 1, 2], [3, 4, 5], [6, 7, 8]])
    assert findings == (
        "part 'wall': 2 duplicate faces removed",
        "part 'wall': 1 coincident face kept: their vertices or texture differ",
    )
    vertices = np.vstack([[[99.0, 99, 99]], TRIANGLE, [[np.nan] * 3]])
    rgb = np.arange(15, dtype=np.uint8).reshape(5, 3)
    uv = np.arange(10.0).reshape(5, 2)
    texture = np.zeros((2, 2, 3), np.uint8)
    part, findings = repair(MeshPart("wall", vertices, FACE + 1, uv, texture, rgb))
    np.testing.assert_array_equal(part.vertices_m, TRIANGLE)
    np.testing.assert_array_equal(part.vertex_rgb, rgb[1:4])
    np.testing.assert_array_equal(part.uv, uv[1:4])
    assert findings == ("part 'wall': 2 unused vertices removed",)
    # Three walls that meet in one edge: non-manifold there, open everywhere else.
    colours = np.array([[255, 0, 0, 255]] * 4 + [[0, 255, 0, 255]], np.uint8)
    vertices = np.array([[0.0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, -1, 0]])
    faces = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    trimesh.Trimesh(vertices, faces, vertex_colors=colours, process=False).export(
        tmp_path / "walls.ply"
    )
    mesh = load_mesh(tmp_path / "walls.ply")
    np.testing.assert_array_equal(mesh.parts[0].faces, faces)
    assert mesh.findings == ()
