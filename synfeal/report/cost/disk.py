"""Bytes on disk of what the stages leave behind."""

from __future__ import annotations

from pathlib import Path

from synfeal.config.models import CameraConfig

# Of the published small run (docs/cost.md): PNG bytes per pixel, bytes per pose of a table, bytes
# per scored frame, and what a procedural scene takes.
COLOUR_PER_PX, DEPTH_PER_PX = 1.6, 0.5
POSE_BYTES = 160
SCORED_BYTES = 360
SCENE_BYTES = 50e6
POSE_FILE_BYTES = 275


def packed_bytes(frames: int, input_px: int) -> float:
    """Packed frames: three bytes per pixel, without the header."""
    return 3.0 * frames * input_px**2


def picture_bytes(camera: CameraConfig, frames: int, with_depth: bool) -> float:
    """Frames as image files and their poses."""
    per_px = COLOUR_PER_PX + DEPTH_PER_PX * with_depth
    return frames * (camera.width * camera.height * per_px + POSE_FILE_BYTES)


def pose_bytes(frames: int) -> float:
    """A table of poses."""
    return float(POSE_BYTES * frames)


def score_bytes(frames: int) -> float:
    """Predictions and errors of a run."""
    return float(SCORED_BYTES * frames)


def scene_bytes(path: Path | None) -> float:
    """A prepared scene: a mesh as large as the user's, or a procedural one."""
    return float(path.stat().st_size) if path is not None and path.is_file() else SCENE_BYTES
