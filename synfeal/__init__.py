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

Every command is a function of the same name, whose keywords are the command's options; ``train``,
``localize`` and ``map`` come with the package ``baselines``. ``docs/architecture.md`` says what is
where.
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
        validate,
    )

__version__ = "0.1.0"
__all__ = [
    "Dataset",
    "Renderer",
    "collect",
    "evaluate",
    "export",
    "find_pairs",
    "inspect",
    "load_mesh",
    "open_dataset",
    "pairs",
    "plan",
    "preview",
    "scan",
    "validate",
]


def __getattr__(name: str) -> Any:
    """Load a function of :mod:`synfeal.api`, or of an installed package, when it is asked for."""
    if name in __all__:
        return getattr(import_module("synfeal.api"), name)
    if not name.startswith("_"):
        for command in import_module("synfeal.cli").added_commands():
            if command.name == name and command.function is not None:
                return resolve_name(command.function)
    raise AttributeError(f"module 'synfeal' has no attribute '{name}'")
