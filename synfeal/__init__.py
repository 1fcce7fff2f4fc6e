"""Synfeal: a data-driven simulator for end-to-end camera localization.

From one textured 3D mesh to a 7-Scenes data set with exact poses::

    import synfeal

    mesh = synfeal.load_mesh("scan.glb")
    poses = synfeal.plan("scan.glb", frames=200)
    with synfeal.Renderer(mesh, width=320, height=240) as renderer:
        rgb, depth_m = renderer.render_rgbd(poses.world_from_cam[0])
    synfeal.collect("scan.glb", "mydata", frames=200, test_frames=50, depth=True)
    data = synfeal.open_dataset("mydata")
    print(data.test.world_from_cam.shape, synfeal.validate("mydata"))
    print(synfeal.evaluate("mydata", "poses.csv").metrics)
    print(synfeal.pairs("mydata", "mydata-pairs", per_frame=20))

Every command is a function of the same name, whose keywords are the command's options; ``build``,
``train``, ``localize``, ``map`` and ``serve`` come with the package ``baselines``.
``docs/architecture.md`` says what is where.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from synfeal.api import (
        Dataset,
        Renderer,
        collect,
        evaluate,
        export,
        find_pairs,
        inspect,
        load_mesh,
        open_dataset,
        pairs,
        plan,
        preview,
        scan,
        unpack,
        validate,
    )
    from synfeal.pairing.flow import flow_between, read_flows
    from synfeal.pairing.run import read_pairs

__version__ = "0.1.0"
__all__ = [
    "Dataset",
    "Renderer",
    "collect",
    "evaluate",
    "export",
    "find_pairs",
    "flow_between",
    "inspect",
    "load_mesh",
    "open_dataset",
    "pairs",
    "plan",
    "preview",
    "read_flows",
    "read_pairs",
    "scan",
    "unpack",
    "validate",
]
# Modules of what is not in synfeal.api.
ELSEWHERE = {
    "flow_between": "synfeal.pairing.flow",
    "read_flows": "synfeal.pairing.flow",
    "read_pairs": "synfeal.pairing.run",
}


def __getattr__(name: str) -> Any:
    """Load a name when it is asked for; names of installed packages, too."""
    if name in __all__:
        return getattr(import_module(ELSEWHERE.get(name, "synfeal.api")), name)
    if not name.startswith("_"):
        for command in import_module("synfeal.cli.parser").added_commands():
            if command.name == name and command.function is not None:
                return resolve_name(command.function)
    raise AttributeError(f"module 'synfeal' has no attribute '{name}'")
