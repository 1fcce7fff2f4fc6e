"""Nerfstudio's ``transforms.json``.

Source: Nerfstudio documentation, "Data conventions", and its data parser: cameras are x right, y
up, z backward; the world has z up; the centre of the first pixel is at (0.5, 0.5); depth is in
millimetres along the optical axis, 0 where there is none; the three lists of file names go together
and evaluation during training reads ``val_filenames``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from synfeal.config.camera import CameraConfig
from synfeal.export.frames import ExportFrame, ExportSet, Place, rewrite_depth
from synfeal.files import write_json

# OpenGL cameras are x right, y up, z backward; ours are x right, y down, z forward.
CAM_FROM_GL = np.diag([1.0, -1.0, -1.0, 1.0])
UNITS_PER_M = 1000  # Nerfstudio's depth_unit_scale_factor is 1e-3 by default


def export_nerfstudio(data: ExportSet, out: Path, place: Place) -> None:
    """Write ``transforms.json``, ``images/`` and, if there is depth, ``depth/``."""
    frames = []
    for frame in data.frames:
        frames.append(_frame(frame, data.has_depth))
        place(frame.color, out / _image(frame))
        if data.has_depth:
            rewrite_depth(frame.depth, out / _depth(frame), UNITS_PER_M)
    write_json(out / "transforms.json", {**_camera(data.camera), **_splits(data), "frames": frames})


def _image(frame: ExportFrame) -> str:
    return f"images/{frame.sequence}/{frame.color.name}"


def _depth(frame: ExportFrame) -> str:
    return f"depth/{frame.sequence}/{frame.depth.name}"


def _frame(frame: ExportFrame, has_depth: bool) -> dict[str, Any]:
    world_from_gl = frame.world_from_cam @ CAM_FROM_GL
    entry = {"file_path": _image(frame), "transform_matrix": world_from_gl.tolist()}
    return {**entry, "depth_file_path": _depth(frame)} if has_depth else entry


def _camera(camera: CameraConfig) -> dict[str, Any]:
    intrinsics = camera.intrinsics
    k1, k2, p1, p2, k3 = camera.distortion
    return {
        "camera_model": "OPENCV",
        "w": camera.width,
        "h": camera.height,
        "fl_x": intrinsics.fx,
        "fl_y": intrinsics.fy,
        "cx": intrinsics.cx,
        "cy": intrinsics.cy,
        **{"k1": k1, "k2": k2, "k3": k3, "p1": p1, "p2": p2},
    }


def _splits(data: ExportSet) -> dict[str, list[str]]:
    if not data.has_splits:
        return {}
    train, test = ([_image(frame) for frame in data.of_split(s)] for s in ("train", "test"))
    return {"train_filenames": train, "val_filenames": test, "test_filenames": test}
