"""Depth of features from other frames that see them: for photographs with poses and no depth.

A feature is matched with those of the frames that look most alike. Each match gives the depth at
which the feature's ray passes nearest to the other's, by least squares; the depth that the most
matches agree with, to a few pixels, is refined on all of them. Three rays must meet: two always
nearly do.

Source: Hartley and Zisserman, Multiple View Geometry, 2nd edition, 12.2 (linear triangulation), for
the one unknown that is left where a ray is given.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from baselines.references.arrays import Vectors, most_alike
from baselines.references.correspondences import mutual_matches
from baselines.references.features import Features
from synfeal.records.progress import Progress

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

NEIGHBOURS = 12  # frames that each is matched with
RATIO = 0.8
# Largest distance of a match from where the point would be seen, in pixels of the frames.
MAX_ERROR_PX = 2.0
FEWEST_AGREEING = 2  # other frames
# Least angle between the rays that meet: below, a pixel's error moves the point along them at will.
LEAST_PARALLAX_RAD = np.radians(1.5)


def triangulated(
    features: Features, world_from_cam: Array, vectors: Vectors, focal_px: float
) -> Features:
    """Find the depth of features, and leave out those that have none.

    Args:
        features: Features of N frames; their depth is not looked at.
        world_from_cam: Poses (N, 4, 4).
        vectors: Unit vectors (N, D) by which frames look alike.
        focal_px: Focal length of the frames.
    """
    count = len(world_from_cam)
    alike = most_alike(vectors, vectors, min(NEIGHBOURS + 1, count))
    roots = [features.roots(frame) for frame in range(count)]
    depth_m = np.full(len(features.slope), np.nan)
    with Progress(count, "triangulated") as progress:
        for frame in range(count):
            own = features.of(frame)
            found: list[tuple[Rows, Array, Array]] = []
            for other in alike[frame]:
                if other == frame:
                    continue
                rows, others = mutual_matches(roots[frame], roots[int(other)], RATIO)
                offset, direction = _ray_in(
                    world_from_cam[frame], world_from_cam[other], features.slope[own][rows]
                )
                seen = features.slope[features.start[other] + others]
                found.append((rows, np.stack([offset, direction], axis=1), seen))
            if found:
                rows, rays, seen = (np.concatenate(part) for part in zip(*found, strict=True))
                depth_m[own] = depths_of(
                    rows, rays, seen, len(roots[frame]), MAX_ERROR_PX / focal_px
                )
            progress.update()
    return _with_depth(features, depth_m)


def _ray_in(world_from_own: Array, world_from_other: Array, slope: Array) -> tuple[Array, Array]:
    """Return rays (n) of one camera in another's coordinates: starts (n, 3), and steps (n, 3).

    A point at depth d along the axis of the first is at ``start + d * step`` in the second.
    """
    turn = world_from_other[:3, :3].T
    step = np.column_stack([slope, np.ones(len(slope))]) @ (turn @ world_from_own[:3, :3]).T
    start = turn @ (world_from_own[:3, 3] - world_from_other[:3, 3])
    return np.broadcast_to(start, step.shape), step


def depths_of(rows: Rows, rays: Array, seen: Array, count: int, most_off: float) -> Array:
    """Find the depth (count,) of the features of one frame from their matches.

    Args:
        rows: Feature (m,) that each match is of.
        rays: Starts and steps (m, 2, 3) of its ray in the other frame's camera.
        seen: Slopes (m, 2) at which the other frame sees it.
        count: Features of the frame.
        most_off: Largest difference of two slopes of one point.

    Returns:
        Depth along the axis of the frame, NaN where too few rays meet.
    """
    start, step = rays[:, 0], rays[:, 1]
    # (start + d step) projects to seen: d (step_xy - seen step_z) = seen start_z - start_xy.
    slant = step[:, :2] - seen * step[:, 2:]
    wanted = seen * start[:, 2:] - start[:, :2]
    with np.errstate(divide="ignore", invalid="ignore"):
        alone = (slant * wanted).sum(axis=1) / (slant**2).sum(axis=1)
    depth = np.full(count, np.nan)
    order = np.argsort(rows, kind="stable")
    for group in np.split(order, np.flatnonzero(np.diff(rows[order])) + 1):
        if len(group) < FEWEST_AGREEING:
            continue
        tried = alone[group]
        agree = _agreeing(tried, start[group], step[group], seen[group], most_off)
        best = agree[agree.sum(axis=1).argmax()]
        if best.sum() < FEWEST_AGREEING:
            continue
        chosen = group[best]
        found = _refined(slant[chosen], wanted[chosen], start[chosen], step[chosen], tried[best])
        if found > 0 and _parallax_rad(start[chosen], step[chosen], found) >= LEAST_PARALLAX_RAD:
            depth[rows[group[0]]] = found
    return depth


def _agreeing(
    tried: Array, start: Array, step: Array, seen: Array, most_off: float
) -> NDArray[np.bool_]:
    """Tell for each depth tried (m,) which matches (m,) see the point where they should."""
    point = start[None] + tried[:, None, None] * step[None]
    with np.errstate(divide="ignore", invalid="ignore"):
        off = np.linalg.norm(point[..., :2] / point[..., 2:] - seen[None], axis=-1)
    front = (point[..., 2] > 0) & (tried > 0)[:, None]
    return np.asarray(front & (off <= most_off))


def _refined(slant: Array, wanted: Array, start: Array, step: Array, tried: Array) -> float:
    """Solve for the depth by least squares of errors in the images.

    The equations are errors times depth in the other frame, which the median depth divides out.
    """
    weight = 1.0 / (start[:, 2] + float(np.median(tried)) * step[:, 2])[:, None]
    slant, wanted = slant * weight, wanted * weight
    return float((slant * wanted).sum() / (slant**2).sum())


def _parallax_rad(start: Array, step: Array, depth: float) -> float:
    """Return the largest angle at which the rays of other frames meet the own one."""
    point = start + depth * step  # seen from the other frame's centre
    norms = np.linalg.norm(point, axis=1) * np.linalg.norm(step, axis=1)
    cosine = (point * step).sum(axis=1) / norms
    return float(np.arccos(np.clip(cosine, -1.0, 1.0)).max())


def _with_depth(features: Features, depth_m: Array) -> Features:
    """Keep the features whose depth is known."""
    good = np.isfinite(depth_m)
    kept = np.concatenate([[0], np.cumsum(good)])
    return Features(
        start=kept[features.start].astype(np.int64),
        slope=features.slope[good],
        depth_m=depth_m[good],
        descriptor=features.descriptor[good],
    )
