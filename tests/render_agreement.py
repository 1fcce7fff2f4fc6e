"""How far the rendering backends agree: differences of colour and depth, away from edges."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from synfeal.config.models import RenderConfig
from synfeal.render.base import Depth, Rgb
from synfeal.render.choose import BACKENDS

CLOSE_M = 1e-3
JUMP = 0.02  # neighbours whose depths differ by more than this share lie on either side of an edge


class Frames(NamedTuple):
    """Images of one backend: colours (N, H, W, 3) and depth (N, H, W)."""

    rgb: Rgb
    depth_m: Depth


class Agreement(NamedTuple):
    """How two backends differ.

    Attributes:
        mean_level: mean absolute difference of colours, of 255.
        top_level: greatest difference away from edges.
        close_share: share of pixels seen by both with depths within 1 mm.
        top_m: greatest difference of depth away from edges, metres.
        one_share: share of pixels where only one sees anything.
        edge_share: share of pixels that are on or beside an edge.
    """

    mean_level: float
    top_level: int
    close_share: float
    top_m: float
    one_share: float
    edge_share: float


def away_from_edges(depth_m):
    """Pixels (N, H, W) among whose 3 x 3 neighbours depth does not jump; the border is out."""
    least, most = depth_m.copy(), depth_m.copy()
    for axis in (1, 2):
        for shift in (-1, 1):
            least = np.minimum(least, np.roll(least, shift, axis))
            most = np.maximum(most, np.roll(most, shift, axis))
    smooth = np.isfinite(most) & (most <= (1.0 + JUMP) * least)
    smooth[:, [0, -1]] = smooth[:, :, [0, -1]] = False
    return np.asarray(smooth, np.bool_)


def agreement(first, second):
    """Compare the same frames of two backends."""
    level = np.abs(first.rgb.astype(np.int16) - second.rgb)
    sees = np.isfinite(first.depth_m), np.isfinite(second.depth_m)
    both = sees[0] & sees[1]
    apart_m = np.abs(first.depth_m[both] - second.depth_m[both])
    smooth = away_from_edges(first.depth_m) & away_from_edges(second.depth_m)
    return Agreement(
        float(level.mean()),
        int(level[smooth].max()),
        float(np.mean(apart_m <= CLOSE_M)),
        float(apart_m[smooth[both]].max()),
        float(np.mean(sees[0] != sees[1])),
        float(1.0 - smooth.mean()),
    )


def render_all(mesh, camera, poses, names):
    """Frames of every backend named, rendered in turns."""
    opened = {name: BACKENDS[name](mesh, camera, RenderConfig()) for name in names}
    images = {name: [] for name in names}
    for pose in poses:
        for name, renderer in opened.items():
            images[name].append(renderer.render_rgbd(pose))
    for renderer in opened.values():
        renderer.close()
    stacked = {name: [np.stack(kind) for kind in zip(*images[name], strict=True)] for name in names}
    return {name: Frames(*kinds) for name, kinds in stacked.items()}
