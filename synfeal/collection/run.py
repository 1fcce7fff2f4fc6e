"""Collection of a data set on one machine: the workflow's stages, one after the other.

Scene, plan, sequences, finish: each is the function that the workflow's rule calls, with the same
seeds, and is skipped where what it makes lies there under its final name.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import synfeal
from synfeal.collection.detail import write_detail
from synfeal.collection.growing import WORK, growing
from synfeal.collection.prepare import prepare_mesh, save_cartons
from synfeal.config.collect import SCENE, CollectConfig, ViewConfig
from synfeal.config.collection import SceneConfig
from synfeal.config.dataset import CameraConfig, Shade, origin_record
from synfeal.config.effects import MOST_PATH_OBJECTS
from synfeal.dataset.finish import finish_dataset
from synfeal.dataset.frame_files import SUFFIX
from synfeal.dataset.layer_files import refuse_many_instances
from synfeal.dataset.manifest import MANIFEST
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.dataset.render_pool import Studio, render_sequences
from synfeal.dataset.render_sequence import resolved
from synfeal.dataset.sevenscenes import Split, sequences_of
from synfeal.dataset.world import read_scan_record, write_sequence_from_world
from synfeal.effects.scene import crowd_of
from synfeal.errors import Argument, InputError
from synfeal.geometry.poses import moved_right
from synfeal.mesh.checks import color_range, shows_one_color
from synfeal.mesh.load import is_y_up, load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import load_collision_mesh, merge_vertices
from synfeal.planning.coverage import empty_pixels, scene_coverage
from synfeal.planning.plan import plan_mesh
from synfeal.records.files import file_sha256, write_json
from synfeal.records.progress import Progress, at_work
from synfeal.records.provenance import generator_of
from synfeal.render.surface import Layers

WARN_ABOVE = 0.1  # share of empty pixels: more than windows let through
SEES_MOST = 0.9  # share of a view that meets the mesh
REFUSE_ABOVE = 0.95  # share of empty pixels: nobody wants the background

log = logging.getLogger("synfeal")


def refuse_invisible(
    mesh: TexturedMesh, camera: CameraConfig, name: str, shade: Shade | None = None
) -> None:
    """Refuse a mesh of one colour, or one so small that a camera's near plane hides all of it.

    Args:
        mesh: The mesh.
        camera: Camera of the frames.
        name: What messages call the mesh.
        shade: Light that shows its shape; a mesh of one colour is refused only without.
    """
    if shade is None and shows_one_color(mesh):
        rgb = " ".join(f"{level:.0f}" for level in color_range(mesh)[1])
        found = f" (on reading: {'; '.join(mesh.findings[:2])})" if mesh.findings else ""
        raise InputError(
            name,
            f"is of one colour, {rgb} of 255, and so would be every image{found}",
            "put its texture files (of an OBJ also the .mtl) where it names them, export it with"
            ' its texture, or give `shade="headlight"`, which shows its shape',
        )
    diagonal_m = float(np.linalg.norm(mesh.bounds_m[1] - mesh.bounds_m[0]))
    if diagonal_m <= camera.near_m:
        raise InputError(
            name,
            f"the mesh is {diagonal_m:.3g} m across, and cameras see nothing nearer than near_m"
            f" ({camera.near_m:g} m)",
            "give the metres per unit of the file with `unit_m`",
        )


def refuse_blank(
    caster: RayCaster, plans: Mapping[Split, PoseTable], camera: CameraConfig, scene: SceneConfig
) -> None:
    """Warn of plans whose images would show little; refuse those that would show nothing.

    Args:
        caster: Rays against the collision mesh.
        plans: Poses by split.
        camera: Camera of the frames.
        scene: Settings of the scene: messages name its mesh and say what to change.
    """
    name = scene.path
    for split, plan in plans.items():
        share = empty_pixels(caster, plan, camera).share
        if share > REFUSE_ABOVE:
            size_m = " x ".join(f"{side:.3g}" for side in np.diff(caster.bounds_m, axis=0)[0])
            raise InputError(
                name,
                f"{share:.0%} of the pixels of the {split} frames would be empty: the mesh spans"
                f" {size_m} m, and cameras see nothing farther than far_m ({camera.far_m:g} m) or"
                f" outside; {_way_in(scene)}",
            )
        if share > WARN_ABOVE:
            log.warning(
                "%s: %.0f %% of the pixels of the %s frames will be empty: cameras look through"
                " holes, past the mesh, or farther than they see (`far_m=%g`); %s",
                name,
                100 * share,
                split,
                camera.far_m,
                _way_to_see_more(scene),
            )


def warn_of_walls(
    caster: RayCaster, plans: Mapping[Split, PoseTable], baseline_m: float, name: str
) -> None:
    """Warn of frames between whose left and right camera there is a surface."""
    for split, plan in plans.items():
        left = plan.world_from_cam
        right = moved_right(left, baseline_m)
        blocked = int(np.sum(~caster.sees(left[:, :3, 3], right[:, :3, 3])))
        if blocked:
            log.warning(
                "%s: in %d of %d %s frames a surface is between the two cameras; give"
                " `min_clearance_m=%g`",
                name,
                blocked,
                len(plan),
                split,
                baseline_m,
            )


def _way_in(scene: SceneConfig) -> str:
    if scene.sampling_box is None:
        return "give `unit_m` or `box` (synfeal inspect suggests them)"
    return "give another `unit_m`, or a `box` inside the mesh"


def _way_to_see_more(scene: SceneConfig) -> str:
    """Name what has not been tried yet."""
    if scene.sampling_box is None:
        return "a `box` of synfeal collect keeps them inside (synfeal inspect suggests one)"
    if (scene.min_seen or 0.0) < SEES_MOST:
        return f"`min_seen={SEES_MOST:g}` of synfeal collect refuses views of that"
    return "narrower bounds of `pitch_deg`, or a mesh with fewer holes, show less of that"


FEW_PATHS = 5


def warn_of_few_paths(plan: PoseTable, split: Split) -> None:
    """Say where the frames of a split, planned in mode ``path``, lie on few straight paths."""
    paths = n_paths(plan)
    if paths < FEW_PATHS:
        log.warning(
            "the %d %s frames lie on %s: they show little of the scene; more frames, a larger"
            ' `spacing_m` or `mode="random"` show more',
            len(plan),
            {"train": "training", "test": "test"}[split],
            "one straight path" if paths == 1 else f"{paths} straight paths",
        )


def n_paths(plan: PoseTable) -> int:
    """Count the paths that frames of a plan lie on."""
    return len(np.unique(plan.path))


SPLITS: tuple[Split, ...] = ("train", "test")


@dataclass(frozen=True)
class CollectJob:
    """A collection: settings, and where to write the data set."""

    config: CollectConfig
    out: Path  # directory to create

    @cached_property
    def scene(self) -> SceneConfig:
        """The scene, with the hash of its mesh as it is now."""
        scene = self.config.scene
        return scene.model_copy(update={"sha256": file_sha256(self.config.mesh)})

    @property
    def settings(self) -> dict[str, Any]:
        """All that decides the bytes of the data set, ready for JSON."""
        drawing = {"background_rgb", "backend", "shade", "supersampling"}
        lens = set(ViewConfig.model_fields) - drawing  # ``camera`` below is what they come to
        world, poses = self.sequence_from_world, self.config.poses
        return {
            "synfeal": synfeal.__version__,
            **self.config.model_dump(mode="json", exclude=lens | {"stereo_m"}),
            "mesh": str(self.config.mesh.absolute()),
            "poses": poses and str(poses.absolute()),
            "mesh_sha256": self.scene.sha256,
            "camera": self.config.view.model_dump(mode="json"),
            "sequence_from_world": None if world is None else world.tolist(),
        }

    @cached_property
    def sequence_from_world(self) -> NDArray[np.float64] | None:
        """From the mesh's world to that of the sequence it was fused from, if it is a scan."""
        mesh = self.config.mesh
        record = read_scan_record(mesh)
        if record is None:
            return None
        if self.config.unit_m != 1.0 or not is_y_up(mesh, self.config.up_axis):
            log.warning(
                "%s: the world of the scan is not used, unit or up axis move the mesh away from it",
                record.source,
            )
            return None
        return record.sequence_from_world


