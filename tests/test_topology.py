"""Topology of meshes whose pieces, holes and volume are known."""

from collections import Counter

import numpy as np
import pytest
import trimesh

from synfeal.mesh.properties import mesh_topology


def arrays(mesh):
    return np.asarray(mesh.vertices, np.float64), np.asarray(mesh.faces, np.int64)


def test_a_closed_box_encloses_its_volume_with_a_sign():
    vertices, faces = arrays(trimesh.creation.box((2.0, 3.0, 4.0)))
    outward = mesh_topology(vertices + 1e3, faces)
    assert (outward.components, outward.boundary_edges, outward.non_manifold_edges) == (1, 0, 0)
    assert outward.watertight
    assert outward.hole_lengths_m == ()
    assert outward.enclosed_volume_m3 == pytest.approx(24.0)
    assert mesh_topology(vertices, faces[:, ::-1]).enclosed_volume_m3 == pytest.approx(-24.0)


def test_one_face_turned_over_leaves_no_inside():
    vertices, faces = arrays(trimesh.creation.box())
    faces[3] = faces[3, ::-1]
    topology = mesh_topology(vertices, faces)
    assert topology.watertight
    assert topology.enclosed_volume_m3 is None


def test_holes_are_measured_along_their_rims():
    box = trimesh.creation.box((2.0, 3.0, 4.0))
    vertices, faces = arrays(box)
    normals = np.asarray(box.face_normals)
    tube = mesh_topology(vertices, faces[np.abs(normals[:, 2]) < 0.5])
    assert tube.hole_lengths_m == pytest.approx([10.0, 10.0])
    lid_and_side = (normals[:, 2] > 0.5) | (normals[:, 0] > 0.5)
    cut = mesh_topology(vertices, faces[~lid_and_side])
    assert cut.hole_lengths_m == pytest.approx([10.0 + 14.0 - 2 * 3.0])  # their common edge is gone
    assert not cut.watertight


def test_three_faces_at_one_edge_are_not_a_surface():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 0]])
    topology = mesh_topology(vertices, np.array([[0, 1, 2], [0, 1, 3], [1, 0, 4]]))
    assert topology.non_manifold_edges == 1
    assert topology.boundary_edges == 6
    assert topology.enclosed_volume_m3 is None


def test_random_holes_against_counting_one_by_one():
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
