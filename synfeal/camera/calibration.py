"""Cameras from calibration files: OpenCV (YAML, JSON), ROS, COLMAP (text) and other programs.

What other programs write is translated by :mod:`synfeal.camera.programs`. The JSON that
``synfeal scan`` writes beside a mesh is one too, and the manifest of a data set.

OpenCV and ROS put the centre of the first pixel at (0, 0); :class:`Calibration` and COLMAP at
(0.5, 0.5).
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from json import JSONDecodeError
from pathlib import Path
from typing import Any, Literal

import yaml

from synfeal.camera.programs import as_opencv
from synfeal.camera.projection import Camera
from synfeal.errors import InputError, why
from synfeal.records.files import (
    MOST_TEXT_BYTES,
    MOST_YAML_BYTES,
    PlainLoader,
    read_text,
    text_of,
)

# Names under which the same thing is found; the first is the one that messages give.
MATRIX = ("camera_matrix", "cameraMatrix", "Camera_Matrix", "K", "mtx")
COEFFICIENTS = (
    "distortion_coefficients",
    "Distortion_Coefficients",
    "distCoeffs",
    "dist_coeffs",
    "dist_coeff",
    "D",
    "dist",
)
SIZE = ("image_size", "imageSize")
# What the models of ROS are called whose first five coefficients are OpenCV's.
MODELS = ("plumb_bob", "rational_polynomial")
# The same for OpenCV's fisheye model; Kalibr and ROS say equidistant.
FISHEYE_MODELS = ("fisheye", "equidistant", "kannala_brandt")

# COLMAP's camera models: the names of their parameters in order.
COLMAP_MODELS = {
    "SIMPLE_PINHOLE": ("f", "cx", "cy"),
    "PINHOLE": ("fx", "fy", "cx", "cy"),
    "SIMPLE_RADIAL": ("f", "cx", "cy", "k1"),
    "RADIAL": ("f", "cx", "cy", "k1", "k2"),
    "OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"),
    "FULL_OPENCV": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
}
COLMAP_FISHEYE = {
    "SIMPLE_FISHEYE": ("f", "cx", "cy"),
    "FISHEYE": ("fx", "fy", "cx", "cy"),
    "SIMPLE_RADIAL_FISHEYE": ("f", "cx", "cy", "k1"),
    "RADIAL_FISHEYE": ("f", "cx", "cy", "k1", "k2"),
    "OPENCV_FISHEYE": ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"),
}
# The fisheye model of transforms.json, whose other models are COLMAP's perspective ones.
TRANSFORMS_FISHEYE = "OPENCV_FISHEYE"

YAML_SUFFIXES = (".yaml", ".yml")
UNKNOWN = (
    "is no calibration file: those of OpenCV, ROS, Kalibr, RealSense, ORB-SLAM and Open3D end in"
    " .yaml, .yml or .json, COLMAP's is cameras.txt"
)
BINARY = (
    "COLMAP's binary format is not read; convert the folder it is in: colmap model_converter"
    " --input_path IN --output_path OUT --output_type TXT, and take OUT/cameras.txt"
)
COLMAP_ROW = "must hold one line with CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]"
PANORAMA = (
    "MODEL: EQUIRECTANGULAR has no calibration; leave the file out and give the projection"
    " equirectangular"
)
Distortion = tuple[float, float, float, float, float]
PINHOLE: Distortion = (0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Calibration:
    """Intrinsics in pixels of an image of ``width`` x ``height``.

    Raises:
        ValueError: a value that no camera has; the message begins with the attribute.
    """

    width: int
    height: int
    fx: float  # focal length along x, pixels
    fy: float  # focal length along y, pixels
    cx: float  # principal point from the left edge, pixels: the first pixel's centre is at 0.5
    cy: float  # principal point from the top edge, pixels
    distortion: Distortion  # k1, k2, p1, p2, k3
    projection: Literal["fisheye"] | None = None  # None: perspective
    fisheye_k: tuple[float, float, float, float] | None = None  # k1, k2, k3, k4

    def __post_init__(self) -> None:
        for name in ("fx", "fy"):
            value = getattr(self, name)
            if value <= 0:
                raise ValueError(f"{name}: a focal length is a positive number, found {value:g}")
        for name, side in (("cx", self.width), ("cy", self.height)):
            value = getattr(self, name)
            if not 0 <= value <= side:
                raise ValueError(
                    f"{name}: the principal point {value:g} lies outside the image of"
                    f" {self.width}x{self.height}; are both of the same calibration?"
                )

    @classmethod
    def of_camera(cls, camera: Camera) -> Calibration:
        """Return the calibration of a perspective camera."""
        return cls(camera.width, camera.height, *camera.intrinsics, camera.distortion)

    def scaled(self, width: int | None, height: int | None) -> Calibration:
        """Return the same lens for images that are resized to another size in pixels.

        A side that is None follows from the other.

        Raises:
            ValueError: the two sides would not keep the aspect ratio to the pixel.
        """
        if width is None and height is None:
            return self
        width = width or round((height or 0) * self.width / self.height)
        kept = round(width * self.height / self.width)
        height = height or kept
        if abs(width * self.height / self.width - height) >= 1.0:
            raise ValueError(
                f"is of {self.width}x{self.height}, which does not scale to"
                f" {width}x{height}; {width}x{kept} keeps the aspect ratio"
            )
        x, y = width / self.width, height / self.height
        return replace(
            self,
            width=width,
            height=height,
            fx=x * self.fx,
            fy=y * self.fy,
            cx=x * self.cx,
            cy=y * self.cy,
        )


class _Loader(PlainLoader):
    """The same, and OpenCV's matrices as mappings."""


