"""Frames of a mesh by the functions that jobs of the workflow call; run by benchmarks.collecting.

python -m benchmarks.collecting_worker mesh.glb detail.glb plan.csv out --width 88 --height 66
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset.pose_table import read_pose_table
from synfeal.dataset.render_sequence import render_packed, render_sequence
from synfeal.effects.scene import open_scene


def drawing_ms(options: argparse.Namespace, camera: CameraConfig, render: RenderConfig) -> float:
    """Measure the processor time of drawing a pose alone, in milliseconds, the first one left out.

    Args:
        options: Command line: mesh, level of detail and plan, and whether depth is drawn, too.
        camera: Camera of the frames.
        render: Settings of rendering.
    """
    poses = read_pose_table(options.plan).world_from_cam
    with open_scene(options.mesh, camera, render, options.detail) as renderer:
        draw = renderer.render_rgbd if options.depth else renderer.render
        draw(poses[0])
        began = time.process_time()
        for pose in poses[1:]:
            draw(pose)
        return 1e3 * (time.process_time() - began) / max(1, len(poses) - 1)


def main() -> None:
    """Write the frames, or without ``out`` print what drawing one takes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh", type=Path)
    parser.add_argument("detail", type=Path, help="mesh that colours are drawn of")
    parser.add_argument("plan", type=Path, help="pose table")
    parser.add_argument("out", type=Path, nargs="?", help="folder, or .npy with --packed")
    parser.add_argument("--width", type=int, required=True)
    parser.add_argument("--height", type=int, required=True)
    parser.add_argument("--samples", type=int, required=True)
    parser.add_argument("--packed", type=int)
    parser.add_argument("--depth", action="store_true")
    options = parser.parse_args()
    camera = CameraConfig(width=options.width, height=options.height)
    render = RenderConfig(backend="opengl", supersampling=options.samples)
    files = options.mesh, camera, options.plan
    stop = len(read_pose_table(options.plan))
    if options.out is None:
        print(drawing_ms(options, camera, render))
    elif options.packed:
        render_packed(*files, 0, stop, options.packed, "whole", render, options.out, options.detail)
    else:
        render_sequence(*files, 0, stop, options.depth, render, options.out, options.detail)


if __name__ == "__main__":
    main()
