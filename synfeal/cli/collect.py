"""``synfeal collect``: a 7-Scenes data set from a mesh."""

from __future__ import annotations

import argparse
from pathlib import Path

from pydantic import ValidationError

from synfeal.cli.options import MESH_OPTIONS, Command, Options, scene_values
from synfeal.config.load import describe
from synfeal.config.models import CameraConfig, CollectionConfig, SceneConfig
from synfeal.errors import InputError

OPTIONS: Options = (
    ("--mesh", {"type": Path, "required": True, "help": "GLB, glTF, OBJ or PLY file"}),
    ("--frames", {"type": int, "required": True, "help": "training frames"}),
    ("--out", {"type": Path, "required": True, "help": "directory to create"}),
    ("--test-frames", {"type": int, "default": 0, "help": "test frames (default: 0)"}),
    ("--width", {"type": int, "default": 640, "help": "image width, pixels (default: 640)"}),
    ("--height", {"type": int, "default": 480, "help": "image height, pixels (default: 480)"}),
    ("--fov", {"type": float, "default": 60.0, "help": "horizontal field of view, degrees (60)"}),
    ("--spacing", {"type": float, "default": 0.03, "help": "metres between frames (0.03)"}),
    ("--seed", {"type": int, "default": 0, "help": "root of all random numbers (0)"}),
    ("--depth", {"action": "store_true", "help": "write depth images too"}),
    (
        "--min-view-distance",
        {"type": float, "default": 1.2, "help": "min_view_distance_m: free view of targets (1.2)"},
    ),
    (
        "--min-path",
        {"type": float, "default": 1.5, "help": "min_path_m: shorter paths are drawn again (1.5)"},
    ),
)


def run(arguments: argparse.Namespace) -> None:
    """Carry out the command."""
    scene, collection, camera = collect_configs(arguments)
    from synfeal.dataset.collect import CollectJob, collect

    job = CollectJob(
        scene=scene,
        collection=collection,
        camera=camera,
        n_train=arguments.frames,
        n_test=arguments.test_frames,
        seed=arguments.seed,
        with_depth=arguments.depth,
        out=arguments.out,
    )
    collect(job)
    print(f"{arguments.out}: {job.n_train} training and {job.n_test} test frames")


def collect_configs(
    arguments: argparse.Namespace,
) -> tuple[SceneConfig, CollectionConfig, CameraConfig]:
    """The options as the models the stages take.

    Raises:
        InputError: a value is out of range.
    """
    try:
        scene = SceneConfig.model_validate(
            {**scene_values(arguments), "min_view_distance_m": arguments.min_view_distance}
        )
        collection = CollectionConfig.model_validate(
            {"frame_spacing_m": arguments.spacing, "min_path_m": arguments.min_path}
        )
        camera = CameraConfig.model_validate(
            {
                "width": arguments.width,
                "height": arguments.height,
                "horizontal_fov_deg": arguments.fov,
            }
        )
    except ValidationError as error:
        raise InputError(f"collect: {describe(error)}") from None
    return scene, collection, camera


COMMAND = Command("collect", "make a data set from a textured mesh", OPTIONS + MESH_OPTIONS, run)