_MATRIX_TAG = "tag:yaml.org,2002:opencv-matrix"
_Loader.add_constructor(_MATRIX_TAG, _Loader.construct_yaml_map)  # type: ignore[type-var]


def read_calibration(path: Path, with_fisheye: bool = False) -> Calibration:
    """Read the camera in a file; the format goes by the ending: .yaml, .yml, .json or .txt.

    Args:
        path: The file.
        with_fisheye: Take a fisheye camera, too; others refuse it.

    Raises:
        InputError: the file is missing, is of another format, or holds no camera that can be used;
            the message names file and field.
    """
    return _without_fisheye(_read(path), path, with_fisheye)


def decode_calibration(content: bytes, name: str, with_fisheye: bool = False) -> Calibration:
    """Read the camera in the bytes of a file, as :func:`read_calibration` does.

    Args:
        content: The bytes.
        name: Name of the file, whose ending tells the format; also in messages.
        with_fisheye: Take a fisheye camera, too; others refuse it.

    Raises:
        InputError: It is of another format, or holds no camera that can be used.
    """
    decoded = _decoded(Path(name), lambda: text_of(content))
    return _without_fisheye(decoded, name, with_fisheye)


def _without_fisheye(calibration: Calibration, path: object, with_fisheye: bool) -> Calibration:
    if calibration.projection is not None and not with_fisheye:
        raise InputError(
            path,
            "is a fisheye camera, and a perspective one is needed",
            "undistort the images first",
        )
    return calibration


def _read(path: Path) -> Calibration:
    is_yaml = path.suffix.lower() in YAML_SUFFIXES
    most_bytes = MOST_YAML_BYTES if is_yaml else MOST_TEXT_BYTES
    return _decoded(path, lambda: read_text(path, most_bytes=most_bytes))


def _decoded(path: Path, text_in: Callable[[], str]) -> Calibration:
    suffix = path.suffix.lower()
    try:
        if suffix not in (*YAML_SUFFIXES, ".json", ".txt"):
            raise ValueError(BINARY if suffix == ".bin" else UNKNOWN)
        text = text_in()
        if suffix == ".txt":
            return _from_colmap(text)
        if suffix == ".json":
            values = json.loads(text)
            return _from_record(values) or _from_transforms(values) or _from_mapping(values)
        if text.startswith("%YAML:"):  # OpenCV's header, which YAML has no name for
            text = text.partition("\n")[2]
        return _from_mapping(_first_document(text))
    except (OSError, UnicodeDecodeError, yaml.YAMLError, RecursionError, JSONDecodeError) as error:
        raise InputError(path, f"cannot be read as a calibration ({why(error)})") from error
    except ValueError as error:
        raise InputError(path, why(error)) from error


def _first_document(text: str) -> Any:
    """Read the first of the documents of YAML: ``ros2 topic echo`` writes one for each message."""
    for document in yaml.load_all(text, _Loader):
        if document is not None:
            return document
    return None


