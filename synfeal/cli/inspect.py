"""``synfeal inspect``: the first look at a mesh."""

from __future__ import annotations

import argparse
from pathlib import Path

from synfeal.cli.options import MESH_OPTIONS, Command, Options, options_among
from synfeal.errors import InputError
from synfeal.settings import KEYS, in_words_of_options, scene_config

OPTIONS: Options = (
    ("mesh", {"type": Path, "metavar": "MESH", "help": "GLB, glTF, OBJ or PLY file"}),
    ("--out", {"type": Path, "help": "directory to write to (<name of the mesh>-inspect)"}),
)


def run(arguments: argparse.Namespace) -> None:
    """Carry out the command."""
    from synfeal.inspect.run import inspect_mesh

    out = arguments.out or Path(f"{arguments.mesh.stem}-inspect")
    scene = scene_config(options_among(arguments, KEYS))
    try:
        text = inspect_mesh(scene, out, arguments.unit_m is not None)
    except InputError as error:
        raise InputError(in_words_of_options(str(error))) from None
    print(f"{out}: inspect.html, inspect.png and inspect.json\n")
    print(text)


COMMAND = Command(
    "inspect",
    "numbers, picture and 3D view of a mesh",
    "Says what a mesh is and where cameras can be in it, before anything is collected: numbers, a"
    " picture and an offline 3D page.",
    "synfeal inspect scan.glb",
    OPTIONS + MESH_OPTIONS,
    run,
)
