"""Options of a collection as configuration, and errors about its keys as errors about options.

One table names both, so that a value has one bound and one default however it is given: as an
option of ``synfeal collect``, as an argument of :func:`synfeal.collect`, or as a key of a profile.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from synfeal.config.collection import SceneConfig
from synfeal.config.dataset import CameraConfig, DatasetConfig, RenderConfig
from synfeal.config.load import check_mesh_file, describe, read_yaml
from synfeal.errors import InputError
from synfeal.records.files import file_sha256

Model = TypeVar("Model", bound=BaseModel)
SCENE, SIZE = "scan", "all"  # as the configuration of a collection calls its scene and its size
KEYS: Mapping[str, str] = {
    "mesh": f"scenes.{SCENE}.path",
    "up_axis": f"scenes.{SCENE}.up_axis",
    "unit_m": f"scenes.{SCENE}.unit_m",
    "box": f"scenes.{SCENE}.sampling_box",
    "roll": f"scenes.{SCENE}.angles.roll_deg",
    "pitch": f"scenes.{SCENE}.angles.pitch_deg",
    "yaw": f"scenes.{SCENE}.angles.yaw_deg",
    "min_view_distance": f"scenes.{SCENE}.min_view_distance_m",
    "min_seen": f"scenes.{SCENE}.min_seen",
    "min_clearance": f"scenes.{SCENE}.min_clearance_m",
    "clutter": f"scenes.{SCENE}.clutter",
    "frames": f"scenes.{SCENE}.sizes.{SIZE}.train",
    "test_frames": f"scenes.{SCENE}.sizes.{SIZE}.test",
    "mode": "collection.mode",
    "poses": "collection.repeat",
    "spacing": "collection.frame_spacing_m",
    "min_path": "collection.min_path_m",
    "test_paths": "collection.test_paths",
    "camera": "network_camera.calibration",
    "width": "network_camera.width",
    "height": "network_camera.height",
    "fov": "network_camera.horizontal_fov_deg",
    "projection": "network_camera.projection",
    "fisheye_k": "network_camera.fisheye_k",
    "stereo": "network_camera.stereo_baseline_m",
    "depth": "network_depth",
    "normals": "network_normals",
    "masks": "network_masks",
    "backend": "render.backend",
    "supersampling": "render.supersampling",
    "detail": "render.detail",
    "shade": "render.shade",
    "background": "render.background_rgb",
    "effects": "render.effects",
    "sequence_frames": "shard_frames",
    "archive": "archive_sequences",
    "seed": "seed",
}
TEST_PATHS = 8  # that the test frames of a collection are of, unless the options say otherwise
FURTHER_BOXES = f"scenes.{SCENE}.further_boxes"


def dataset_config(options: Mapping[str, Any], out: Path | None = None) -> DatasetConfig:
    """Build the settings of a collection from options by the names of ``KEYS``.

    None stands for the default.

    ``box`` is a list of boxes, each x0, x1, y0, y1, z0, z1, metres; ``out`` is the data set, which
    gives the profile its name.
    """
    check_mesh_file(Path(options["mesh"]), "--mesh")
    values = _nested(options)
    scene = values["scenes"][SCENE]
    scene |= {"source": "mesh", "path": str(Path(scene["path"]).absolute())}
    scene["sha256"] = file_sha256(Path(scene["path"]))
    if values.get("collection", {}).get("repeat") is not None:
        values["collection"]["repeat"] = Path(values["collection"]["repeat"]).absolute()
    values.setdefault("collection", {})["collision_agreement"] = None
    values["collection"].setdefault("test_paths", TEST_PATHS)
    baseline_m = options.get("stereo")
    is_length = isinstance(baseline_m, int | float) and 0 < baseline_m < math.inf
    if is_length and options.get("min_clearance") is None:
        scene["min_clearance_m"] = baseline_m  # so that no wall is between the two cameras
    profile = re.sub(r"[^a-z0-9]+", "_", out.absolute().name.lower()) if out else ""
    values |= {"profile": profile.strip("_")[:64] or "mine", "scale": 1.0}
    with options_named():
        config = DatasetConfig.model_validate(values)
        n_test, n_paths = config.scenes[SCENE].sizes[SIZE].test, options.get("test_paths")
        if n_paths is not None and n_paths > n_test:
            raise InputError(
                f"collection.test_paths: {n_test} test frames cannot be of {n_paths} paths; give"
                " fewer, or more --test-frames"
            )
    return config


def scene_config(options: Mapping[str, Any]) -> SceneConfig:
    """Build the settings of a scene alone, for commands that collect nothing."""
    check_mesh_file(Path(options["mesh"]), "MESH")
    scene = _nested(options)["scenes"][SCENE]
    with options_named():
        return _checked(SceneConfig, {"source": "mesh", **scene}, f"scenes.{SCENE}")


def render_configs(options: Mapping[str, Any]) -> tuple[CameraConfig, RenderConfig]:
    """Build the settings of camera and renderer from options."""
    if options.get("effects") is not None:
        raise InputError("effects: act on the frames of paths; use collect for them")
    if options.get("stereo") is not None:
        raise InputError("stereo: a renderer is one camera; render from both poses")
    values = _nested(options)
    with options_named():
        camera = _checked(CameraConfig, values.pop("network_camera", {}), "network_camera")
        render = _checked(RenderConfig, values.pop("render", {}), "render")
        if values:
            raise InputError(f"{next(iter(options))}: is not an option of a renderer")
    return camera, render


def _checked(model: type[Model], values: Any, key: str) -> Model:
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise InputError(f"{key}.{describe(error)}") from error


def in_words_of_options(message: str) -> str:
    """Rewrite a message about configuration keys as one about options."""
    lens = r"\bnetwork_camera\.(fx|fy|cx|cy|distortion)\b"  # which come from the calibration
    message = re.sub(lens, r"--camera: \1", message)
    key, _, rest = message.partition(": ")
    below = {**KEYS, "further box": FURTHER_BOXES}
    for option, own in sorted(below.items(), key=lambda item: -len(item[1])):
        if f"{key}.".startswith(f"{own}."):
            inner = [name for name in key.removeprefix(own).split(".") if name.isidentifier()]
            message = ": ".join([_flag(option.removeprefix("further ")), *inner, rest])
            break
    for option, own in sorted(KEYS.items(), key=lambda item: -len(item[1])):
        name = own.rpartition(".")[2]
        words = [own, name] if "_" in name and name != option else [own]
        for word in words:
            # A key at the top is the whole of its name only where the message begins with it, or
            # says in brackets what it was.
            start = r"(?<![\w./-])" if {*"._"} & {*word} else r"(?:^|(?<=\())"
            message = re.sub(rf"{start}{re.escape(word)}(?![\w/])", _flag(option), message)
    message = re.sub(r"(?<![\w./-])(unit_m|up_axis)(?![\w./])", lambda m: _flag(m[0]), message)
    return re.sub(rf"scenes\.{SCENE}(: |\.)", "", message)


def _flag(option: str) -> str:
    return f"--{option.replace('_', '-')}"


@contextmanager
def options_named() -> Iterator[None]:
    """Rewrite errors about configuration keys as errors about options."""
    try:
        yield
    except ValidationError as error:
        raise InputError(in_words_of_options(describe(error))) from error
    except InputError as error:
        raise InputError(in_words_of_options(str(error))) from error


def _nested(options: Mapping[str, Any]) -> dict[str, Any]:
    """Turn options into nested mappings by their dotted keys."""
    unknown = sorted(set(options) - set(KEYS))
    if unknown:
        raise InputError(f"{unknown[0]}: no such option; there are {', '.join(KEYS)}")
    given = {KEYS[name]: value for name, value in options.items() if value is not None}
    for key in (KEYS["effects"], KEYS["clutter"]):
        if isinstance(given.get(key), Path | str):
            given[key] = read_yaml(Path(given[key]))
    boxes = given.pop(KEYS["box"], None)
    if boxes is not None:
        first, *others = ({"x": b[0:2], "y": b[2:4], "z": b[4:6]} for b in boxes)
        given |= {KEYS["box"]: first, FURTHER_BOXES: others}
    values: dict[str, Any] = {}
    for key, value in given.items():
        inner = values
        *parents, last = key.split(".")
        for parent in parents:
            inner = inner.setdefault(parent, {})
        inner[last] = value
    return values