def _from_record(values: Any) -> Calibration | None:
    """Read the camera from a record of our own, or return None for any other JSON file.

    It is that of the photographs in the record of a scan, that of the frames in a manifest.
    """
    camera = values.get("camera") if isinstance(values, Mapping) else None
    if not isinstance(camera, Mapping):
        return None
    camera = camera.get("color", camera)
    if not isinstance(camera, Mapping):
        return None
    if camera.get("projection") == "equirectangular":
        raise ValueError(PANORAMA.replace("MODEL: EQUIRECTANGULAR", "camera: a panorama"))
    if "fx" not in camera:
        return None
    is_fisheye = camera.get("projection") == "fisheye"
    fx, fy, cx, cy = (_number(camera, name) for name in ("fx", "fy", "cx", "cy"))
    width, height = _size(camera, ("width", "height"))
    return Calibration(
        width=width,
        height=height,
        fx=fx,
        fy=fy,
        cx=cx,
        cy=cy,
        distortion=_five("distortion", _numbers(camera, ("distortion",), (5,))),
        projection="fisheye" if is_fisheye else None,
        fisheye_k=_four(camera, ("fisheye_k",)) if camera.get("fisheye_k") else None,
    )


def _from_transforms(values: Any) -> Calibration | None:
    """Read the one camera of a ``transforms.json``, or return None for any other JSON file."""
    if not isinstance(values, Mapping):
        return None
    frames = values.get("frames")
    entries = frames if isinstance(frames, list) else []
    entries = [entry for entry in entries if isinstance(entry, Mapping)]
    has_poses = any("transform_matrix" in entry for entry in entries)
    if not (has_poses or "fl_x" in values or "camera_angle_x" in values):
        return None
    # A frame may have a camera of its own.
    cameras = {transforms_camera({**values, **entry}) for entry in entries or [{}]}
    if len(cameras) > 1:
        raise ValueError(
            f"frames: have {len(cameras)} cameras; write the one you want into a file of its own,"
            " with fl_x, fl_y, cx, cy, w and h"
        )
    return cameras.pop()


def transforms_camera(
    values: Mapping[str, Any], image_px: tuple[int, int] | None = None
) -> Calibration:
    """Read the camera of a ``transforms.json`` of nerfstudio or instant-ngp.

    Like COLMAP, it has the centre of the first pixel at (0.5, 0.5). Source: nerfstudio's
    documentation, Data conventions; instant-ngp's ``colmap2nerf.py``.

    Args:
        values: Entries of the file, and those of a frame in place of the file's.
        image_px: Width and height of the image, where the file may leave them out.

    Raises:
        ValueError: It is no camera, or one whose lens is not read; the message begins with the
            field.
    """
    says_fisheye = values.get("is_fisheye") is True
    model = values.get("camera_model", TRANSFORMS_FISHEYE if says_fisheye else "OPENCV")
    if model not in (*COLMAP_MODELS, TRANSFORMS_FISHEYE):
        raise ValueError(
            f"camera_model: {_shortened(model)} is not read, only"
            f" {', '.join((*COLMAP_MODELS, TRANSFORMS_FISHEYE))}; undistort the images to PINHOLE"
            " first"
        )
    if says_fisheye and model != TRANSFORMS_FISHEYE:
        raise ValueError(f"is_fisheye: is true, but camera_model is {model}; keep what is right")
    if image_px is not None and "w" not in values and "h" not in values:
        width, height = image_px
    else:
        width, height = _size(values, ("w", "h"))
    fx, fy, cx, cy = _transforms_pinhole(values, width, height)
    is_fisheye = model == TRANSFORMS_FISHEYE
    names = ("k1", "k2", "k3", "k4") if is_fisheye else COLMAP_MODELS["FULL_OPENCV"][4:]
    lens = [_number({name: values.get(name, 0.0)}, name) for name in names]
    if is_fisheye:
        k1, k2, k3, k4 = lens
        return Calibration(width, height, fx, fy, cx, cy, PINHOLE, "fisheye", (k1, k2, k3, k4))
    return Calibration(width, height, fx, fy, cx, cy, _five("k4", lens))


