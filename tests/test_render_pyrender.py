"""What only the pyrender backend has."""

import numpy as np
import pytest

from synfeal.errors import InputError
from synfeal.mesh.model import MeshPart
from synfeal.render import pyrender_backend
from synfeal.render.pieces import pieces


def test_without_egl_the_packages_are_named(monkeypatch):
    def fail():
        raise ImportError("libEGL.so.1: cannot open shared object file")

    monkeypatch.setattr(pyrender_backend, "_pyrender", fail)
    with pytest.raises(InputError, match="libegl1 libgl1-mesa-dri"):
        pyrender_backend._context.__wrapped__()


def test_parts_with_too_many_vertices_are_drawn_in_pieces():
    rng = np.random.default_rng(0)
    vertices = rng.normal(size=(300, 3))
    faces = rng.integers(0, 300, (500, 3))
    uv, rgb = rng.random((300, 2)), rng.integers(0, 255, (300, 3), np.uint8)
    part = MeshPart("part", vertices, faces, uv, vertex_rgb=rgb)
    split = list(pieces(part, most_vertices=90))
    assert max(len(piece.vertices_m) for piece in split) <= 90
    for name, whole in (("vertices_m", vertices), ("uv", uv), ("vertex_rgb", rgb)):
        corners = np.concatenate([getattr(piece, name)[piece.faces] for piece in split])
        np.testing.assert_array_equal(corners, whole[faces])
    assert list(pieces(part, most_vertices=300)) == [part]
