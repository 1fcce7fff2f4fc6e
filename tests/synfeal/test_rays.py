"""Ray queries against double-precision tests and closed forms.

The band is 1e-6 of the mesh's extent: the caster's answer must be that of the mesh with its points
moved by no more than that, which along a ray that meets a surface at an angle is band / cosine.
"""

from dataclasses import dataclass

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from synfeal.mesh.rays import RayCaster

pytestmark = pytest.mark.portable

Array = NDArray[np.float64]
BAND = 1e-6  # what the ray caster promises: points moved by this share of the mesh's extent


@dataclass(frozen=True)
class Solid:
    """A mesh before it is turned, scaled and moved."""

    vertices: Array
    faces: NDArray[np.int64]
    rotation: Array
    scale: float
    offset: Array

    def world(self, points):
        return points @ self.rotation.T * self.scale + self.offset

    def caster(self):
        return RayCaster(self.world(self.vertices), self.faces)

    @property
    def triangles(self):
        """(F, 3, 3), world."""
        return self.world(self.vertices)[self.faces]

    @property
    def extent(self):
        """Longest side of the bounding box, world."""
        return float(np.ptp(self.world(self.vertices), axis=0).max())

    def points(self, rng, count):
        """Points (count, 3) in and around it, before it is turned, scaled and moved."""
        lower, upper = self.vertices.min(axis=0), self.vertices.max(axis=0)
        margin = 0.2 * np.max(upper - lower)
        return rng.uniform(lower - margin, upper + margin, (count, 3))


def prism(outline, height, triangles):
    """A watertight prism over a counter-clockwise outline with the given floor triangles."""
    n = len(outline)
    floor = np.hstack([np.array(outline), np.zeros((n, 1))])
    lids = np.array(triangles).reshape(-1, 3)
    ring = np.arange(n)
    following = np.roll(ring, -1)
    sides = np.vstack([np.c_[ring, following, following + n], np.c_[ring, following + n, ring + n]])
    faces = np.vstack([lids[:, ::-1], lids + n, sides])
    return trimesh.Trimesh(
        np.vstack([floor, floor + np.array([0.0, 0.0, height])]), faces, process=False
    )


def box(sides):
    return trimesh.creation.box(bounds=[np.zeros(3), sides])


def l_shape(sides):
    """An L of two overlapping boxes, each arm a third as wide as the whole."""
    x, y, z = sides
    outline = [(0, 0), (x, 0), (x, y / 3), (x / 3, y / 3), (x / 3, y), (0, y)]
    return prism(outline, z, [0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 5])


