"""The numbers of Table 1, and topology of meshes whose pieces, holes and volume are known."""

from collections import Counter

import numpy as np
import pytest
import trimesh

from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.properties import mesh_properties, mesh_topology


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
    assert (outward.components, outward.boundary_edges, outward.non_manifold_edges) == (1, 0, 0)
    assert outward.watertight
    assert outward.hole_lengths_m == ()
    assert outward.enclosed_volume_m3 == pytest.approx(24.0)
    assert mesh_topology(vertices, faces[:, ::-1]).enclosed_volume_m3 == pytest.approx(-24.0)
    vertices, faces = arrays(trimesh.creation.box())
    faces[3] = faces[3, ::-1]
    topology = mesh_topology(vertices, faces)
    assert topology.watertight
    assert topology.enclosed_volume_m3 is None
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0]])
    topology = mesh_topology(vertices, np.array([[0, 1, 2], [0, 1, 3], [1, 0, 4]]))
    assert topology.non_manifold_edges == 1
    assert topology.boundary_edges == 6
    assert topology.enclosed_volume_m3 is None


def test_holes_are_measured_along_their_rims_as_by_counting():
    box = trimesh.creation.box((2.0, 3.0, 4.0))
    vertices, faces = arrays(box)
    normals = np.asarray(box.face_normals)
    tube = mesh_topology(vertices, faces[np.abs(normals[:, 2]) < 0.5])
    assert tube.hole_lengths_m == pytest.approx([10.0, 10.0])
    lid_and_side = (normals[:, 2] > 0.5) | (normals[:, 0] > 0.5)
    cut = mesh_topology(vertices, faces[~lid_and_side])
    assert cut.hole_lengths_m == pytest.approx([10.0 + 14.0 - 2 * 3.0])  # their common edge is gone
    assert not cut.watertight
    rng = np.random.default_rng(5)
    pieces = [trimesh.creation.icosphere(2).apply_translation([4.0 * i, 0, 0]) for i in range(3)]
    vertices, faces = arrays(trimesh.util.concatenate(pieces))
    faces = faces[rng.random(len(faces)) < 0.9]
    edges = Counter(frozenset((int(face[i]), int(face[i - 1]))) for face in faces for i in range(3))
    rim = [edge for edge, count in edges.items() if count == 1]
    length = sum(float(np.linalg.norm(np.subtract(*vertices[list(edge)]))) for edge in rim)
    topology = mesh_topology(vertices, faces)
    assert topology.components == 3
    assert topology.boundary_edges == len(rim) > 0
    assert sum(topology.hole_lengths_m) == pytest.approx(length)
    assert list(topology.hole_lengths_m) == sorted(topology.hole_lengths_m, reverse=True)
