"""How far the rendering backends agree, and what a frame costs each of them.

``python -m benchmarks.render_agreement`` renders poses drawn in a scene's sampling box with every
backend that works here, in turns, and prints a table per image size: each pair's differences in
colour and depth, and each backend's milliseconds a frame.
"""

from __future__ import annotations

import argparse
import itertools
import statistics
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from synfeal.config import load_config
from synfeal.config.models import CameraConfig, RenderConfig, SceneConfig
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.planning.plan import sampling_box_of
from synfeal.planning.sampling import pose_bounds, sample_poses, view_directions
from synfeal.render.base import Depth, Rgb
from synfeal.render.choose import BACKENDS, why_not
from synfeal.scenes.prepare import build_or_load

SIZES = ((320, 240), (640, 480))
CLOSE_M = 1e-3
JUMP = 0.02  # neighbours whose depths differ by more than this share lie on either side of an edge


class Frames(NamedTuple):
    """Images of one backend: colours (N, H, W, 3), depth (N, H, W), and milliseconds (N,)."""

    rgb: Rgb
    depth_m: Depth
    ms: NDArray[np.float64]


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


def away_from_edges(depth_m: Depth) -> NDArray[np.bool_]:
    """Pixels (N, H, W) among whose 3 x 3 neighbours depth does not jump; the border is out."""
    least, most = depth_m.copy(), depth_m.copy()
    for axis in (1, 2):
        for shift in (-1, 1):
            least = np.minimum(least, np.roll(least, shift, axis))
            most = np.maximum(most, np.roll(most, shift, axis))
    smooth = np.isfinite(most) & (most <= (1.0 + JUMP) * least)
    smooth[:, [0, -1]] = smooth[:, :, [0, -1]] = False
    return np.asarray(smooth, np.bool_)


def agreement(first: Frames, second: Frames) -> Agreement:
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


def render_all(
    mesh: TexturedMesh, camera: CameraConfig, poses: NDArray[np.float64], names: Sequence[str]
) -> dict[str, Frames]:
    """Frames of every backend named, rendered in turns; the first frame twice, to warm up."""
    opened = {name: BACKENDS[name](mesh, camera, RenderConfig()) for name in names}
    images: dict[str, list[tuple[Rgb, Depth]]] = {name: [] for name in names}
    ms: dict[str, list[float]] = {name: [] for name in names}
    for index, pose in enumerate([poses[0], *poses]):
        for name, renderer in opened.items():
            renderer.render(pose)  # brings back what the others displaced
            start = time.perf_counter()
            rgbd = renderer.render_rgbd(pose)
            if index:
                ms[name].append(1e3 * (time.perf_counter() - start))
                images[name].append(rgbd)
    for renderer in opened.values():
        renderer.close()
    stacked = {name: [np.stack(kind) for kind in zip(*images[name], strict=True)] for name in names}
    return {
        name: Frames(rgb, depth_m, np.array(ms[name])) for name, (rgb, depth_m) in stacked.items()
    }


def free_poses(
    mesh: TexturedMesh, scene: SceneConfig, name: str, count: int, seed: int
) -> NDArray[np.float64]:
    """Poses (N, 4, 4) that see nothing closer than the scene's least view distance."""
    box_m = sampling_box_of(scene, mesh.bounds_m, name)
    vectors = sample_poses(
        pose_bounds(box_m, scene.angles), 50 * count, np.random.default_rng(seed)
    )
    view_m = RayCaster(*mesh.merged()).first_hit_m(vectors[:, :3], view_directions(vectors))
    free = vectors[(view_m > scene.min_view_distance_m) & np.isfinite(view_m)][:count]
    return np.stack([pose_matrix(rotation_from_rpy(v[3:]), v[:3]) for v in free])


def table(frames: dict[str, Frames]) -> str:
    """Markdown: pairs and their differences, then milliseconds a frame."""
    lines = [
        "| pair | colour, mean | away from edges, max | depth within 1 mm | away from edges, max"
        " | seen by one only | near edges |",
        "|---|---|---|---|---|---|---|",
    ]
    for first, second in itertools.combinations(frames, 2):
        a = agreement(frames[first], frames[second])
        lines.append(
            f"| {first}, {second} | {a.mean_level:.2f} | {a.top_level} | {a.close_share:.4%} |"
            f" {1e3 * a.top_m:.3f} mm | {a.one_share:.4%} | {a.edge_share:.1%} |"
        )
    cost = ", ".join(f"{name} {statistics.median(f.ms):.0f}" for name, f in frames.items())
    return "\n".join([*lines, "", f"ms a frame with depth, median: {cost}"])


def main(arguments: Sequence[str] | None = None) -> None:
    """Compare all backends in one scene of the default configuration."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.render_agreement", description=__doc__
    )
    parser.add_argument("--scene", default="large_room", help="a scene of the configuration")
    parser.add_argument("--mesh", type=Path, help="its mesh, where it has been made already")
    parser.add_argument("--poses", type=int, default=20)
    options = parser.parse_args(arguments)
    config = load_config(Path("config/config.yaml"))
    scene = config.scenes[options.scene]
    if options.mesh is None:
        mesh = build_or_load(scene, config.seed, options.scene)
    else:
        mesh = load_mesh(options.mesh)
    poses = free_poses(mesh, scene, options.scene, options.poses, config.seed)
    names = [name for name in BACKENDS if why_not(name) is None]
    for width, height in SIZES:
        frames = render_all(mesh, CameraConfig(width=width, height=height), poses, names)
        print(f"\n{options.scene}, {width}x{height}, {len(poses)} poses\n\n{table(frames)}")


if __name__ == "__main__":
    main()
