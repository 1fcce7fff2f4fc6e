"""Command line: look at a mesh, make a 7-Scenes data set from it, compare two result trees."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from synfeal import __version__
from synfeal.config.load import describe
from synfeal.config.mesh_files import check_mesh_file
from synfeal.config.models import CameraConfig, CollectionConfig, SceneConfig
from synfeal.errors import InputError

Options = tuple[tuple[str, dict[str, Any]], ...]

# Flag, and what argparse is told about it.
MESH_OPTIONS: Options = (
    (
        "--box",
        {
            "type": float,
            "nargs": 6,
            "metavar": ("X0", "X1", "Y0", "Y1", "Z0", "Z1"),
            "help": "sampling_box: where camera centres are sampled, metres (the mesh's bounds)",
        },
    ),
    ("--up-axis", {"choices": ("auto", "y", "z"), "default": "auto", "help": "up in the file"}),
    ("--unit-m", {"type": float, "default": 1.0, "help": "metres per unit of the file (1)"}),
)
COLLECT_OPTIONS: Options = (
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
INSPECT_OPTIONS: Options = (
    ("mesh", {"type": Path, "metavar": "MESH", "help": "GLB, glTF, OBJ or PLY file"}),
    ("--out", {"type": Path, "help": "directory to write to (<name of the mesh>-inspect)"}),
)
COMPARE_OPTIONS: Options = (
    ("results_a", {"type": Path, "metavar": "RESULTS_A", "help": "results before, e.g. a copy"}),
    ("results_b", {"type": Path, "metavar": "RESULTS_B", "help": "results after: results/mini"}),
    ("--out", {"type": Path, "help": "directory for compare.csv, compare.md and compare.png"}),
)


def build_parser() -> argparse.ArgumentParser:
    """The parser of the ``synfeal`` command."""
    parser = argparse.ArgumentParser(prog="synfeal", description=__doc__)
    parser.add_argument("--version", action="version", version=f"synfeal {__version__}")
    commands = parser.add_subparsers(required=True)
    collect = commands.add_parser("collect", help="make a data set from a textured mesh")
    _add(collect, COLLECT_OPTIONS + MESH_OPTIONS, run_collect)
    inspect = commands.add_parser("inspect", help="numbers, picture and 3D view of a mesh")
    _add(inspect, INSPECT_OPTIONS + MESH_OPTIONS, run_inspect)
    compare = commands.add_parser("compare", help="two result trees: did a change matter?")
    _add(compare, COMPARE_OPTIONS, run_compare)
    return parser


def _add(
    parser: argparse.ArgumentParser,
    options: Options,
    action: Callable[[argparse.Namespace], None],
) -> None:
    for flag, details in options:
        parser.add_argument(flag, **details)
    parser.set_defaults(action=action)


def run_inspect(arguments: argparse.Namespace) -> None:
    """Carry out ``synfeal inspect``."""
    from synfeal.inspect.run import inspect_mesh  # imports a renderer: not for --help

    out = arguments.out or Path(f"{arguments.mesh.stem}-inspect")
    try:
        scene = SceneConfig.model_validate(_scene_values(arguments))
    except ValidationError as error:
        raise InputError(f"inspect: {describe(error)}") from None
    print(inspect_mesh(scene, out))
    print(f"\n{out}: inspect.html, inspect.png and inspect.json")


def run_collect(arguments: argparse.Namespace) -> None:
    """Carry out ``synfeal collect``."""
    scene, collection, camera = collect_configs(arguments)
    from synfeal.dataset.collect import CollectJob, collect  # imports a renderer: takes seconds

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


def run_compare(arguments: argparse.Namespace) -> None:
    """Carry out ``synfeal compare``."""
    from synfeal.report.compare.run import compare  # above this module, as in architecture.md

    print(compare(arguments.results_a, arguments.results_b, arguments.out), end="")
    if arguments.out:
        print(f"\n{arguments.out}: compare.md, compare.png and compare.csv")


def collect_configs(
    arguments: argparse.Namespace,
) -> tuple[SceneConfig, CollectionConfig, CameraConfig]:
    """The options as the models the stages take.

    Raises:
        InputError: a value is out of range.
    """
    try:
        scene = SceneConfig.model_validate(
            {
                **_scene_values(arguments),
                "min_view_distance_m": arguments.min_view_distance,
            }
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


def _scene_values(arguments: argparse.Namespace) -> dict[str, Any]:
    """What ``MESH_OPTIONS`` and the mesh say of a scene; the mesh must be there."""
    check_mesh_file(arguments.mesh, "--mesh")
    return {
        "source": "mesh",
        "path": arguments.mesh,
        "up_axis": arguments.up_axis,
        "unit_m": arguments.unit_m,
        "sampling_box": _box(arguments.box),
    }


def _box(values: Sequence[float] | None) -> dict[str, Sequence[float]] | None:
    """X0 X1 Y0 Y1 Z0 Z1 as the mapping a configuration file holds."""
    if values is None:
        return None
    return {"x": values[0:2], "y": values[2:4], "z": values[4:6]}


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point: 0, 1 with ``error: ...`` for what a person can mend, 2 for wrong usage."""
    logging.basicConfig(format="%(levelname)s: %(message)s", level=logging.WARNING)
    arguments = build_parser().parse_args(argv)
    try:
        arguments.action(arguments)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("error: interrupted; nothing was kept", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
