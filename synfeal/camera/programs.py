"""Calibrations of other programs, translated into the keys that OpenCV and ROS write.

All of these put the centre of the first pixel at (0, 0), as OpenCV does. By program, with its
source, the keys that tell its files:

- Kalibr, EuRoC (Kalibr's wiki): ``intrinsics`` and ``resolution``, Kalibr's below ``cam0``
- ROS's ``CameraInfo`` (``sensor_msgs/CameraInfo``): ``k`` or ``K``, ``width``, ``height``
- RealSense (librealsense, Projection): ``ppx``, ``ppy``, ``fx``, ``fy``
- ORB-SLAM (its ``Examples``): ``Camera.fx``, in version 3 ``Camera1.fx``
- stella_vslam (its documentation, Parameters): ``Camera`` with ``fx`` and ``cols``
- Open3D (``PinholeCameraIntrinsic``): ``intrinsic_matrix``, by columns
- VINS, camodocal (camodocal, ``CameraFactory``): ``projection_parameters``
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Values = Mapping[str, Any]

PERSPECTIVE, FISHEYE = "plumb_bob", "equidistant"
# Distortion of other programs that is one of these two; what is 0 is none at all.
KALIBR_LENS = {
    "radtan": PERSPECTIVE,
    "radial-tangential": PERSPECTIVE,
    "plumb_bob": PERSPECTIVE,
    "none": PERSPECTIVE,
    "equidistant": FISHEYE,
    "equi": FISHEYE,
}
REALSENSE_LENS = (  # in the order of ``rs2_distortion``
    "none",
    "modified brown conrady",
    "inverse brown conrady",
    "ftheta",
    "brown conrady",
    "kannala brandt4",
)
ORBSLAM_LENS = {
    "pinhole": PERSPECTIVE,
    "rectified": PERSPECTIVE,
    "perspective": PERSPECTIVE,
    "kannalabrandt8": FISHEYE,
    "fisheye": FISHEYE,
}
# Places along each side of an image that a lens is fitted at, and how far the fit may be off.
FIT_ACROSS, MOST_OFF_PX = 41, 0.1
UNDISTORT = "undistort the images first, and give the calibration of those"


def as_opencv(values: Values) -> Values:
    """Translate a calibration of another program.

    Args:
        values: What its file holds.

    Returns:
        ``image_width``, ``image_height``, ``camera_matrix``, ``distortion_model`` and
        ``distortion_coefficients``; other values as they are.

    Raises:
        ValueError: It holds several cameras, or one that OpenCV has no model of; the message begins
            with the key.
    """
    if "projection_parameters" in values:
        return _of_camodocal(values)
    chain = [key for key in values if re.fullmatch(r"cam\d+", str(key))]
    if chain:
        return _of_kalibr(_only(chain, values), f"{chain[0]}.")
    if "intrinsics" in values and "resolution" in values:
        return _of_kalibr(values, "")
    if "ppx" in values and "ppy" in values:
        return _of_realsense(values)
    if isinstance(values.get("Camera"), Mapping):
        values = {f"Camera.{key}": value for key, value in values["Camera"].items()}
    for prefix in ("Camera1.", "Camera."):
        if f"{prefix}fx" in values:
            return _of_orbslam(values, prefix)
    if any(key in values for key in ("intrinsic_matrix", "intrinsic", "parameters")):
        return _of_open3d(values)
    if any(key in values for key in ("k", "K")) and "width" in values:
        return _of_camera_info(values)
    return values


def _only(names: Sequence[str], values: Values) -> Values:
    """Return the one camera among several that are named."""
    if len(names) > 1:
        raise ValueError(
            f"holds {len(names)} cameras ({', '.join(names)}); keep the one you want in a file of"
            " its own"
        )
    return _mapping(values, names[0])


def _mapping(values: Values, key: str) -> Values:
    held = values[key]
    if not isinstance(held, Mapping):
        raise ValueError(f"{key}: must hold a mapping of keys, found {str(held)[:60]!r}")
    return held


def _of_kalibr(values: Values, place: str) -> Values:
    model = str(values.get("camera_model", "pinhole"))
    if model != "pinhole":
        raise ValueError(
            f"{place}camera_model: '{model[:40]}' is not read, only pinhole; {UNDISTORT}"
        )
    name = str(values.get("distortion_model", "none"))
    if name not in KALIBR_LENS:
        raise ValueError(
            f"{place}distortion_model: '{name[:40]}' is not read, only {', '.join(KALIBR_LENS)};"
            f" {UNDISTORT}"
        )
    key = "distortion_coeffs" if "distortion_coeffs" in values else "distortion_coefficients"
    coefficients = values.get(key) or [0.0] * 4
    fx, fy, cx, cy = _listed(values, "intrinsics", 4, place)
    width, height = _listed(values, "resolution", 2, place)
    return _opencv(width, height, (fx, fy, cx, cy), KALIBR_LENS[name], coefficients)


def _of_camera_info(values: Values) -> Values:
    region = values.get("roi")
    sides = ("x_offset", "y_offset", "width", "height")
    if isinstance(region, Mapping) and any(region.get(side) for side in sides):
        raise ValueError("roi: the images are a part of what was calibrated; take whole images")
    for side in ("binning_x", "binning_y"):
        if values.get(side, 0) not in (0, 1):
            raise ValueError(f"{side}: images of merged pixels are not read; take whole ones")
    coefficients = values.get("d", values.get("D"))
    return {
        "image_width": values["width"],
        "image_height": values.get("height"),
        "camera_matrix": values.get("k", values.get("K")),
        "distortion_model": values.get("distortion_model") or PERSPECTIVE,
        "distortion_coefficients": coefficients or [0.0] * 4,
    }


def _of_realsense(values: Values) -> Values:
    said = values.get("model", values.get("distortion", "none"))
    if isinstance(said, int) and 0 <= said < len(REALSENSE_LENS):
        said = REALSENSE_LENS[said]
    name = re.sub(r"^.*?distortion[._ ]", "", str(said).lower()).replace("_", " ")
    coefficients = _floats(values.get("coeffs") or [0.0] * 5, "coeffs")
    pinhole = [values.get(key) for key in ("fx", "fy", "ppx", "ppy")]
    width, height = values.get("width"), values.get("height")
    if name == "kannala brandt4":
        lens, coefficients = FISHEYE, coefficients[:4]
    elif name == "brown conrady" or not any(coefficients):
        lens = PERSPECTIVE
    elif name in ("inverse brown conrady", "modified brown conrady"):
        lens = PERSPECTIVE
        coefficients = _fitted(name, coefficients, (width, height), pinhole)
    else:
        raise ValueError(
            f"model: '{name[:40]}' with coefficients that are not 0 is not OpenCV's; {UNDISTORT}"
        )
    return _opencv(width, height, pinhole, lens, coefficients)


def _fitted(
    name: str, coefficients: Sequence[float], size: Sequence[Any], pinhole: Sequence[Any]
) -> list[float]:
    """Fit OpenCV's five coefficients to another form of Brown and Conrady's model.

    The inverse form has Brown and Conrady's polynomial from the distorted to the undistorted place;
    the modified form takes the tangential terms of places that are radially distorted already.
    OpenCV's is linear in its coefficients.
    """
    if len(coefficients) != 5:
        raise ValueError(f"coeffs: must hold 5 numbers, found {len(coefficients)}")
    width, height = _floats(size, "width, height")
    fx, fy, cx, cy = _floats(pinhole, "fx, fy, ppx, ppy")
    column, row = np.meshgrid(
        np.linspace(0, width - 1, FIT_ACROSS), np.linspace(0, height - 1, FIT_ACROSS)
    )
    given = np.stack([(column.ravel() - cx) / fx, (row.ravel() - cy) / fy])
    k1, k2, p1, p2, k3 = coefficients
    square = (given**2).sum(axis=0)
    radial = given * (1 + square * (k1 + square * (k2 + square * k3)))
    if name.startswith("inverse"):
        distorted, straight = given, radial + _tangential(given) @ [p1, p2]
    else:
        distorted, straight = radial + _tangential(radial) @ [p1, p2], given
    square = (straight**2).sum(axis=0)
    design = np.stack(
        [
            straight * square,
            straight * square**2,
            *np.moveaxis(_tangential(straight), -1, 0),
            straight * square**3,
        ],
        axis=-1,
    ).reshape(-1, 5)
    wanted = (distorted - straight).ravel()
    found, *_ = np.linalg.lstsq(design, wanted)
    off_px = np.abs((design @ found - wanted).reshape(2, -1) * [[fx], [fy]]).max()
    if not off_px <= MOST_OFF_PX:
        raise ValueError(
            f"model: '{name}' with these coefficients is {off_px:.2g} pixels from any lens of"
            f" OpenCV's; {UNDISTORT}"
        )
    return [float(number) for number in found]


def _tangential(place: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what p1 and p2 add (2, N, 2) to places (2, N)."""
    x, y = place
    square = x**2 + y**2
    return np.stack([[2 * x * y, square + 2 * x**2], [square + 2 * y**2, 2 * x * y]]).transpose(
        0, 2, 1
    )


