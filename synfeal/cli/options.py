"""What the commands share: how options are declared, and the options that describe a mesh."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from synfeal.config.mesh_files import check_mesh_file

# Flag, and what argparse is told about it.
Options = tuple[tuple[str, dict[str, Any]], ...]


@dataclass(frozen=True)
class Command:
    """One sub-command of ``synfeal``.

    Attributes:
        name: as it is typed.
        summary: one line for ``synfeal --help``.
        options: its options.
        run: carries it out; imports what it needs when it is called, so that ``--help`` is quick.
    """

    name: str
    summary: str
    options: Options
    run: Callable[[argparse.Namespace], None]


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
    ("--unit-m", {"type": float, "help": "metres per unit of the file (1)"}),
)


def scene_values(arguments: argparse.Namespace) -> dict[str, Any]:
    """What ``MESH_OPTIONS`` and the mesh say of a scene; the mesh must be there."""
    mesh: Path = arguments.mesh
    check_mesh_file(mesh, "--mesh")
    return {
        "source": "mesh",
        "path": mesh,
        "up_axis": arguments.up_axis,
        "unit_m": 1.0 if arguments.unit_m is None else arguments.unit_m,
        "sampling_box": _box(arguments.box),
    }


def _box(values: Sequence[float] | None) -> dict[str, Sequence[float]] | None:
    """X0 X1 Y0 Y1 Z0 Z1 as the mapping a configuration file holds."""
    if values is None:
        return None
    return {"x": values[0:2], "y": values[2:4], "z": values[4:6]}