def collect(config: CollectConfig, out: Path, cores: int = 1) -> None:
    """Plan and render a data set into ``out``, which appears when it is complete.

    What an earlier attempt made is kept and not made again.

    Args:
        config: Settings of the data set; the backend ``auto`` is that which it stands for here,
            since images depend on it.
        out: Directory to create.
        cores: Number of processes that render, each a sequence at a time.

    Raises:
        InputError: ``out`` is not empty, the mesh cannot be used, no admissible pose is found, an
            attempt with other settings stands in the way, or a file cannot be written.
    """
    if cores < 1:
        raise InputError(Argument("cores"), f"must be at least 1, found {cores}")
    job = CollectJob(config.changed(backend=resolved(config.render).backend), out)
    with growing(job.out, job.settings) as part:
        if part is None:
            return
        scene = part / WORK / "scene"
        with at_work("collect", "preparing the mesh"):
            _prepare(job, scene)
        with at_work("collect", "planning paths"):
            plans = _plan(job, scene, part)
        with at_work("collect", "choosing the mesh to draw"):
            detail = _choose_detail(job.config, scene, part)
        _render(job.config, plans, scene / "mesh.glb", detail, part, cores)
        if job.sequence_from_world is not None:
            write_sequence_from_world(part, job.sequence_from_world)
        finish_dataset(
            scene / "mesh.glb",
            [part / f"{split}.csv" for split in plans],
            job.config.view,
            job.config.counts,
            job.config.sequence_frames,
            origin_record(
                SCENE, job.scene, job.config.collection, job.config.render, job.config.seed
            ),
            part / MANIFEST,
            packed_px=job.config.packed_px,
            detail=detail and detail.with_suffix(".json"),
        )