def _of_orbslam(values: Values, prefix: str) -> Values:
    kind = str(values.get("Camera.type", values.get("Camera.model", "PinHole")))
    if kind.lower() not in ORBSLAM_LENS:
        raise ValueError(f"Camera.type: '{kind[:40]}' is not read; {UNDISTORT}")
    lens = ORBSLAM_LENS[kind.lower()]
    names = ("k1", "k2", "k3", "k4") if lens == FISHEYE else ("k1", "k2", "p1", "p2", "k3")
    width = values.get("Camera.width", values.get("Camera.cols"))
    height = values.get("Camera.height", values.get("Camera.rows"))
    if width is None or height is None:
        raise ValueError(
            "Camera.width: missing, as in the files of ORB-SLAM 2; add Camera.width and"
            " Camera.height, the size of the images in pixels"
        )
    pinhole = [values.get(f"{prefix}{name}") for name in ("fx", "fy", "cx", "cy")]
    coefficients = [values.get(f"{prefix}{name}", 0.0) for name in names]
    return _opencv(width, height, pinhole, lens, coefficients)


def _of_open3d(values: Values) -> Values:
    if "parameters" in values:
        return _of_trajectory(values)
    if "intrinsic" in values:
        values = _mapping(values, "intrinsic")
    fx, zero, last, skew, fy, last_y, cx, cy, one = _listed(values, "intrinsic_matrix", 9)
    return {
        "image_width": values.get("width"),
        "image_height": values.get("height"),
        "camera_matrix": [fx, skew, cx, zero, fy, cy, last, last_y, one],
        "distortion_coefficients": [0.0] * 4,
    }


