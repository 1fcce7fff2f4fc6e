"""Frames of a mesh as one writes them without this project: trimesh, pyrender, Pillow, a loop.

    python benchmarks/pyrender_loop.py mesh.glb poses.npy out --width 640 --height 480 --samples 2

pyrender multi-samples edges four times by itself. With ``--samples 2`` images are drawn at twice
the size and averaged, so that textures are sampled four times, too. Nothing here is of this
project: :mod:`benchmarks.collecting` measures it beside ``synfeal``.
"""

import argparse
import os
import time
from pathlib import Path
from typing import Any

os.environ["PYOPENGL_PLATFORM"] = "egl"  # before pyrender is imported

import numpy as np
import pyrender
import trimesh
from numpy.typing import NDArray
from PIL import Image

# glTF is y-up, poses are z-up; OpenGL's cameras look along -z with y up, poses along z with y down.
FILE_FROM_WORLD = np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], float)
CAM_FROM_GL = np.diag([1.0, -1.0, -1.0, 1.0])
UNLIT = pyrender.RenderFlags.FLAT | pyrender.RenderFlags.SKIP_CULL_FACES


class Loop:
    """A scene and a camera in pyrender."""

    def __init__(self, options: argparse.Namespace) -> None:
        """Load the mesh and open a renderer."""
        width, height = options.samples * options.width, options.samples * options.height
        self._samples = options.samples
        loaded = trimesh.load(options.mesh, force="scene", process=False)
        for mesh in loaded.geometry.values():
            # trimesh drops the vertex colours of a mesh that has a material. Ours, without light,
            # are another attribute of the same file.
            if "_SRGB" in mesh.vertex_attributes:
                colors = mesh.vertex_attributes["_SRGB"]
                mesh.visual = trimesh.visual.ColorVisuals(mesh, vertex_colors=colors)
        self._scene = pyrender.Scene.from_trimesh_scene(loaded, bg_color=np.zeros(4))
        focal_px = 0.5 * width / np.tan(np.radians(0.5 * options.fov))
        self._camera = self._scene.add(
            pyrender.IntrinsicsCamera(
                fx=focal_px, fy=focal_px, cx=width / 2, cy=height / 2, znear=0.05, zfar=100.0
            )
        )
        self._renderer = pyrender.OffscreenRenderer(width, height)

    def draw(self, world_from_cam: NDArray[np.float64]) -> NDArray[np.uint8]:
        """Draw the colours (H, W, 3) seen from a pose (4, 4)."""
        self._scene.set_pose(self._camera, FILE_FROM_WORLD @ world_from_cam @ CAM_FROM_GL)
        seen = self._renderer.render(self._scene, flags=UNLIT)[0]
        return np.asarray(Image.fromarray(seen).reduce(self._samples))


def write_images(loop: Loop, poses: NDArray[np.float64], out: Path) -> None:
    """Write a PNG image and a text file of the pose for each view.

    Args:
        loop: Scene and camera.
        poses: ``world_from_cam`` (N, 4, 4).
        out: Folder to create.
    """
    out.mkdir(parents=True)
    for index, pose in enumerate(poses):
        Image.fromarray(loop.draw(pose)).save(out / f"frame-{index:06d}.color.png")
        np.savetxt(out / f"frame-{index:06d}.pose.txt", pose)


def write_packed(loop: Loop, poses: NDArray[np.float64], side_px: int, out: Path) -> None:
    """Write all images, made square, as one array.

    Args:
        loop: Scene and camera.
        poses: ``world_from_cam`` (N, 4, 4).
        side_px: Side of the images, pixels.
        out: File to write: uint8 (N, S, S, 3).
    """
    frames = np.empty((len(poses), side_px, side_px, 3), np.uint8)
    for index, pose in enumerate(poses):
        image = Image.fromarray(loop.draw(pose))
        frames[index] = np.asarray(image.resize((side_px, side_px), Image.Resampling.BILINEAR))
    np.save(out, frames)


def drawing_ms(draw: Any, poses: NDArray[np.float64]) -> float:
    """Measure the processor time of drawing a pose, in milliseconds, the first one left out."""
    draw(poses[0])
    began = time.process_time()
    for pose in poses[1:]:
        draw(pose)
    return 1e3 * (time.process_time() - began) / (len(poses) - 1)


def main() -> None:
    """Write the frames, or without ``out`` print what drawing one takes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh", type=Path, help="GLB")
    parser.add_argument("poses", type=Path, help="world_from_cam (N, 4, 4) as .npy, z up")
    parser.add_argument("out", type=Path, nargs="?", help="folder, or .npy with --packed")
    parser.add_argument("--width", type=int, default=640)
    parser.add_argument("--height", type=int, default=480)
    parser.add_argument("--fov", type=float, default=60.0, help="horizontal, degrees (60)")
    parser.add_argument("--samples", type=int, default=1, help="along each axis of a pixel (1)")
    parser.add_argument("--packed", type=int, metavar="PX", help="one array of squares")
    options = parser.parse_args()
    loop, poses = Loop(options), np.load(options.poses)
    if options.out is None:
        print(drawing_ms(loop.draw, poses))
    elif options.packed:
        write_packed(loop, poses, options.packed, options.out)
    else:
        write_images(loop, poses, options.out)


if __name__ == "__main__":
    main()
