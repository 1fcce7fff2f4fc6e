"""``synfeal collect``: a 7-Scenes data set from a mesh."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

from synfeal.cli.options import MESH_OPTIONS, Command, Options, options_among
from synfeal.config.models import CollectionConfig, RenderConfig
from synfeal.errors import InputError
from synfeal.files import read_json
from synfeal.settings import KEYS, dataset_config, in_words_of_options

BACKENDS = get_args(RenderConfig.model_fields["backend"].annotation)
MODES = get_args(CollectionConfig.model_fields["mode"].annotation)
RANGE: dict[str, Any] = {"type": float, "nargs": 2, "metavar": ("FROM", "TO")}

OPTIONS: Options = (
    ("--mesh", {"type": Path, "required": True, "help": "GLB, glTF, OBJ or PLY file"}),
    ("--frames", {"type": int, "required": True, "help": "training frames"}),
    ("--out", {"type": Path, "required": True, "help": "directory to create"}),
    ("--test-frames", {"type": int, "default": 0, "help": "test frames (0)"}),
    ("--depth", {"action": "store_true", "help": "write depth images too"}),
    ("--seed", {"type": int, "help": "root of all random numbers (0)"}),
)
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
MOVEMENT_OPTIONS: Options = (
    ("--spacing", {"type": float, "help": "metres between frames (0.03)"}),
    ("--roll", {**RANGE, "help": "bounds of the camera's roll, degrees (-29.8 29.8)"}),
    ("--pitch", {**RANGE, "help": "bounds of its pitch; positive looks down (-29.8 29.8)"}),
    ("--yaw", {**RANGE, "help": "bounds of its heading; 0 is world x, 90 is y (0 360)"}),
    (
        "--min-view-distance",
        {"type": float, "help": "metres of free view that a path ends with, at least (1.2)"},
    ),
    ("--min-path", {"type": float, "help": "metres; shorter paths are drawn again (1.5)"}),
    ("--mode", {"choices": MODES, "help": "where cameras go (path)"}),
    (
        "--poses",
        {
            "type": Path,
            "metavar": "FILE",
            "help": "mode repeat: data set, 7-Scenes frames, pose table (.csv) or TUM trajectory",
        },
    ),
)
RENDER_OPTIONS: Options = (
    ("--backend", {"choices": BACKENDS, "help": "what draws (auto)"}),
    ("--supersampling", {"type": int, "metavar": "N", "help": "N x N samples a pixel, 1 - 4 (2)"}),
    (
        "--background",
        {
            "type": int,
            "nargs": 3,
            "metavar": ("R", "G", "B"),
            "help": "colour where nothing is, 0 - 255 each (0 0 0)",
        },
    ),
    (
        "--effects",
        {
            "type": Path,
            "metavar": "FILE",
            "help": "YAML: light, motion blur, exposure, noise and more (docs/variation.md)",
        },
    ),
    (
        "--clutter",
        {
            "type": Path,
            "metavar": "FILE",
            "help": "YAML: objects that stand about, your own or cartons (docs/variation.md)",
        },
    ),
    ("--workers", {"type": int, "default": 1, "help": "processes that render (1)"}),
    (
        "--sequence-frames",
        {"type": int, "metavar": "N", "help": "frames of a sequence, rendered at once (500)"},
    ),
    ("--archive", {"action": "store_true", "help": "write each sequence as one seq-XX.zip"}),
    ("--packed", {"type": int, "metavar": "PX", "help": "write frames of PX x PX in one .npy too"}),
    (
        "--print-config",
        {
            "action": "store_true",
            "help": "make nothing; print a configuration with which the workflow makes the same"
            " data set, on several machines if need be (docs/collecting.md)",
        },
    ),
)


def run(arguments: argparse.Namespace) -> None:
    """Carry out the command."""
    config = dataset_config(options_among(arguments, KEYS), arguments.out)
    from synfeal.collection.collect import CollectJob, collect
    from synfeal.collection.configuration import configuration_text, with_backend

    job = CollectJob(with_backend(config), arguments.packed, arguments.out)
    if arguments.print_config:
        print(configuration_text(job), end="")
        return
    try:
        collect(job, arguments.workers)
    except InputError as error:
        raise InputError(in_words_of_options(str(error))) from None
    print(f"{job.out}: {job.counts['train']} training and {job.counts['test']} test frames")
    print(coverage_text(read_json(job.out / "coverage.json")["train"]))


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


COMMAND = Command(
    "collect",
    "make a data set from a textured mesh",
    "Plans camera paths through the free space of a mesh, renders them, and writes a 7-Scenes data"
    " set with exact poses; started again after an interruption, it goes on.",
    "synfeal collect --mesh scan.glb --frames 5000 --test-frames 1000 --out mydata",
    OPTIONS + MESH_OPTIONS + MOVEMENT_OPTIONS + CAMERA_OPTIONS + RENDER_OPTIONS,
    run,
)
