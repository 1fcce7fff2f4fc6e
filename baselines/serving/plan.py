"""A place seen from above, drawn of its mesh or of the features of its map."""

from __future__ import annotations

import io
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial.transform import Rotation

from baselines.references.mapped import StructureMap
from synfeal.geometry.poses import inverse
from synfeal.mesh.model import TexturedMesh

Array = NDArray[np.float64]

ACROSS = 360  # cells of the plan along its longer side
LEVEL_M = 0.1  # height of a storey of cells; walls fill many, floors one
MARGIN_M = 0.4
# Stray features lie far outside of a place; so many per cent on each side do not widen the plan.
STRAY_PERCENT = 1.0
SAMPLES = 400_000  # points on a mesh
FLAT = 2  # storeys that floor and ceiling fill, which surfaces have everywhere
FULL_PERCENT = 97.0  # per cent of the cells are no darker than black
GAMMA = 0.6
INK = 40  # grey level
# Cameras are held upright, give or take this angle; otherwise their mean says which way is up.
UPRIGHT_DEG = 35.0


class Plan(NamedTuple):
    """A place seen from above.

    Attributes:
        png: Grey picture with transparency, one pixel a cell.
        width_m: What it is across, metres.
        height_m: What it is from top to bottom.
        plan_from_world: Maps (4, 4) the world of poses to the plan: x to the right and y down
            from its top left corner, metres; z up.
    """

    png: bytes
    width_m: float
    height_m: float
    plan_from_world: Array


def plan_of(
    place: StructureMap, mesh: TexturedMesh | None, mesh_from_map: Array, out_from_map: Array
) -> Plan:
    """Draw a plan.

    Args:
        place: The map.
        mesh: Mesh of the place, if it is there.
        mesh_from_map: Rigid motion (4, 4) from the world of the map to that of the mesh.
        out_from_map: Rigid motion (4, 4) to the world that poses are given in.
    """
    upright = upright_from_map(place.world_from_cam)
    point_m = place.point_m[np.isfinite(place.point_m).all(axis=1)] @ upright.T
    camera_m = place.world_from_cam[:, :3, 3] @ upright.T
    low, high = np.percentile(point_m, [STRAY_PERCENT, 100 - STRAY_PERCENT], axis=0)
    low = np.minimum(low, camera_m.min(axis=0)) - MARGIN_M
    high = np.maximum(high, camera_m.max(axis=0)) + MARGIN_M
    if mesh is not None:
        map_from_mesh = inverse(mesh_from_map)
        sample_m = surface_points(mesh)
        point_m = (sample_m @ map_from_mesh[:3, :3].T + map_from_mesh[:3, 3]) @ upright.T
    turned = np.eye(3)
    if high[0] - low[0] < high[1] - low[1]:  # the longer side lies across the page
        turned = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    corners = np.stack([low, high]) @ turned.T
    low, high = corners.min(axis=0), corners.max(axis=0)
    down = np.diag([1.0, -1.0, 1.0])
    plan_from_map = np.eye(4)
    plan_from_map[:3, :3] = down @ turned @ upright
    plan_from_map[:3, 3] = [-low[0], high[1], -low[2]]
    size_m = high - low
    on_plan_m = (point_m @ turned.T) * [1.0, -1.0, 1.0] + plan_from_map[:3, 3]
    return Plan(
        png=_png(_walls(on_plan_m, size_m, flat=0 if mesh is None else FLAT)),
        width_m=float(size_m[0]),
        height_m=float(size_m[1]),
        plan_from_world=plan_from_map @ inverse(out_from_map),
    )


def upright_from_map(world_from_cam: Array) -> Array:
    """Find the rotation (3, 3) that turns what is up for the cameras of a map to z.

    Maps of renderings are upright. Those of photographs have the axes of their capture, of which
    the one that is nearest to the cameras' mean is taken.

    Args:
        world_from_cam: Poses (N, 4, 4) of the frames of the map.
    """
    up = -world_from_cam[:, :3, 1].mean(axis=0)
    length = float(np.linalg.norm(up))
    if length < np.cos(np.radians(60)):  # they look every way
        return np.eye(3)
    up /= length
    axis = int(np.argmax(np.abs(up)))
    along = np.sign(up[axis]) * np.eye(3)[axis]
    if up @ along > np.cos(np.radians(UPRIGHT_DEG)):
        up = along
    turn, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [up])
    return np.asarray(turn.as_matrix())


def surface_points(mesh: TexturedMesh) -> Array:
    """Draw points (n, 3) of a mesh, evenly over its surface."""
    vertices_m, faces = mesh.merged()
    first, second, third = np.moveaxis(vertices_m[faces], 1, 0)
    area = np.linalg.norm(np.cross(second - first, third - first), axis=1)
    rng = np.random.default_rng(0)
    chosen = rng.choice(len(faces), SAMPLES, p=area / area.sum())
    u, v = rng.random((2, SAMPLES, 1))
    beyond = u + v > 1
    u, v = np.where(beyond, 1 - u, u), np.where(beyond, 1 - v, v)
    origin = first[chosen]
    return np.asarray(origin + u * (second[chosen] - origin) + v * (third[chosen] - origin))


def _walls(point_m: Array, size_m: Array, flat: int) -> NDArray[np.uint8]:
    """Count in how many storeys of each cell there is something; return its darkness (H, W).

    Args:
        point_m: Points (n, 3) on the plan.
        size_m: Its size, and the height of the place.
        flat: Storeys of each cell that do not count.
    """
    cell_m = max(size_m[:2]) / ACROSS
    columns, rows = (max(1, int(np.ceil(side / cell_m))) for side in size_m[:2])
    inside = ((point_m >= 0) & (point_m < size_m)).all(axis=1)
    cell = np.floor(point_m[inside] / [cell_m, cell_m, LEVEL_M]).astype(np.int64)
    cell = np.unique(cell, axis=0)
    storeys = np.zeros((rows, columns))
    np.add.at(storeys, (cell[:, 1].clip(0, rows - 1), cell[:, 0].clip(0, columns - 1)), 1.0)
    storeys = np.maximum(storeys - flat, 0)
    filled = storeys[storeys > 0]
    if not len(filled):
        return np.zeros((rows, columns), np.uint8)
    dark = (storeys / np.percentile(filled, FULL_PERCENT)).clip(0, 1) ** GAMMA
    return np.asarray(np.round(255 * dark), np.uint8)


def _png(dark: NDArray[np.uint8]) -> bytes:
    image = Image.merge("LA", [Image.new("L", dark.shape[::-1], INK), Image.fromarray(dark)])
    stream = io.BytesIO()
    image.save(stream, "PNG", optimize=True)
    return stream.getvalue()