@st.composite
def solids(draw):
    """Boxes and Ls from plates to needles, fine or coarse, near and far, whole or in part."""
    side = st.sampled_from([1e-3, 0.05, 0.7, 1.0, 3.0])
    sides = np.array(draw(st.permutations([1.0, draw(side), draw(side)])))
    mesh = draw(st.sampled_from([box, l_shape]))(sides)
    for _ in range(draw(st.integers(0, 2))):
        mesh = mesh.subdivide()
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    faces = np.asarray(mesh.faces)
    if draw(st.booleans()):
        faces = faces[rng.permutation(len(faces))[: max(1, len(faces) // 2)]]
    turned = draw(st.booleans())
    rotation = Rotation.random(random_state=rng).as_matrix() if turned else np.eye(3)
    offset = draw(st.sampled_from([0.0, 1e6])) * np.array([1.0, -0.7, 0.3])
    scale = draw(st.sampled_from([1e-3, 1.0, 100.0]))
    return Solid(np.asarray(mesh.vertices), faces, rotation, scale, offset)


def first_hits(origins, directions, triangles, band):
    """Distances (N,) along unit vectors by Moeller and Trumbore, in double precision.

    With how far each may move when all points move by the band, and which rays pass so near to an
    edge, or so flat over a triangle, that the band decides whether they meet it.
    """
    a, ab, ac = (
        triangles[:, 0],
        triangles[:, 1] - triangles[:, 0],
        triangles[:, 2] - triangles[:, 0],
    )
    normal = np.cross(ab, ac)
    double_area = np.linalg.norm(normal, axis=1)
    least_height = double_area / np.linalg.norm([ab, ac, ac - ab], axis=2).max(axis=0)
    cosine = np.abs(directions @ normal.T) / double_area
    offset = origins[:, None] - a
    across = np.cross(directions[:, None], ac)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 1.0 / np.einsum("nfc,fc->nf", across, ab)
        u = np.einsum("nfc,nfc->nf", offset, across) * scale
        around = np.cross(offset, ab)
        v = np.einsum("nc,nfc->nf", directions, around) * scale
        distance = np.einsum("fc,nfc->nf", ac, around) * scale
        slack = 2 * band / cosine
        inside = np.minimum(np.minimum(u, v), 1 - u - v)
        margin = 4 * slack / least_height
    met = (inside > 0) & (distance > 0)
    clear = (np.abs(inside) > margin) & (np.abs(distance) > slack)
    flat = margin > 0.1
    near = np.linalg.norm(
        np.cross(triangles.mean(1) - origins[:, None], directions[:, None]), axis=2
    )
    near = near < np.linalg.norm([ab, ac], axis=2).max()
    doubtful = ((~clear & (inside > -margin)) | (flat & near)).any(axis=1)
    distance = np.where(met, distance, np.inf)
    nearest = distance.argmin(axis=1)
    rows = np.arange(len(origins))
    return distance[rows, nearest], slack[rows, nearest], doubtful


def directions_of(rng, count):
    """Unit vectors (count, 3), uniform on the sphere."""
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


N_RAYS = 40
N_AIMED = 100_000
SEEDS = st.integers(0, 2**32 - 1)
fixed = settings(derandomize=True, deadline=None, max_examples=150)


@fixed
@given(solids(), SEEDS)
def test_first_hits_and_lines_of_sight_are_those_in_double_precision(solid, seed):
    rng, band = np.random.default_rng(seed), BAND * solid.extent
    origins, directions = solid.world(solid.points(rng, N_RAYS)), directions_of(rng, N_RAYS)
    caster = solid.caster()
    found = caster.first_hit_m(origins, directions)
    assert (found >= 0.0).all()
    expected, slack, doubtful = first_hits(origins, directions, solid.triangles, band)
    met = np.isfinite(expected)
    np.testing.assert_array_equal(np.isfinite(found)[~doubtful], met[~doubtful])
    sure = met & ~doubtful
    assert (np.abs(found[sure] - expected[sure]) <= slack[sure]).all()
    reach = rng.uniform(0, 2 * solid.extent, N_RAYS)
    free = caster.sees(origins, origins + reach[:, None] * directions)
    assert not free[sure & (expected < reach - slack)].any()
    assert free[~doubtful & (np.where(met, expected - slack, np.inf) > reach)].all()


WATERTIGHT = {
    "box": box([2.0, 2.0, 2.0]).subdivide().subdivide().subdivide(),
    "sphere": trimesh.creation.icosphere(subdivisions=3),
    "l-shape": l_shape([3.0, 2.0, 1.0]).subdivide().subdivide(),
    "plate": box([2.0, 2.0, 0.01]).subdivide().subdivide(),
}


@pytest.mark.parametrize("offset", [0.0, 1e6])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 100.0])
@pytest.mark.parametrize("name", WATERTIGHT)
def test_no_ray_leaks_through_an_edge_or_a_vertex(name, scale, offset):
    mesh, rng = WATERTIGHT[name], np.random.default_rng(5)
    assert mesh.is_watertight
    vertices = np.asarray(mesh.vertices) * scale + offset
    extent = np.ptp(vertices, axis=0).max()
    ends = vertices[mesh.edges_unique[rng.integers(0, len(mesh.edges_unique), N_AIMED)]]
    share = rng.uniform(0, 1, (N_AIMED, 1))
    share[: N_AIMED // 2] = 0.0  # half of them at vertices
    targets = (1 - share) * ends[:, 0] + share * ends[:, 1]
    around = np.array([0.5, 0.3, 0.5]) if name == "l-shape" else mesh.bounds.mean(axis=0)
    near = 0.2 * np.ptp(mesh.bounds, axis=0).min()
    origins = (around + rng.uniform(-near, near, (N_AIMED, 3))) * scale + offset
    beyond = origins + (targets - origins) * 1.01
    caster = RayCaster(vertices, mesh.faces)
    late = caster.first_hit_m(origins, targets - origins) - np.linalg.norm(
        targets - origins, axis=1
    )
    assert int(np.sum(late > 1e-3 * extent)) == 0
    assert int(np.sum(caster.sees(origins, beyond))) == 0


def test_sees_stops_at_a_wall_but_not_before_it():
    caster, band = RayCaster(WATERTIGHT["box"].vertices - 1.0, WATERTIGHT["box"].faces), 2 * BAND
    origins = np.tile([0.0, 0.1, 0.2], (4, 1))
    targets = [[x, 0.1, 0.2] for x in (0.99, 1 - 2 * band, 1 + 2 * band, 1.01)]
    assert caster.sees(origins, targets).tolist() == [True, True, False, False]


def test_a_point_that_is_not_finite_sees_nothing():
    caster = RayCaster(WATERTIGHT["box"].vertices - 1.0, WATERTIGHT["box"].faces)
    targets = np.array([[np.nan, 0.0, 0.0], [np.inf, 0.0, 0.0], [0.0, 0.1, 0.0]])
    assert caster.sees(np.zeros((3, 3)), targets).tolist() == [False, False, True]
