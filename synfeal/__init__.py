"""Synfeal: a data-driven simulator for end-to-end camera localization.

From one textured 3D mesh to a 7-Scenes data set with exact poses::

    import synfeal

    mesh = synfeal.load_mesh("scan.glb")
    plan = synfeal.plan("scan.glb", frames=200)
    with synfeal.Renderer(mesh, width=320, height=240) as renderer:
        rgb, depth_m = renderer.render_rgbd(plan.world_from_cam[0])
    synfeal.collect("scan.glb", "mydata", frames=200, test_frames=50, depth=True)
    data = synfeal.open_dataset("mydata")
    print(data.test.world_from_cam.shape, synfeal.validate("mydata"))
    print(synfeal.evaluate("mydata", "poses.csv").metrics)
    print(synfeal.find_pairs("mydata", "mydata-pairs", per_frame=20))

Keywords are the options of ``synfeal collect``. ``docs/architecture.md`` says what is where.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from synfeal.api import (
        Dataset,
        Renderer,
        collect,
        evaluate,
        find_pairs,
        load_mesh,
        open_dataset,
        plan,
        validate,
    )

__version__ = "0.1.0"
__all__ = [
    "Dataset",
    "Renderer",
    "collect",
    "evaluate",
    "find_pairs",
    "load_mesh",
    "open_dataset",
    "plan",
    "validate",
]


def __getattr__(name: str) -> Any:
    """Load the functions of :mod:`synfeal.api` when the first of them is asked for."""
    if name not in __all__:
        raise AttributeError(f"module 'synfeal' has no attribute '{name}'")
    return getattr(import_module("synfeal.api"), name)