def _of_trajectory(values: Values) -> Values:
    """Take the camera of a trajectory of Open3D, which has it once for each pose."""
    held = values["parameters"]
    poses = held if isinstance(held, list) else []
    cameras = [
        pose["intrinsic"] for pose in poses if isinstance(pose, Mapping) and "intrinsic" in pose
    ]
    if not cameras:
        raise ValueError("parameters: hold no camera (intrinsic)")
    if any(camera != cameras[0] for camera in cameras):
        raise ValueError("parameters: hold different cameras; keep the one you want")
    return _of_open3d({"intrinsic": cameras[0]})


def _of_camodocal(values: Values) -> Values:
    model = str(values.get("model_type", "PINHOLE"))
    if model != "PINHOLE":
        raise ValueError(f"model_type: '{model[:40]}' is not read, only PINHOLE; {UNDISTORT}")
    pinhole = _mapping(values, "projection_parameters")
    lens = _mapping(values, "distortion_parameters") if "distortion_parameters" in values else {}
    return _opencv(
        values.get("image_width"),
        values.get("image_height"),
        [pinhole.get(name) for name in ("fx", "fy", "cx", "cy")],
        PERSPECTIVE,
        [lens.get(name, 0.0) for name in ("k1", "k2", "p1", "p2")],
    )


def _opencv(
    width: Any, height: Any, pinhole: Sequence[Any], lens: str, coefficients: Any
) -> Values:
    """Write a camera as OpenCV and ROS do; what is missing or no number is found by its reader."""
    fx, fy, cx, cy = pinhole
    return {
        "image_width": width,
        "image_height": height,
        "camera_matrix": [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        "distortion_model": lens,
        "distortion_coefficients": coefficients,
    }


def _listed(values: Values, key: str, count: int, place: str = "") -> list[float]:
    held = values.get(key)
    numbers = _floats(held, place + key)
    if len(numbers) != count:
        raise ValueError(f"{place}{key}: must hold {count} numbers, found {len(numbers)}")
    return numbers


def _floats(held: Any, place: str) -> list[float]:
    try:
        return [float(number) for number in held]
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{place}: must hold numbers, found {str(held)[:60]!r}") from error
