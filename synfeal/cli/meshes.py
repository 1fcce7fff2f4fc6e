"""``synfeal collect`` and ``synfeal inspect``: what is made of a mesh, and the first look at it."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

from synfeal.cli.options import MESH_OPTIONS, command, option, options_among
from synfeal.config.models import CollectionConfig, RenderConfig
from synfeal.files import read_json
from synfeal.settings import KEYS, dataset_config, options_named, scene_config

BACKENDS = get_args(RenderConfig.model_fields["backend"].annotation)
MODES = get_args(CollectionConfig.model_fields["mode"].annotation)
RANGE: dict[str, Any] = {"type": float, "nargs": 2, "metavar": ("FROM", "TO")}
FILE: dict[str, Any] = {"type": Path, "metavar": "FILE"}


@command(
    "make a data set from a textured mesh",
    "synfeal collect --mesh scan.glb --frames 5000 --test-frames 1000 --out mydata",
    option("--mesh", "GLB, glTF, OBJ or PLY file", type=Path, required=True),
    option("--frames", "training frames", type=int, required=True),
    option("--out", "directory to create", type=Path, required=True),
    option("--test-frames", "test frames (0)", type=int, default=0),
    option("--depth", "write depth images too", action="store_true"),
    option("--seed", "root of all random numbers (0)", type=int),
    *MESH_OPTIONS,
    option("--spacing", "metres between frames (0.03)", type=float),
    option("--roll", "bounds of the camera's roll, degrees (-29.8 29.8)", **RANGE),
    option("--pitch", "bounds of its pitch; positive looks down (-29.8 29.8)", **RANGE),
    option("--yaw", "bounds of its heading; 0 is world x, 90 is y (0 360)", **RANGE),
    option("--min-view-distance", "least free view at the end of a path, metres (1.2)", type=float),
    option("--min-path", "metres; shorter paths are drawn again (1.5)", type=float),
    option("--mode", "where cameras go (path)", choices=MODES),
    option(
        "--poses",
        "mode repeat: data set, 7-Scenes frames, pose table (.csv) or TUM trajectory",
        **FILE,
    ),
    option("--camera", "calibration: OpenCV or ROS .yaml or .json, COLMAP cameras.txt", **FILE),
    option("--width", "image width, pixels (640, or that of --camera)", type=int),
    option("--height", "image height, pixels (480, or that of --camera)", type=int),
    option("--fov", "horizontal field of view, degrees (60)", type=float),
    option("--backend", "renderer (auto)", choices=BACKENDS),
    option("--supersampling", "N x N samples per pixel, 1 - 4 (2)", type=int, metavar="N"),
    option(
        "--background",
        "colour where nothing is hit, 0 - 255 each (0 0 0)",
        type=int,
        nargs=3,
        metavar=("R", "G", "B"),
    ),
    option(
        "--effects",
        "YAML: light, motion blur, exposure, noise and more (docs/variation.md)",
        **FILE,
    ),
    option(
        "--clutter",
        "YAML: objects that stand about, your own or cartons (docs/variation.md)",
        **FILE,
    ),
    option("--workers", "processes that render (1)", type=int, default=1),
    option("--sequence-frames", "frames per sequence (500)", type=int, metavar="N"),
    option("--archive", "write each sequence as one seq-XX.zip", action="store_true"),
    option("--packed", "write frames of PX x PX in one .npy too", type=int, metavar="PX"),
    option(
        "--print-config",
        "make nothing; print a configuration from which the workflow makes the same data set, on"
        " several machines if need be (docs/collecting.md)",
        action="store_true",
    ),
)
def collect(arguments: argparse.Namespace) -> None:
    """Plans camera paths through the free space of a mesh and renders them as a 7-Scenes data set.

    Run again after an interruption, it goes on where it stopped.
    """
    config = dataset_config(options_among(arguments, KEYS), arguments.out)
    from synfeal.collection import CollectJob, configuration_text, with_backend
    from synfeal.collection import collect as run_collection

    job = CollectJob(with_backend(config), arguments.packed, arguments.out)
    if arguments.print_config:
        print(configuration_text(job), end="")
        return
    with options_named():
        run_collection(job, arguments.workers)
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


@command(
    "numbers, picture and 3D view of a mesh",
    "synfeal inspect scan.glb",
    option("mesh", "GLB, glTF, OBJ or PLY file", type=Path, metavar="MESH"),
    option("--out", "directory to write to (<name of the mesh>-inspect)", type=Path),
    *MESH_OPTIONS,
)
def inspect(arguments: argparse.Namespace) -> None:
    """Shows what a mesh is and where cameras can be in it, before anything is collected.

    In numbers, a picture and an offline 3D page.
    """
    from synfeal.inspect.run import inspect_mesh

    out = arguments.out or Path(f"{arguments.mesh.stem}-inspect")
    scene = scene_config(options_among(arguments, KEYS))
    with options_named():
        text = inspect_mesh(scene, out, arguments.unit_m is not None)
    print(f"{out}: inspect.html, inspect.png and inspect.json\n")
    print(text)
