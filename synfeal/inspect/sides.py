"""Which side of its faces a mesh shows to cameras in it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from trimesh.triangles import cross

from synfeal.inspect.freespace import FreeSpace
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster

N_RAYS = 5000


def back_face_share(mesh: TexturedMesh, caster: RayCaster, space: FreeSpace) -> float | None:
    """Share of what random rays from the clear points of a space hit that is a back side.

    A face shows its front where its vertices run counter-clockwise. None if nothing is hit.

    Args:
        mesh: the mesh.
        caster: rays against all of its faces, in their order.
        space: where cameras can be.
    """
    index = np.argwhere(space.is_clear)
    if not len(index):
        return None
    rng = np.random.default_rng(0)
    index = index[rng.integers(len(index), size=N_RAYS)]
    start = np.stack([axis[index[:, i]] for i, axis in enumerate(space.axes_m)], axis=1)
    direction: NDArray[np.float64] = rng.standard_normal((N_RAYS, 3))
    _, face = caster.first_hits(start, direction)
    vertices, faces = mesh.merged()
    hit = face >= 0
    if not hit.any():
        return None
    normal = cross(vertices[faces[face[hit]]])
    return float(np.mean(np.einsum("ni,ni->n", normal, direction[hit]) > 0.0))
