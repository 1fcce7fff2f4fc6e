"""One pass of TORO over all edges, compiled.

Every edge starts from what the edge before left behind, so there is nothing to vectorise over; in
NumPy the same pass takes a hundred times as long.

Rotations are unit quaternions, wxyz. A node's parameter is ``parent_from_node``; a path passes it
upwards (its inverse) or downwards.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
compiled = numba.njit(cache=True)


def _product(a: Array, b: Array) -> Array:
    """Multiply quaternions and normalise: rounding must not add up over many passes."""
    c = np.empty(4)
    c[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
    c[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
    c[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
    c[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
    return c / math.sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2] + c[3] * c[3])


def _inverse(a: Array) -> Array:
    """Return the conjugate of a unit quaternion."""
    return np.array([a[0], -a[1], -a[2], -a[3]])


def _rotated(a: Array, v: Array) -> Array:
    """Turn a vector (3,) by a unit quaternion."""
    tx = 2.0 * (a[2] * v[2] - a[3] * v[1])
    ty = 2.0 * (a[3] * v[0] - a[1] * v[2])
    tz = 2.0 * (a[1] * v[1] - a[2] * v[0])
    w = np.empty(3)
    w[0] = v[0] + a[0] * tx + a[2] * tz - a[3] * ty
    w[1] = v[1] + a[0] * ty + a[3] * tx - a[1] * tz
    w[2] = v[2] + a[0] * tz + a[1] * ty - a[2] * tx
    return w


def _part(a: Array, share: float) -> Array:
    """Return the rotation about the axis of ``a`` by ``share`` of its angle, the short way."""
    sine = math.sqrt(a[1] * a[1] + a[2] * a[2] + a[3] * a[3])
    c = np.array([1.0, 0.0, 0.0, 0.0])
    if sine > 0.0:
        half = share * math.atan2(sine, abs(a[0]))
        scale = math.copysign(math.sin(half) / sine, a[0])
        c[0], c[1:] = math.cos(half), scale * a[1:]
    return c


_product, _inverse = compiled(_product), compiled(_inverse)
_rotated, _part = compiled(_rotated), compiled(_part)


@compiled
def sweep(
    quat_wxyz: Array,
    position_m: Array,
    first: NDArray[np.int64],
    nodes: NDArray[np.int64],
    upward: NDArray[np.bool_],
    shares: Array,
    gains: Array,
    measured_quat: Array,
    measured_m: Array,
) -> None:
    """Correct all edges in turn; ``quat_wxyz`` (n, 4) and ``position_m`` (n, 3) change in place.

    Args:
        quat_wxyz: Rotations of ``parent_from_node``.
        position_m: Translations likewise.
        first: (E + 1,) where the path of each edge begins in the arrays that follow.
        nodes: (P,) nodes of all paths, one path after the other.
        upward: (P,) whether the path passes the node's parameter towards the parent.
        shares: (P, 2) cumulative weights along the paths, rotation and translation.
        gains: (E, 2) likewise.
        measured_quat: (E, 4) rotations of the measured motions.
        measured_m: (E, 3) their translations.
    """
    longest = np.max(first[1:] - first[:-1])
    turned, place = np.empty((longest + 1, 4)), np.zeros((longest + 1, 3))
    turned[0] = np.array([1.0, 0.0, 0.0, 0.0])
    for edge in range(len(first) - 1):
        path = range(first[edge], first[edge + 1])
        for k, p in enumerate(path):
            step = quat_wxyz[nodes[p]]
            turned[k + 1] = _product(turned[k], _inverse(step) if upward[p] else step)
        length = len(path)
        residual = _product(measured_quat[edge], _inverse(turned[length]))
        for k, p in enumerate(path):
            part = _part(residual, gains[edge, 0] * shares[p, 0])
            turned[k + 1] = _product(part, turned[k + 1])
            move, step_m = _product(_inverse(turned[k]), turned[k + 1]), position_m[nodes[p]]
            quat_wxyz[nodes[p]] = _inverse(move) if upward[p] else move
            step_m = -_rotated(move, step_m) if upward[p] else step_m.copy()
            place[k + 1] = place[k] + _rotated(turned[k], step_m)
        offset_m = gains[edge, 1] * (measured_m[edge] - place[length])
        for k, p in enumerate(path):
            share, before = shares[p, 1], shares[p - 1, 1] if k else 0.0
            step_m = place[k + 1] - place[k] + (share - before) * offset_m
            step_m = _rotated(_inverse(turned[k]), step_m)
            if upward[p]:
                step_m = -_rotated(quat_wxyz[nodes[p]], step_m)
            position_m[nodes[p]] = step_m
