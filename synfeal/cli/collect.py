"""``synfeal collect``: a 7-Scenes data set from a mesh."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

from pydantic import ValidationError

from synfeal.cli.camera import CAMERA_OPTIONS, camera_of
from synfeal.cli.options import MESH_OPTIONS, Command, Options, scene_values
from synfeal.config.load import describe
from synfeal.config.models import CameraConfig, CollectionConfig, RenderConfig, SceneConfig
from synfeal.errors import InputError
from synfeal.files import read_json

BACKENDS = get_args(RenderConfig.model_fields["backend"].annotation)
MODES = get_args(CollectionConfig.model_fields["mode"].annotation)

OPTIONS: Options = (
    ("--mesh", {"type": Path, "required": True, "help": "GLB, glTF, OBJ or PLY file"}),
    ("--frames", {"type": int, "required": True, "help": "training frames"}),
    ("--out", {"type": Path, "required": True, "help": "directory to create"}),
    ("--test-frames", {"type": int, "default": 0, "help": "test frames (default: 0)"}),
    ("--spacing", {"type": float, "default": 0.03, "help": "metres between frames (0.03)"}),
    ("--seed", {"type": int, "default": 0, "help": "root of all random numbers (0)"}),
    ("--depth", {"action": "store_true", "help": "write depth images too"}),
    ("--archive", {"action": "store_true", "help": "write each sequence as one seq-XX.zip"}),
    ("--packed", {"type": int, "metavar": "PX", "help": "write frames of PX x PX in one .npy too"}),
    ("--backend", {"choices": BACKENDS, "default": "auto", "help": "what draws (auto)"}),
    ("--workers", {"type": int, "default": 1, "help": "processes that render (1)"}),
    (
        "--shard",
        {"metavar": "I/N", "help": "render this part only, say 3/8 (docs/collecting.md)"},
    ),
    ("--mode", {"choices": MODES, "default": "path", "help": "where cameras go (path)"}),
    (
        "--poses",
        {
            "type": Path,
            "metavar": "FILE",
            "help": "mode repeat: data set, 7-Scenes frames, pose table (.csv) or TUM trajectory",
        },
    ),
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
    from synfeal.dataset.collect import collect
    from synfeal.dataset.collect_job import CollectJob
    from synfeal.dataset.shards import read_shard

    shard = read_shard(arguments.shard) if arguments.shard is not None else None
    job = CollectJob(
        scene=scene,
        collection=collection,
        camera=camera,
        render=RenderConfig(backend=arguments.backend),
        n_train=arguments.frames,
        n_test=arguments.test_frames,
        seed=arguments.seed,
        with_depth=arguments.depth,
        packed_px=arguments.packed,
        out=arguments.out,
        archived=arguments.archive,
    )
    collect(job, arguments.workers, shard)
    frames = f"{job.n_train} training and {job.n_test} test frames"
    print(f"{arguments.out}: {f'shard {arguments.shard} of ' if shard else ''}{frames}")
    if arguments.out.is_dir():
        print(coverage_text(read_json(arguments.out / "coverage.json")["train"]))


def coverage_text(coverage: Mapping[str, Any]) -> str:
    """What the training frames cover and how much of them is empty, from ``coverage.json``."""
    space, surface, empty = coverage["free_space"], coverage["surface"], coverage["empty_pixels"]
    pixels = (
        f"empty pixels: {empty['share']:.1%}, {empty['worst_frame_share']:.0%} of the emptiest"
        f" frame; {empty['mostly_empty_frames']:.1%} of the frames are more than half empty"
    )
    if space["positions_share"] is None:
        return f"coverage: no free space found in the sampling box\n{pixels}"
    return (
        f"coverage: {space['positions_share']:.0%} of the free space,"
        f" {space['headings_share']:.0%} of its headings;"
        f" {surface['seen_share']:.0%} of the visible surface,"
        f" {surface['seen_often_share']:.0%} three times or more\n{pixels}"
    )


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
            {
                "mode": arguments.mode,
                "repeat": arguments.poses,
                "frame_spacing_m": arguments.spacing,
                "min_path_m": arguments.min_path,
            }
        )
    except ValidationError as error:
        raise InputError(f"collect: {describe(error)}") from None
    return scene, collection, camera_of(arguments)


COMMAND = Command(
    "collect", "make a data set from a textured mesh", OPTIONS + CAMERA_OPTIONS + MESH_OPTIONS, run
)
