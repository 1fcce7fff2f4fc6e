"""The numbers of Table 1."""

import numpy as np
import pytest
import trimesh

from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.properties import mesh_properties


def box_part(offset_m=0.0):
    box = trimesh.creation.box((2.0, 3.0, 4.0))
    return MeshPart("box", np.asarray(box.vertices) + offset_m, np.asarray(box.faces))


def test_a_box_in_closed_form():
    properties = mesh_properties(TexturedMesh((box_part(),)))
    assert (properties["vertices"], properties["faces"], properties["parts"]) == (8, 12, 1)
    assert properties["volume_m3"] == pytest.approx(24.0)
    assert properties["extents_m"] == pytest.approx([2.0, 3.0, 4.0])
    assert properties["bounds_m"] == [[-1.0, -1.5, -2.0], [1.0, 1.5, 2.0]]
    assert properties["texture_pixels"] == 0


def test_volume_is_that_of_the_bounding_box():
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
