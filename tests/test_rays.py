"""Ray queries against double-precision tests and closed forms.

The band is 1e-6 of the mesh's extent: the caster's answer must be that of the mesh with its points
moved by no more than that, which along a ray that meets a surface at an angle is band / cosine.
"""

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from synfeal.mesh.rays import RayCaster
from tests.ray_truth import BAND, box, crossings, directions_of, l_shape, solids

N_RAYS = 40
N_AIMED = 100_000
SEEDS = st.integers(0, 2**32 - 1)
fixed = settings(derandomize=True, deadline=None, max_examples=150)


@fixed
@given(solids(), SEEDS)
def test_first_hits_are_those_of_the_exact_test(solid, seed):
    rng = np.random.default_rng(seed)
    origins, directions = solid.world(solid.points(rng, N_RAYS)), directions_of(rng, N_RAYS)
    found = solid.caster().first_hit_m(origins, directions)
    truth = crossings(origins, directions, solid.triangles, BAND * solid.extent)
    assert (found >= 0.0).all()
    assert (found <= truth.upper).all()
    assert (found >= truth.lower).all()


@fixed
@given(solids(), SEEDS)
def test_lines_of_sight_are_those_of_the_exact_test(solid, seed):
    rng = np.random.default_rng(seed)
    origins, targets = solid.world(solid.points(rng, 2 * N_RAYS)).reshape(2, N_RAYS, 3)
    length = np.linalg.norm(targets - origins, axis=1)
    directions = (targets - origins) / length[:, None]
    truth = crossings(origins, directions, solid.triangles, BAND * solid.extent)
    free = solid.caster().sees(origins, targets)
    assert not free[truth.upper < length - BAND * solid.extent].any()
    assert free[truth.lower > length + BAND * solid.extent].all()


@fixed
@given(solids(watertight=True), SEEDS)
def test_an_odd_number_of_crossings_is_inside(solid, seed):
    rng = np.random.default_rng(seed)
    points, directions = solid.points(rng, N_RAYS), directions_of(rng, N_RAYS)
    origins, step = solid.world(points), 20 * BAND * solid.extent
    truth = crossings(origins, directions, solid.triangles, BAND * solid.extent)
    clear = (truth.certain == truth.possible).all(axis=1)
    met = np.sort(np.where(truth.possible, truth.distance, np.inf), axis=1)
    with np.errstate(invalid="ignore"):
        clear &= ~(np.diff(met, axis=1) < 2 * step).any(axis=1)
    count = count_hits(solid.caster(), origins[clear], directions[clear], step)
    np.testing.assert_array_equal(count, truth.certain[clear].sum(axis=1))
    np.testing.assert_array_equal(count % 2 == 1, solid.contains(points[clear]))


def count_hits(caster, origins, directions, step):
    """Surfaces (N,) along rays, each ray cast on from ``step`` behind its last hit."""
    count, at = np.zeros(len(origins), np.int64), origins.copy()
    for _ in range(20):
        hit = caster.first_hit_m(at, directions)
        met = np.isfinite(hit)
        count += met
        at[met] += (hit[met] + step)[:, None] * directions[met]
    return count


WATERTIGHT = {
    "box": box(np.array([2.0, 2.0, 2.0]))[0].subdivide().subdivide().subdivide(),
    "sphere": trimesh.creation.icosphere(subdivisions=3),
    "l-shape": l_shape(np.array([3.0, 2.0, 1.0]))[0].subdivide().subdivide(),
    "plate": box(np.array([2.0, 2.0, 0.01]))[0].subdivide().subdivide(),
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
    caster, band = RayCaster(*cube()), 2 * BAND
    origins = np.tile([0.0, 0.1, 0.2], (4, 1))
    targets = [[x, 0.1, 0.2] for x in (0.99, 1 - 2 * band, 1 + 2 * band, 1.01)]
    assert caster.sees(origins, targets).tolist() == [True, True, False, False]


def cube():
    mesh = trimesh.creation.box((2.0, 2.0, 2.0))
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)
