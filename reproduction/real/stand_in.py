"""Photographs of a stand-in room, for trying the profile ``real`` without anybody's photographs.

``python -m reproduction.real.stand_in OUT`` collects posed frames with depth along paths through a
room drawn from a seed, with changing light, exposure, motion blur, noise and JPEG artefacts and
through a lens with distortion, in a world that leans: one sequence in the layout of 7-Scenes.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from scipy.spatial.transform import Rotation

from reproduction.rooms import build_scene
from synfeal import api
from synfeal.dataset.posed_sequence import read_posed_sequence
from synfeal.dataset.sevenscenes import pose_text
from synfeal.errors import exit_status
from synfeal.geometry.poses import pose_matrix
from synfeal.mesh.save import save_glb
from synfeal.records.files import atomic_directory, write_text

CAMERA = "camera.yaml"
# Width of the view as a Kinect's; half the distortion of a telephone.
FOCAL_SHARE, K1, K2 = 0.82, 0.06, -0.08
SEQUENCE_FROM_ROOM = pose_matrix(
    Rotation.from_euler("ZYX", [130.0, 15.0, 32.0], degrees=True).as_matrix(), [2.0, -7.0, 0.5]
)
EFFECTS = """\
seed: {seed}
light: {{ev: [-0.6, 0.6], temperature_k: [4500, 8500], field_ev: 0.3}}
motion_blur: {{exposure_s: 0.02, subframes: 4}}
exposure: {{time_constant_s: 0.5}}
noise: {{full_well_e: 6000, read_e: 8}}
jpeg_quality: 85
"""


def write_stand_in(
    out: Path, frames: int, width: int = 160, spacing_m: float = 0.08, seed: int = 0
) -> None:
    """Write a flat sequence of stand-in photographs with depth, and the calibration of its camera.

    Args:
        out: Folder to create.
        frames: Number of photographs.
        width: Width of an image, pixels; it is three quarters as high.
        spacing_m: Distance between neighbours, metres.
        seed: Seed of room, paths and effects.
    """
    with tempfile.TemporaryDirectory() as temporary:
        work = Path(temporary)
        save_glb(work / "room.glb", build_scene("random_room", seed))
        write_text(work / CAMERA, calibration_text(width, width * 3 // 4))
        write_text(work / "effects.yaml", EFFECTS.format(seed=seed))
        api.collect(
            work / "room.glb",
            work / "collected",
            frames,
            depth=True,
            seed=seed,
            spacing_m=spacing_m,
            min_view_distance_m=0.6,
            min_path_m=1.0,
            pitch_deg=(-20.0, 45.0),  # the floor tells which way is down
            camera=work / CAMERA,
            effects=work / "effects.yaml",
            sequence_frames=frames,
        )
        with atomic_directory(out) as directory:
            _lean(work / "collected" / "seq-01", directory)
            shutil.copyfile(work / CAMERA, directory / CAMERA)


def _lean(sequence: Path, out: Path) -> None:
    """Copy a sequence into a world that leans and lies elsewhere."""
    frames = read_posed_sequence(sequence)
    for name, color, depth, pose in zip(
        frames.names, frames.color, frames.depth, frames.world_from_cam, strict=True
    ):
        assert depth is not None
        (out / f"{name}.color.png").write_bytes(color.read_bytes())
        (out / f"{name}.depth.png").write_bytes(depth.read_bytes())
        write_text(out / f"{name}.pose.txt", pose_text(SEQUENCE_FROM_ROOM @ pose))


def calibration_text(width: int, height: int) -> str:
    """Format a camera as OpenCV writes one, whose first pixel has its centre at 0."""
    focal = FOCAL_SHARE * width
    matrix = [focal, 0.0, width / 2 - 0.5, 0.0, focal, height / 2 - 0.5, 0.0, 0.0, 1.0]
    return (
        f"image_width: {width}\nimage_height: {height}\n"
        f"camera_matrix: {{rows: 3, cols: 3, data: {matrix}}}\n"
        f"distortion_coefficients: {{rows: 1, cols: 5, data: [{K1}, {K2}, 0.0, 0.0, 0.0]}}\n"
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Write stand-in photographs."""
    parser = argparse.ArgumentParser(prog="reproduction.real.stand_in", description=__doc__)
    parser.add_argument("out", type=Path, help="folder to create")
    parser.add_argument("--frames", type=int, default=1000, help="photographs (1000)")
    parser.add_argument("--width", type=int, default=320, help="of an image, pixels (320)")
    parser.add_argument("--seed", type=int, default=0, help="of room, paths and effects (0)")
    given = parser.parse_args(argv)
    return exit_status(
        lambda: write_stand_in(given.out, given.frames, given.width, seed=given.seed),
        "delete what is there, and start again",
    )


if __name__ == "__main__":
    sys.exit(main())
