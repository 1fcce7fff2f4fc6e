"""Calibrations of sensors whose data sets come without."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from synfeal.camera.calibration import PINHOLE, Calibration, Distortion


class Sensor(NamedTuple):
    """A colour camera and a depth camera at one place.

    Attributes:
        color: Calibration of the photographs.
        depth: Calibration of the depth images.
        depth_units_per_m: Stored value of one metre.
    """

    color: Calibration
    depth: Calibration
    depth_units_per_m: float


def _square(focal_px: float) -> Calibration:
    """Return 640 x 480 square pixels with the principal point in their middle."""
    return Calibration(640, 480, focal_px, focal_px, 320.0, 240.0, PINHOLE)


def _tum(fx: float, fy: float, cx: float, cy: float, distortion: Distortion = PINHOLE) -> Sensor:
    """Return one camera for both: the benchmark's depth is registered to colour.

    Args:
        fx: Focal length, pixels.
        fy: Focal length, pixels.
        cx: Principal point, pixels, the first one's centre at 0 as its page has it.
        cy: Principal point, pixels.
        distortion: k1, k2, p1, p2, k3.
    """
    camera = Calibration(640, 480, fx, fy, cx + 0.5, cy + 0.5, distortion)
    return Sensor(camera, camera, 5000.0)


# The Kinect of 7-Scenes: its authors give 585 px, which is the depth camera's; 525 px of the colour
# camera is what its driver reports and what the photographs agree with. The Kinects of the TUM
# benchmark: "Intrinsic Camera Calibration of the Kinect" on its page of file formats.
SENSORS: Mapping[str, Sensor] = {
    "7scenes": Sensor(_square(525.0), _square(585.0), 1000.0),
    "tum-fr1": _tum(517.3, 516.5, 318.6, 255.3, (0.2624, -0.9531, -0.0054, 0.0026, 1.1633)),
    "tum-fr2": _tum(520.9, 521.0, 325.1, 249.7, (0.2312, -0.7849, -0.0033, -0.0001, 0.9172)),
    "tum-fr3": _tum(535.4, 539.2, 320.1, 247.6),
    # "For the default calibration of ROS", the same page says of a sensor that nobody calibrated.
    "kinect": _tum(525.0, 525.0, 319.5, 239.5),
}
