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

from synfeal.config.dataset import CameraConfig
from synfeal.export.frames import ExportFrame, ExportSet, Place, frame_name, rewrite_depth
from synfeal.files import write_json

# OpenGL cameras are x right, y up, z backward; ours are x right, y down, z forward.
CAM_FROM_GL = np.diag([1.0, -1.0, -1.0, 1.0])
UNITS_PER_M = 1000  # Nerfstudio's depth_unit_scale_factor is 1e-3 by default


def export_nerfstudio(data: ExportSet, out: Path, place: Place) -> None:
    """Write ``transforms.json``, ``images/`` and, if there is depth, ``depth/``."""
    frames = []
    for frame in data.frames:
        world_from_gl = frame.world_from_cam @ CAM_FROM_GL
        entry = {"file_path": _image(frame), "transform_matrix": world_from_gl.tolist()}
        place(frame.color, out / _image(frame))
        if data.has_depth:
            entry["depth_file_path"] = f"depth/{frame.sequence}/{frame.depth.name}"
            rewrite_depth(frame.depth, out / entry["depth_file_path"], UNITS_PER_M)
        frames.append(entry)
    splits = {}
    if data.has_splits:
        train, test = ([_image(frame) for frame in data.of_split(s)] for s in ("train", "test"))
        splits = {"train_filenames": train, "val_filenames": test, "test_filenames": test}
    write_json(out / "transforms.json", {**_camera(data.camera), **splits, "frames": frames})


def _image(frame: ExportFrame) -> str:
    return f"images/{frame_name(frame)}"


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
