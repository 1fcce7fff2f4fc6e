"""The options that describe a camera."""

from __future__ import annotations

import argparse
from pathlib import Path

from pydantic import ValidationError

from synfeal.cli.options import Options
from synfeal.config.load import describe
from synfeal.config.models import CameraConfig
from synfeal.errors import InputError

CAMERA_OPTIONS: Options = (
    (
        "--camera",
        {
            "type": Path,
            "metavar": "FILE",
            "help": "calibration: OpenCV or ROS .yaml or .json, COLMAP cameras.txt",
        },
    ),
    ("--width", {"type": int, "help": "image width, pixels (640, or that of --camera)"}),
    ("--height", {"type": int, "help": "image height, pixels (480, or that of --camera)"}),
    ("--fov", {"type": float, "help": "horizontal field of view, degrees (60)"}),
)


def camera_of(arguments: argparse.Namespace) -> CameraConfig:
    """The camera the options describe.

    Raises:
        InputError: a value is out of range, or the calibration cannot be used.
    """
    given = {
        "calibration": arguments.camera,
        "width": arguments.width,
        "height": arguments.height,
        "horizontal_fov_deg": arguments.fov,
    }
    try:
        return CameraConfig.model_validate({k: v for k, v in given.items() if v is not None})
    except ValidationError as error:
        raise InputError(f"collect: {describe(error)}") from None
