"""How fast a scene is collected: planning, rendering and writing frames, on the machine at hand."""

from __future__ import annotations

import os
import tempfile
import time
from pathlib import Path

import numpy as np

from synfeal.config.models import CameraConfig, CollectionConfig, RenderConfig, SceneConfig
from synfeal.dataset.render_sequence import write_sequence
from synfeal.effects.scene import open_scene
from synfeal.files import write_json
from synfeal.planning.plan import plan_scene
from synfeal.provenance import CPU_INFO, processor_name

# What the published code renders.
CAMERA = CameraConfig(width=640, height=480)
FRAMES, PARTS = 100, 4


def write_collection_speed(
    mesh: Path,  # textured, in the world frame
    collision: Path,  # mesh that rays are cast against
    scene: SceneConfig,  # its sampling box
    collection: CollectionConfig,  # how paths are planned
    render: RenderConfig,  # how frames are drawn
    seed: int,  # of the plan
    # ``width``, ``height``, ``frames_per_s`` of each part, ``processor``, ``cores``
    out_speed: Path,
) -> None:
    """Collect 100 frames of 640 x 480 in four parts and write how fast each was.

    A frame is a PNG file and its pose. The mesh is loaded once before, as in a job of any length.
    """
    began = time.perf_counter()
    plan = plan_scene(collision, scene, collection, FRAMES, np.random.default_rng(seed))
    planning_s = (time.perf_counter() - began) / PARTS
    seconds = []
    with (
        tempfile.TemporaryDirectory(dir=out_speed.parent) as folder,
        open_scene(mesh, CAMERA, render) as renderer,
    ):
        for part, rows in enumerate(np.array_split(np.arange(FRAMES), PARTS)):
            began = time.perf_counter()
            write_sequence(
                renderer, plan.at(rows), Path(folder) / f"seq-{part + 1:02d}", with_depth=False
            )
            seconds.append(time.perf_counter() - began + planning_s)
    write_json(
        out_speed,
        {
            "width": CAMERA.width,
            "height": CAMERA.height,
            "frames_per_s": [round(FRAMES / PARTS / s, 2) for s in seconds],
            "processor": processor_name(CPU_INFO),
            "cores": len(os.sched_getaffinity(0)),
        },
    )
