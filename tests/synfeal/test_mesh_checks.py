"""Checks before hours are spent: the sampling box, the merged mesh, and the files asked for."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import trimesh

from reproduction.config.load import load_config
from synfeal.config.load import read_yaml
from synfeal.errors import InputError
from synfeal.mesh.checks import check_sampling_box, repaired
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import Findings, MeshPart, TexturedMesh
from synfeal.mesh.properties import mesh_properties, mesh_topology
from tests.support.mesh_samples import FACE, TRIANGLE
from tests.workflow.test_workflow import snakemake

CONFIG = Path(__file__).parents[2] / "config"


@pytest.mark.parametrize(
    ("scale", "shift", "message"),
    [(1.0, 0.0, None), (1000.0, 0.0, "1000 times"), (1.0, 50.0, "outside"), (0.001, 2, "outside")],
)
def test_sampling_box_must_fit_the_mesh(scale, shift, message):
    bounds = np.array([[-1.0, -1, -1], [1, 1, 1]]) * scale + shift
    box = np.array([[-1.0, -1, -1], [1, 1, 1]])
    if message is None:
        check_sampling_box(box, bounds, "scenes.room")
        return
    with pytest.raises(InputError, match=message) as caught:
        check_sampling_box(box, bounds, "scenes.room")
    assert "unit_m" in str(caught.value)


@pytest.mark.parametrize("scene", ["large_room", "sanctuary"])
def test_scene_fragments_are_complete_configurations(scene):
    config = load_config(CONFIG / "config.yaml", CONFIG / "scenes" / f"{scene}.yaml")
    assert config.scenes[scene].source == "mesh"
    assert config.scenes[scene].min_view_distance_m == 1.2
    others = set(config.scenes) - {scene}
    assert {config.scenes[other].source for other in others} == {"procedural"}
    # Results of another mesh must not end up among those of the stand-ins.
    assert config.profile != read_yaml(CONFIG / "config.yaml")["profile"]
    assert (CONFIG / "scenes" / "README.md").is_file()


@pytest.mark.skipif((CONFIG.parent / "meshes/large_room.glb").exists(), reason="mesh is here")
def test_snakemake_stops_in_one_line_when_the_mesh_is_absent():
    run = snakemake("--dry-run", "--configfile", "config/scenes/large_room.yaml", "--", "all")
    assert run.returncode == 1
    errors = [line for line in run.stderr.splitlines() if line.startswith("error:")]
    assert len(errors) == 1
    for word in ("scenes.large_room.path", "meshes/large_room.glb", "config/scenes/README.md"):
        assert word in errors[0]
    assert "Traceback" not in run.stderr


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
    colors = np.array([[255, 0, 0, 255]] * 4 + [[0, 255, 0, 255]], np.uint8)
    vertices = np.array([[0.0, 0, 0], [0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, -1, 0]])
    faces = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])
    trimesh.Trimesh(vertices, faces, vertex_colors=colors, process=False).export(
        tmp_path / "walls.ply"
    )
    mesh = load_mesh(tmp_path / "walls.ply")
    np.testing.assert_array_equal(mesh.parts[0].faces, faces)
    assert mesh.findings == ()


def box_part(offset_m=0.0):
    box = trimesh.creation.box((2.0, 3.0, 4.0))
    return MeshPart("box", np.asarray(box.vertices) + offset_m, np.asarray(box.faces))


def test_a_box_in_closed_form_and_the_volume_of_a_bounding_box():
    properties = mesh_properties(TexturedMesh((box_part(),)))
    assert (properties["vertices"], properties["faces"], properties["parts"]) == (8, 12, 1)
    assert properties["volume_m3"] == pytest.approx(24.0)
    assert properties["extents_m"] == pytest.approx([2.0, 3.0, 4.0])
    assert properties["bounds_m"] == [[-1.0, -1.5, -2.0], [1.0, 1.5, 2.0]]
    assert properties["texture_pixels"] == 0
    two = TexturedMesh((box_part(), box_part(10.0)))
    assert mesh_properties(two)["volume_m3"] == pytest.approx(12.0 * 13.0 * 14.0)


def test_seam_copies_count_once_as_in_the_file_of_a_scan():
    part = box_part()
    rng = np.random.default_rng(0)
    corners = part.vertices_m[part.faces.ravel()] + rng.uniform(-1e-7, 1e-7, (36, 3))
    texture = np.zeros((5, 7, 3), np.uint8)
    unwrapped = MeshPart("box", corners, np.arange(36).reshape(-1, 3), rng.random((36, 2)), texture)
    properties = mesh_properties(TexturedMesh((unwrapped,)))
    assert (properties["vertices"], properties["vertices_with_seams"]) == (8, 36)
    assert properties["faces"] == 12
    assert properties["texture_pixels"] == 35


def arrays(mesh):
    return np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)


def test_what_is_closed_has_a_volume_with_a_sign():
    vertices, faces = arrays(trimesh.creation.box((2.0, 3.0, 4.0)))
    outward = mesh_topology(vertices + 1e3, faces)
    assert (outward["components"], outward["boundary_edges"], outward["non_manifold_edges"]) == (
        1,
        0,
        0,
    )
    assert outward["watertight"]
    assert outward["hole_lengths_m"] == []
    assert outward["enclosed_volume_m3"] == pytest.approx(24.0)
    assert mesh_topology(vertices, faces[:, ::-1])["enclosed_volume_m3"] == pytest.approx(-24.0)
    vertices, faces = arrays(trimesh.creation.box())
    faces[3] = faces[3, ::-1]
    topology = mesh_topology(vertices, faces)
    assert topology["watertight"]
    assert topology["enclosed_volume_m3"] is None
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0]])
    topology = mesh_topology(vertices, np.array([[0, 1, 2], [0, 1, 3], [1, 0, 4]]))
    assert topology["non_manifold_edges"] == 1
    assert topology["boundary_edges"] == 6
    assert topology["enclosed_volume_m3"] is None


def test_holes_are_measured_along_their_rims_as_by_counting():
    box = trimesh.creation.box((2.0, 3.0, 4.0))
    vertices, faces = arrays(box)
    normals = np.asarray(box.face_normals)
    tube = mesh_topology(vertices, faces[np.abs(normals[:, 2]) < 0.5])
    assert tube["hole_lengths_m"] == pytest.approx([10.0, 10.0])
    lid_and_side = (normals[:, 2] > 0.5) | (normals[:, 0] > 0.5)
    cut = mesh_topology(vertices, faces[~lid_and_side])
    assert cut["hole_lengths_m"] == pytest.approx(
        [10.0 + 14.0 - 2 * 3.0]
    )  # their common edge is gone
    assert not cut["watertight"]
    rng = np.random.default_rng(5)
    pieces = [trimesh.creation.icosphere(2).apply_translation([4.0 * i, 0, 0]) for i in range(3)]
    vertices, faces = arrays(trimesh.util.concatenate(pieces))
    faces = faces[rng.random(len(faces)) < 0.9]
    edges = Counter(frozenset((int(face[i]), int(face[i - 1]))) for face in faces for i in range(3))
    rim = [edge for edge, count in edges.items() if count == 1]
    length = sum(float(np.linalg.norm(np.subtract(*vertices[list(edge)]))) for edge in rim)
    topology = mesh_topology(vertices, faces)
    assert topology["components"] == 3
    assert topology["boundary_edges"] == len(rim) > 0
    assert sum(topology["hole_lengths_m"]) == pytest.approx(length)
    assert list(topology["hole_lengths_m"]) == sorted(topology["hole_lengths_m"], reverse=True)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("room.fbx", "is an FBX scene.*Blender"),
        ("room.usdz", "is a USDZ scene.*export glTF or OBJ from the app"),
        ("room.splat", "is a Gaussian splat.*has no surface"),
        ("room.las", "is a point cloud.*make a surface"),
        ("room.zip", "is an archive; unpack it"),
        ("room.MTL", "is a companion of a mesh"),
        ("room.foo", r"unknown kind of mesh '\.foo'; convert it to one of \.glb"),
    ],
)
def test_files_of_other_kinds_are_called_what_they_are(tmp_path, name, said):
    (tmp_path / name).write_bytes(b"x")
    with pytest.raises(InputError, match=said):
        load_mesh(tmp_path / name)