def _transforms_pinhole(
    values: Mapping[str, Any], width: int, height: int
) -> tuple[float, float, float, float]:
    """Read focal lengths and principal point, fx, fy, cx and cy, in pixels."""
    if "fl_x" in values or "camera_angle_x" not in values:
        fx = _number(values, "fl_x")
        fy = _number(values, "fl_y") if "fl_y" in values else fx
        return fx, fy, _number(values, "cx"), _number(values, "cy")
    # As instant-ngp and Blender's synthetic scenes have it: the whole angle of the view.
    fx = _focal_of_angle(values, "camera_angle_x", width)
    fy = _focal_of_angle(values, "camera_angle_y", height) if "camera_angle_y" in values else fx
    middle = {"cx": width / 2, "cy": height / 2, **values}
    return fx, fy, _number(middle, "cx"), _number(middle, "cy")


def _focal_of_angle(values: Mapping[str, Any], name: str, side_px: int) -> float:
    angle_rad = _number(values, name)
    if not 0.0 < angle_rad < math.pi:
        raise ValueError(f"{name}: must be an angle between 0 and pi radians, found {angle_rad:g}")
    return 0.5 * side_px / math.tan(0.5 * angle_rad)


def _from_mapping(values: Any) -> Calibration:
    """Read what OpenCV and ROS write from plain values."""
    if not isinstance(values, Mapping):
        raise ValueError(f"must hold a mapping of keys, found {_shortened(values)}")
    values = as_opencv(values)
    model = values.get("distortion_model", MODELS[0])
    if model not in (*MODELS, *FISHEYE_MODELS):
        raise ValueError(
            f"distortion_model: {_shortened(model)} is not supported, only"
            f" {', '.join((*MODELS, *FISHEYE_MODELS))}"
        )
    fx, skew, cx, zero, fy, cy, *last = matrix = _numbers(values, MATRIX, (9,))
    if (skew, zero, *last) != (0.0, 0.0, 0.0, 0.0, 1.0):
        raise ValueError(
            f"{MATRIX[0]}: must be fx 0 cx, 0 fy cy, 0 0 1 without skew, found {matrix}"
        )
    width, height = _size(values)
    cx, cy = cx + 0.5, cy + 0.5
    if model in FISHEYE_MODELS:
        fisheye_k = _four(values, COEFFICIENTS)
        return Calibration(width, height, fx, fy, cx, cy, PINHOLE, "fisheye", fisheye_k)
    distortion = _five(COEFFICIENTS[0], _numbers(values, COEFFICIENTS, (4, 5, 8, 12, 14)))
    return Calibration(width, height, fx, fy, cx, cy, distortion)


def _four(values: Mapping[str, Any], names: Sequence[str]) -> tuple[float, float, float, float]:
    """Read the coefficients k1, k2, k3 and k4 of a fisheye lens."""
    k1, k2, k3, k4 = _numbers(values, names, (4,))
    return k1, k2, k3, k4


def _size(
    values: Mapping[str, Any], names: Sequence[str] = ("image_width", "image_height")
) -> tuple[int, int]:
    """Read the width and height in pixels from two names, or from one name that holds both."""
    if any(name in values for name in SIZE):
        names, held = (SIZE[0], SIZE[0]), _numbers(values, SIZE, (2,))
    else:
        held = [_number(values, name) for name in names]
    for name, value in zip(names, held, strict=True):
        if not (value >= 1 and value == int(value)):
            raise ValueError(f"{name}: must be a whole number of pixels, found {value:g}")
    return int(held[0]), int(held[1])


def _number(values: Mapping[str, Any], name: str) -> float:
    """Read the one number under a name."""
    return _numbers(values, (name,), (1,))[0]


def _numbers(values: Mapping[str, Any], names: Sequence[str], counts: Sequence[int]) -> list[float]:
    """Read the numbers under the first of ``names`` that is there, as many as one of ``counts``."""
    name = next((name for name in names if name in values), None)
    if name is None:
        raise ValueError(f"{names[0]}: missing")
    held = values[name]
    if isinstance(held, Mapping):  # OpenCV and ROS: rows, cols, data
        held = held.get("data")
    try:
        numbers = list(_flattened(held))
    except (TypeError, ValueError, OverflowError) as error:
        raise ValueError(f"{name}: must hold numbers, found {_shortened(held)}") from error
    if len(numbers) not in counts:
        allowed = " or ".join(map(str, counts))
        raise ValueError(f"{name}: must hold {allowed} numbers, found {len(numbers)}")
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"{name}: must hold finite numbers, found {_shortened(numbers)}")
    return numbers


