"""Speed of making frames on the machine at hand: collecting, and effects on them."""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from synfeal.config.collection import CollectionConfig, SceneConfig
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.config.effects import CLEAN, EffectsConfig
from synfeal.dataset.frame_files import encode_png
from synfeal.dataset.pose_table import PoseTable, read_frames, read_pose_table
from synfeal.dataset.render_sequence import Effects, drawn, write_sequence
from synfeal.effects.apply import Frame
from synfeal.effects.scene import open_scene
from synfeal.mesh.triangles import load_collision_mesh
from synfeal.planning.plan import plan_mesh
from synfeal.records.files import write_json
from synfeal.records.provenance import CPU_INFO, processor_name
from synfeal.records.tables import COUNT, NUMBER, TEXT, frame_of, write_frame
from synfeal.records.timing import seconds_of
from synfeal.render.surface import Layers

PAPER_CAMERA = CameraConfig(width=640, height=480)  # what the published code renders
FRAMES, PARTS = 100, 4
EFFECTS_FRAMES = 40
EFFECTS_SCHEMA = {"effects": TEXT, "width": COUNT, "height": COUNT, "cpu_s_per_frame": NUMBER}


def write_collection_speed(
    mesh: Path,
    collision: Path,
    scene: SceneConfig,
    collection: CollectionConfig,
    render: RenderConfig,
    seed: int,
    out_speed: Path,
) -> None:
    """Collect 100 frames of 640 x 480 in four parts and write how fast each was.

    A frame is a PNG file and its pose. The mesh is loaded once before, as in a job of any length.

    Args:
        mesh: Textured mesh in the world frame.
        collision: Mesh that rays are cast against.
        scene: Sampling box of the scene.
        collection: How paths are planned.
        render: How frames are drawn.
        seed: Seed of the plan.
        out_speed: File to write: ``width``, ``height``, ``frames_per_s`` of each part,
            ``processor``, ``cores``.
    """
    began = time.perf_counter()
    plan = plan_mesh(
        mesh=load_collision_mesh(collision),
        name=str(collision),
        scene=scene,
        collection=collection,
        n_frames=FRAMES,
        rng=np.random.default_rng(seed),
        split="train",
    )
    planning_s = (time.perf_counter() - began) / PARTS
    with (
        tempfile.TemporaryDirectory(dir=out_speed.parent) as folder,
        open_scene(mesh, PAPER_CAMERA, render) as renderer,
    ):
        parts = enumerate(np.array_split(np.arange(FRAMES), PARTS))
        seconds = seconds_of(
            partial(write_sequence, renderer, plan.at(rows), Path(folder, f"seq-{part}"), Layers())
            for part, rows in parts
        )
    write_json(
        out_speed,
        {
            "width": PAPER_CAMERA.width,
            "height": PAPER_CAMERA.height,
            "frames_per_s": [round(FRAMES / PARTS / (s + planning_s), 2) for s in seconds],
            "processor": processor_name(CPU_INFO),
            "cores": len(os.sched_getaffinity(0)),
        },
    )


def write_effects_speed(
    mesh: Path,
    plan: Path,
    camera: CameraConfig,
    render: RenderConfig,
    effects: Mapping[str, EffectsConfig],
    out_csv: Path,
) -> None:
    """Measure what effects cost per frame, and write the times, which differ between runs.

    Args:
        mesh: Textured mesh, world frame.
        plan: Pose table; its first 40 poses are drawn.
        camera: Camera of the frames.
        render: How frames are drawn.
        effects: Effects by name.
        out_csv: CSV to write: a row for ideal frames and one for each of the effects.
    """
    poses = read_frames(plan, 0, min(EFFECTS_FRAMES, len(read_pose_table(plan))))
    seconds = seconds_of_effects(mesh, poses, camera, render, effects)
    size = {"width": camera.width, "height": camera.height}
    rows = [{"effects": name, **size, "cpu_s_per_frame": s} for name, s in seconds.items()]
    write_frame(out_csv, frame_of(rows, EFFECTS_SCHEMA), float_format=None)


def seconds_of_effects(
    mesh: Path,
    poses: PoseTable,
    camera: CameraConfig,
    render: RenderConfig,
    effects: Mapping[str, EffectsConfig],
) -> dict[str, float]:
    """Time frames that are drawn and compressed, ideal and with effects.

    All are drawn in turn, so that what else the machine does slows them alike; the first frame
    loads what all use, and does not count.

    Args:
        mesh: Textured mesh, world frame.
        poses: Poses to draw.
        camera: Camera of the frames.
        render: Settings in use.
        effects: Effects by name.

    Returns:
        Processor seconds per frame by name.
    """
    switched = [e for e in effects.values() if e.light and e.light.states]
    opened = render.model_copy(update={"effects": switched[0] if switched else None})
    with open_scene(mesh, camera, opened) as renderer:
        through: dict[str, Effects | None] = {CLEAN: None}
        through |= {name: (camera, each) for name, each in effects.items()}
        frames = [drawn(renderer, poses, Layers(), each) for each in through.values()]
        works = [partial(_compress_next, each) for each in frames]
        rows = [seconds_of(works, of_processor=True) for _ in range(len(poses))]
    return dict(zip(through, np.mean(rows[1:], axis=0).tolist(), strict=True))


def _compress_next(frames: Iterator[Frame]) -> None:
    encode_png(next(frames)[0])
