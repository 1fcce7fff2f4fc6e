"""``synfeal inspect``: the first look at a mesh."""

from __future__ import annotations

import argparse
from pathlib import Path

from pydantic import ValidationError

from synfeal.cli.options import MESH_OPTIONS, Command, Options, scene_values
from synfeal.config.load import describe
from synfeal.config.models import SceneConfig
from synfeal.errors import InputError

OPTIONS: Options = (
    ("mesh", {"type": Path, "metavar": "MESH", "help": "GLB, glTF, OBJ or PLY file"}),
    ("--out", {"type": Path, "help": "directory to write to (<name of the mesh>-inspect)"}),
)


def run(arguments: argparse.Namespace) -> None:
    """Carry out the command."""
    from synfeal.inspect.run import inspect_mesh

    out = arguments.out or Path(f"{arguments.mesh.stem}-inspect")
    try:
        scene = SceneConfig.model_validate(scene_values(arguments))
    except ValidationError as error:
        raise InputError(f"inspect: {describe(error)}") from None
    text = inspect_mesh(scene, out, arguments.unit_m is not None)
    print(f"{out}: inspect.html, inspect.png and inspect.json\n")
    print(text)


COMMAND = Command("inspect", "numbers, picture and 3D view of a mesh", OPTIONS + MESH_OPTIONS, run)