def _flattened(held: Any) -> Iterator[float]:
    """Yield the numbers of nested lists in order; YAML reads some numbers, such as 1e5, as text."""
    if isinstance(held, list):
        for item in held:
            yield from _flattened(item)
    elif isinstance(held, bool):
        raise TypeError(held)
    else:
        yield float(held)


def _five(name: str, found: Sequence[float]) -> Distortion:
    """Return the first five coefficients, k1, k2, p1, p2 and k3; refuse others that are not 0."""
    if any(found[5:]):
        raise ValueError(
            f"{name}: only k1, k2, p1, p2 and k3 are supported, and {list(found[5:])} are not 0;"
            " calibrate without the rational, thin prism and tilted models"
        )
    k1, k2, p1, p2, k3 = [*found, 0.0][:5]
    return k1, k2, p1, p2, k3


def _from_colmap(text: str) -> Calibration:
    """Read a COLMAP table of one camera: CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]."""
    rows = [line.split() for line in text.splitlines() if not line.lstrip().startswith("#")]
    rows = [row for row in rows if row]
    if (matrix := _matrix_in(rows)) is not None:
        raise ValueError(matrix)
    if len({tuple(row[1:]) for row in rows}) == 1:  # one camera for each image, all the same
        rows = rows[:1]
    if len(rows) > 1:
        raise ValueError(
            f"holds {len(rows)} cameras; keep the line of the one you want in a file of its own"
        )
    if not rows:
        raise ValueError(COLMAP_ROW)
    return colmap_camera(rows[0])


def colmap_camera(cells: Sequence[str]) -> Calibration:
    """Read one line of ``cameras.txt``.

    Args:
        cells: CAMERA_ID MODEL WIDTH HEIGHT PARAMS[].

    Raises:
        ValueError: It is no camera, or one whose lens is not read; the message begins with the
            field.
    """
    if len(cells) < 4:
        raise ValueError(COLMAP_ROW)
    _, model, width, height, *parameters = cells
    if model == "EQUIRECTANGULAR":
        raise ValueError(PANORAMA)
    known = COLMAP_MODELS | COLMAP_FISHEYE
    if model not in known:
        raise ValueError(f"MODEL: {_shortened(model)} is not supported, only {', '.join(known)}")
    names = known[model]
    values = {"WIDTH": width, "HEIGHT": height, "PARAMS": parameters}
    width_px, height_px = _size(values, ("WIDTH", "HEIGHT"))
    held = dict(zip(names, _numbers(values, ("PARAMS",), (len(names),)), strict=True))
    fx, fy = (held[name if name in held else "f"] for name in ("fx", "fy"))
    cx, cy = held["cx"], held["cy"]
    if model in COLMAP_FISHEYE:
        k1, k2, k3, k4 = (held.get(name, 0.0) for name in ("k1", "k2", "k3", "k4"))
        fisheye_k = (k1, k2, k3, k4)
        return Calibration(width_px, height_px, fx, fy, cx, cy, PINHOLE, "fisheye", fisheye_k)
    coefficients = COLMAP_MODELS["FULL_OPENCV"][4:]
    distortion = _five("PARAMS", [held.get(name, 0.0) for name in coefficients])
    return Calibration(width_px, height_px, fx, fy, cx, cy, distortion)


def _matrix_in(rows: Sequence[Sequence[str]]) -> str | None:
    """Say what to do with the matrix of a camera, which lacks its size; None for anything else."""
    shape = (len(rows), *{len(row) for row in rows})
    if shape not in ((3, 3), (3, 4), (4, 4)):
        return None
    try:
        values = [[float(cell) for cell in row] for row in rows]
    except ValueError:
        return None
    if values[2][:3] != [0.0, 0.0, 1.0]:
        return f"holds a matrix of {shape[0]} x {shape[1]} that is no camera's; is it a pose?"
    fx, fy, cx, cy = values[0][0], values[1][1], values[0][2], values[1][2]
    return (
        f"holds a matrix of {shape[0]} x {shape[1]}, which does not say the size of the image; put"
        f" '1 PINHOLE WIDTH HEIGHT {fx:g} {fy:g} {cx:g} {cy:g}' in its place, with the sides of the"
        " image in pixels (cx and cy from the corner of the first pixel, half a pixel more than"
        " OpenCV's)"
    )


def _shortened(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:60]}..."
