"""Rays against triangles in double precision, triangle by triangle, and meshes to cast them on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from synfeal.mesh.rays import RayCaster

Array = NDArray[np.float64]
BAND = 1e-6  # what the ray caster promises: points moved by this share of the mesh's extent
STEEP = 1e-2  # cosine below which a moved point may turn a triangle's back to the ray


@dataclass(frozen=True)
class Solid:
    """A mesh that is a union of boxes (B, 2, 3) before it is turned, scaled and moved."""

    vertices: Array
    faces: NDArray[np.int64]
    boxes: Array
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

    def contains(self, points):
        """Whether points (N, 3) are inside, in the frame of ``boxes``: the closed form."""
        at = points[:, None, :]
        return ((at > self.boxes[:, 0]) & (at < self.boxes[:, 1])).all(axis=2).any(axis=1)

    def points(self, rng, count):
        """Points (count, 3) in and around it, in the frame of ``boxes``."""
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
    bounds = np.stack([np.zeros(3), sides])
    return trimesh.creation.box(bounds=bounds), bounds[None]


def l_shape(sides):
    """An L of two overlapping boxes, each arm a third as wide as the whole."""
    x, y, z = sides
    outline = [(0, 0), (x, 0), (x, y / 3), (x / 3, y / 3), (x / 3, y), (0, y)]
    mesh = prism(outline, z, [0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 5])
    arms = [[[0, 0, 0], [x, y / 3, z]], [[0, 0, 0], [x / 3, y, z]]]
    return mesh, np.array(arms, dtype=np.float64)


@st.composite
def solids(draw, watertight=False):
    """Boxes and Ls, from plates to needles, subdivided or not, near and far, small and large.

    With ``watertight`` false, shells that lack some of their faces are among them.
    """
    side = st.sampled_from([1e-3, 0.05, 0.7, 1.0, 3.0])
    sides = np.array(draw(st.permutations([1.0, draw(side), draw(side)])))
    mesh, boxes = draw(st.sampled_from([box, l_shape]))(sides)
    for _ in range(draw(st.integers(0, 2))):
        mesh = mesh.subdivide()
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    faces = np.asarray(mesh.faces)
    if not watertight and draw(st.booleans()):
        faces = faces[rng.permutation(len(faces))[: max(1, len(faces) // 2)]]
    turned = draw(st.booleans())
    rotation = Rotation.random(random_state=rng).as_matrix() if turned else np.eye(3)
    offset = draw(st.sampled_from([0.0, 1e6])) * np.array([1.0, -0.7, 0.3])
    scale = draw(st.sampled_from([1e-3, 1.0, 100.0]))
    return Solid(np.asarray(mesh.vertices), faces, boxes, rotation, scale, offset)


@dataclass(frozen=True)
class Crossings:
    """Where rays (N) meet the planes of triangles (F), and how surely they meet the triangles.

    Attributes:
        distance: (N, F) along the ray.
        slack: (N, F) how far that distance moves when the triangle's points move by the band.
        certain: (N, F) met by the ray wherever in their band the points are.
        possible: (N, F) met for some position of the points.
    """

    distance: Array
    slack: Array
    certain: NDArray[np.bool_]
    possible: NDArray[np.bool_]

    @property
    def upper(self):
        """(N,) farthest that a first hit may be."""
        return np.where(self.certain, self.distance + self.slack, np.inf).min(axis=1)

    @property
    def lower(self):
        """(N,) nearest that a first hit may be."""
        return np.where(self.possible, self.distance - self.slack, np.inf).min(axis=1)


def crossings(origins, directions, triangles, band):
    """Plane and edge tests in double precision; ``directions`` are unit vectors (N, 3).

    A triangle seen edge-on, or thinner than the band, can be met anywhere near its points.
    """
    edges = np.roll(triangles, -1, axis=1) - triangles
    normal = np.cross(edges[:, 0], edges[:, 1])
    double_area = np.linalg.norm(normal, axis=1)
    lengths = np.linalg.norm(edges, axis=2)
    normal /= double_area[:, None]
    cosine = np.abs(directions @ normal.T) - 4 * band * lengths.max(axis=1) / double_area
    flat = cosine > STEEP
    along = directions @ normal.T
    to_plane = np.einsum("nfc,fc->nf", triangles[None, :, 0] - origins[:, None], normal)
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = np.where(flat, to_plane / along, 0.0)
        slack = np.where(flat, band / cosine, 0.0)
    at = origins[:, None] + distance[..., None] * directions[:, None]
    inside = _depth_in_triangle(at, triangles, edges, normal)
    certain = flat & (inside > slack) & (distance > slack)
    possible = flat & (inside > -slack) & (distance > -slack)
    near, slope = _near_points(origins, directions, triangles, band)
    return Crossings(
        np.where(flat, distance, slope), slack, certain, np.where(flat, possible, near)
    )


def _depth_in_triangle(at, triangles, edges, normal):
    """Signed distance (N, F) of points in the planes from the triangle's edges, inside positive."""
    inward = np.cross(normal[:, None], edges)
    inward /= np.linalg.norm(inward, axis=2, keepdims=True)
    offset = at[:, :, None] - triangles[None]
    return np.einsum("nfec,fec->nfe", offset, inward).min(axis=2)


def _near_points(origins, directions, triangles, band):
    """Whether rays pass a triangle's bounding sphere (N, F), and the least distance to it."""
    centre = triangles.mean(axis=1)
    radius = np.linalg.norm(triangles - centre[:, None], axis=2).max(axis=1) + 2 * band
    to_centre = centre[None] - origins[:, None]
    along = np.einsum("nfc,nc->nf", to_centre, directions)
    across = np.linalg.norm(to_centre - along[..., None] * directions[:, None], axis=2)
    return (across < radius) & (along > -radius), np.maximum(along - radius, 0.0)


def directions_of(rng, count):
    """Unit vectors (count, 3), uniform on the sphere."""
    vectors = rng.normal(size=(count, 3))
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