def _prepare(job: CollectJob, scene: Path) -> None:
    """Prepare the scene, unless that is done."""
    config, name = job.config, str(job.config.mesh)
    if not (scene / "mesh.glb").is_file():
        agreement = config.collection.collision_agreement
        shade = config.shade
        mesh, _ = prepare_mesh(SCENE, job.scene, agreement, config.seed, scene, shade, name)
        refuse_invisible(mesh, config.view, name, shade)
        if config.masks:
            refuse_many_instances(mesh, MOST_PATH_OBJECTS, name)
    if config.effects and config.effects.clutter:
        if not config.effects.clutter.files:
            save_cartons(scene / "mesh.glb")
        crowd_of(scene / "mesh.glb", config.render)  # what cannot be used is refused first


def _plan(job: CollectJob, scene: Path, part: Path) -> dict[Split, PoseTable]:
    """Plan the splits that have frames, and record what the plans cover."""
    config = job.config
    splits = [split for split in SPLITS if config.counts[split]]
    coverage = part / "coverage.json"
    if not coverage.is_file():  # which is written last
        collision = scene / "collision.ply"
        mesh = load_collision_mesh(collision)
        plans = {
            split: plan_mesh(
                mesh=mesh,
                name=str(config.mesh),
                scene=job.scene,
                collection=config.collection,
                n_frames=config.counts[split],
                rng=generator_of(config.seed, "plan", SCENE, split),
                split=split,
            )
            for split in splits
        }
        caster = RayCaster(*mesh)
        refuse_blank(caster, plans, config.view, job.scene)
        if config.view.stereo_baseline_m is not None:
            warn_of_walls(caster, plans, config.view.stereo_baseline_m, str(config.mesh))
        for split, plan in plans.items():
            if config.mode == "path":
                warn_of_few_paths(plan, split)
            write_pose_table(part / f"{split}.csv", plan)
        covered = {s: scene_coverage(collision, job.scene, plans[s], config.view) for s in splits}
        write_json(coverage, covered)
    return {split: read_pose_table(part / f"{split}.csv") for split in splits}


def plan_training(config: CollectConfig) -> PoseTable:
    """Plan the training poses that :func:`collect` renders with the same settings."""
    mesh = load_mesh(config.mesh, config.up_axis, config.unit_m)
    return plan_mesh(
        mesh=merge_vertices(*mesh.merged()),
        name=str(config.mesh),
        scene=config.scene,
        collection=config.collection,
        n_frames=config.frames,
        rng=generator_of(config.seed, "plan", SCENE, "train"),
        split="train",
    )


def _choose_detail(config: CollectConfig, scene: Path, part: Path) -> Path | None:
    """Choose the mesh that colours are drawn from, unless that is done; None for the full one."""
    detail = scene / "detail.glb"
    if config.render.draws_full_mesh:
        return None
    record = detail.with_suffix(".json")
    if not record.is_file():  # which is written last
        plans = [part / f"{split}.csv" for split in SPLITS if config.counts[split]]
        write_detail(scene / "mesh.glb", plans, config.view, config.render, detail, record)
    return detail


def _render(
    config: CollectConfig,
    plans: dict[Split, PoseTable],
    mesh: Path,
    detail: Path | None,
    part: Path,
    cores: int,
) -> None:
    """Render the sequences that are not there."""
    suffix = SUFFIX if config.archive else ""
    tasks = [
        (part / f"{s.name}{suffix}", plans[s.split].between(s.start, s.stop))
        for s in sequences_of(config.frames, config.test_frames, config.sequence_frames)
    ]
    missing = [(out, poses) for out, poses in tasks if not out.exists()]
    n_frames, n_missing = (sum(len(poses) for _, poses in some) for some in (tasks, missing))
    layers = Layers(config.depth, config.normals, config.masks)
    studio = Studio(mesh, config.view, config.render, layers, detail)
    with Progress(n_frames, "collect", n_frames - n_missing) as progress:
        render_sequences(studio, missing, cores, progress)
