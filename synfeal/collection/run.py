"""Collection of a data set on one machine: the workflow's stages, one after the other.

Scene, plan, sequences, finish: each is the function that the workflow's rule calls, with the same
seeds, and is skipped where what it makes lies there under its final name.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

import synfeal
from synfeal.collection.detail import write_detail
from synfeal.collection.growing import WORK, growing
from synfeal.collection.prepare import prepare_mesh, save_cartons
from synfeal.config.collection import SceneConfig
from synfeal.config.dataset import CameraConfig, DatasetConfig, Shade
from synfeal.config.effects import MOST_PATH_OBJECTS
from synfeal.dataset.finish import finish_dataset
from synfeal.dataset.frame_files import SUFFIX
from synfeal.dataset.layer_files import refuse_many_instances
from synfeal.dataset.manifest import MANIFEST
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.dataset.render_pool import Studio, render_sequences
from synfeal.dataset.render_sequence import resolved
from synfeal.dataset.sevenscenes import Split, sequences_of
from synfeal.dataset.world import read_scan_record, rigid_motion_of, write_sequence_from_world
from synfeal.effects.scene import crowd_of
from synfeal.errors import InputError
from synfeal.geometry.poses import moved_right
from synfeal.mesh.checks import shows_one_color
from synfeal.mesh.load import is_y_up
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import load_collision_mesh
from synfeal.planning.coverage import empty_pixels, scene_coverage
from synfeal.planning.plan import plan_mesh
from synfeal.records.files import write_json
from synfeal.records.progress import Progress
from synfeal.records.provenance import generator_of
from synfeal.render.surface import Layers

WARN_ABOVE = 0.1  # of all pixels: more than windows let through
SEES_MOST = 0.9  # of a view that meets the mesh
REFUSE_ABOVE = 0.95  # of all pixels: nobody wants a data set of the background

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
        raise InputError(
            f"{name}: is of one colour, and so would be every image; put its texture files (of an"
            " OBJ also the .mtl) where it names them, export it with its texture, or set"
            " render.shade to headlight, which shows its shape"
        )
    diagonal_m = float(np.linalg.norm(mesh.bounds_m[1] - mesh.bounds_m[0]))
    if diagonal_m <= camera.near_m:
        raise InputError(
            f"{name}: the mesh is {diagonal_m:.3g} m across, and cameras see nothing nearer than"
            f" near_m ({camera.near_m:g} m); give the metres per unit of the file with --unit-m"
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
                f"{name}: {share:.0%} of the pixels of the {split} frames would be empty: the"
                f" mesh spans {size_m} m, and cameras see nothing farther than far_m"
                f" ({camera.far_m:g} m) or outside; {_way_in(scene)}"
            )
        if share > WARN_ABOVE:
            log.warning(
                "%s: %.0f %% of the pixels of the %s frames will be empty: cameras look through"
                " holes or past the mesh; %s",
                name,
                100 * share,
                split,
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
                " --min-clearance %g",
                name,
                blocked,
                len(plan),
                split,
                baseline_m,
            )


def _way_in(scene: SceneConfig) -> str:
    if scene.sampling_box is None:
        return "give --unit-m or --box (synfeal inspect suggests them)"
    return "give another --unit-m, or a --box inside the mesh"


def _way_to_see_more(scene: SceneConfig) -> str:
    """Name what has not been tried yet."""
    if scene.sampling_box is None:
        return "a --box keeps them inside (synfeal inspect suggests one)"
    if (scene.min_seen or 0.0) < SEES_MOST:
        return f"--min-seen {SEES_MOST:g} refuses views of that"
    return "narrower bounds of --pitch, or a mesh with fewer holes, show less of that"


FEW_PATHS = 5


def warn_of_few_paths(plan: PoseTable, split: Split) -> None:
    """Say where the frames of a split, planned in mode ``path``, lie on few straight paths."""
    paths = n_paths(plan)
    if paths < FEW_PATHS:
        log.warning(
            "the %d %s frames lie on %s: they show little of the scene; more frames, a larger"
            " --spacing or --mode random show more",
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
    """A collection: mesh, settings and where to write the data set."""

    config: DatasetConfig  # settings with one scene, of one size
    packed_px: int | None  # side of packed frames that are written too, pixels, if any
    out: Path  # directory to create

    @property
    def scene(self) -> str:
        """The name of the scene."""
        return next(iter(self.config.scenes))

    @property
    def counts(self) -> dict[Split, int]:
        """Frames of each split."""
        (size,) = self.config.scenes[self.scene].sizes
        return {split: self.config.n_frames(self.scene, size, split) for split in SPLITS}

    @property
    def settings(self) -> dict[str, Any]:
        """All that decides the bytes of the data set, ready for JSON."""
        kept = self.config.model_dump(mode="json", exclude={"profile", "results"})
        world = self.sequence_from_world
        own = {} if world is None else {"sequence_from_world": world.tolist()}
        return {"synfeal": synfeal.__version__, **kept, "packed_px": self.packed_px, **own}

    @property
    def sequence_from_world(self) -> NDArray[np.float64] | None:
        """From the mesh's world to that of the sequence it was fused from, if it is a scan."""
        scene = self.config.scenes[self.scene]
        record = None if scene.path is None else read_scan_record(scene.path)
        if scene.path is None or record is None:
            return None
        if scene.unit_m != 1.0 or not is_y_up(scene.path, scene.up_axis):
            log.warning(
                "%s: is not used, --unit-m or --up-axis moves the mesh away from what it says",
                scene.path.with_suffix(".json"),
            )
            return None
        return rigid_motion_of(record, scene.path.with_suffix(".json"))


def collect(job: CollectJob, workers: int = 1) -> None:
    """Plan and render a data set into ``job.out``, which appears when it is complete.

    ``workers`` processes render, each a sequence at a time. What an earlier attempt made is kept
    and not made again.

    Raises:
        InputError: ``out`` is not empty, the mesh cannot be used, no admissible pose is found, an
            attempt with other settings stands in the way, or a file cannot be written.
    """
    if workers < 1:
        raise InputError(f"--workers: must be at least 1, found {workers}")
    side_px = min(job.config.network_camera.width, job.config.network_camera.height)
    if job.packed_px is not None and not 0 < job.packed_px < side_px:
        raise InputError(
            f"--packed: {job.packed_px} px must be positive and less than both sides of the image"
        )
    sequence_from_world = job.sequence_from_world
    with growing(job.out, job.settings) as part:
        if part is None:
            return
        scene = part / WORK / "scene"
        _prepare(job, scene)
        plans = _plan(job, scene, part)
        detail = _choose_detail(job, scene, part)
        _render(job, plans, scene / "mesh.glb", detail, part, workers)
        if sequence_from_world is not None:
            write_sequence_from_world(part, sequence_from_world)
        finish_dataset(
            scene / "mesh.glb",
            [part / f"{split}.csv" for split in plans],
            job.config.network_camera,
            job.counts,
            job.config.shard_frames,
            job.config.origin_of(job.scene),
            part / MANIFEST,
            packed_px=job.packed_px,
            detail=detail and detail.with_suffix(".json"),
        )


def _prepare(job: CollectJob, scene: Path) -> None:
    """Prepare the scene, unless that is done."""
    if not (scene / "mesh.glb").is_file():
        config, settings = job.config, job.config.scenes[job.scene]
        agreement = config.collection.collision_agreement
        shade = config.render.shade
        mesh, _ = prepare_mesh(job.scene, settings, agreement, config.seed, scene, shade)
        refuse_invisible(mesh, config.network_camera, str(settings.path), shade)
        if config.network_masks:
            refuse_many_instances(mesh, MOST_PATH_OBJECTS, str(settings.path))
    effects = job.config.render.effects
    if effects and effects.clutter:
        if not effects.clutter.files:
            save_cartons(scene / "mesh.glb")
        crowd_of(scene / "mesh.glb", job.config.render)  # what cannot be used is refused first


def _plan(job: CollectJob, scene: Path, part: Path) -> dict[Split, PoseTable]:
    """Plan the splits that have frames, and record what the plans cover."""
    config, name = job.config, job.scene
    splits = [split for split in SPLITS if job.counts[split]]
    coverage = part / "coverage.json"
    if not coverage.is_file():  # which is written last
        collision, camera = scene / "collision.ply", config.network_camera
        mesh, settings, plans = load_collision_mesh(collision), config.scenes[name], {}
        for split in splits:
            plans[split] = plan_mesh(
                mesh=mesh,
                name=str(collision),
                scene=settings,
                collection=config.collection,
                n_frames=job.counts[split],
                rng=generator_of(config.seed, "plan", name, split),
                split=split,
            )
        caster = RayCaster(*mesh)
        refuse_blank(caster, plans, camera, settings)
        if camera.stereo_baseline_m is not None:
            warn_of_walls(caster, plans, camera.stereo_baseline_m, str(settings.path))
        for split, plan in plans.items():
            if config.collection.mode == "path":
                warn_of_few_paths(plan, split)
            write_pose_table(part / f"{split}.csv", plan)
        covered = {s: scene_coverage(collision, settings, plans[s], camera) for s in splits}
        write_json(coverage, covered)
    return {split: read_pose_table(part / f"{split}.csv") for split in splits}


def _choose_detail(job: CollectJob, scene: Path, part: Path) -> Path | None:
    """Choose the mesh that colours are drawn from, unless that is done; None for the full one."""
    config, detail = job.config, scene / "detail.glb"
    if config.render.draws_full_mesh:
        return None
    record = detail.with_suffix(".json")
    if not record.is_file():  # which is written last
        plans = [part / f"{split}.csv" for split in SPLITS if job.counts[split]]
        write_detail(
            scene / "mesh.glb", plans, config.network_camera, config.render, detail, record
        )
    return detail


def _render(
    job: CollectJob,
    plans: dict[Split, PoseTable],
    mesh: Path,
    detail: Path | None,
    part: Path,
    workers: int,
) -> None:
    """Render the sequences that are not there."""
    config = job.config
    suffix = SUFFIX if config.archive_sequences else ""
    tasks = [
        (part / f"{s.name}{suffix}", plans[s.split].between(s.start, s.stop))
        for s in sequences_of(job.counts["train"], job.counts["test"], config.shard_frames)
    ]
    missing = [(out, poses) for out, poses in tasks if not out.exists()]
    n_frames, n_missing = (sum(len(poses) for _, poses in some) for some in (tasks, missing))
    layers = Layers(config.network_depth, config.network_normals, config.network_masks)
    studio = Studio(mesh, config.network_camera, config.render, layers, detail)
    with Progress(n_frames, "collect", n_frames - n_missing) as progress:
        render_sequences(studio, missing, workers, progress)


LEAST_INPUT_PX = 32
SAMPLES_SEEN = (
    14_000  # images shown to each localizer, as in the smallest set of the default profile
)
HEADER = """\
# The data set of `synfeal collect` with the same options, made by the workflow:
#   synfeal run --profile THIS_FILE -- datasets
# It appears in {root}/datasets/{scene}/network
"""
TRAINED = """\
# The five localizers trained and tested on it, up to {root}/report.html:
#   synfeal run --profile THIS_FILE
"""
UNTRAINED = """\
# There are no test frames: for localizers to be trained and tested too, give --test-frames.
"""
WIDE = """\
# Localizers are trained and compared on perspective images; on these: synfeal train.
"""


def with_backend(config: DatasetConfig) -> DatasetConfig:
    """Replace the backend ``auto`` by the one it stands for here, since images depend on it."""
    return config.model_copy(update={"render": resolved(config.render)})


def configuration_text(job: CollectJob) -> str:
    """Write the profile as YAML with every key, as missing keys come from the default profile.

    Where there are test frames, its design is one row: the localizers on this data set.
    """
    camera = job.config.network_camera
    values = job.config.model_dump(mode="json")
    # The side of packed frames, which the workflow makes for networks, has to fit into the image.
    input_px = job.packed_px or max(LEAST_INPUT_PX, min(64, camera.width - 1, camera.height - 1))
    values |= {"datasets": [job.scene], "network": {"input_px": input_px}}
    is_tested = job.counts["test"] > 0 and camera.projection is None
    if is_tested:
        (size,) = job.config.scenes[job.scene].sizes
        values["experiments"] = [{"table": "table4_size", "scene": job.scene, "size": size}]
        values["training"] = {"samples_seen": {size: SAMPLES_SEEN}}
    untrained = UNTRAINED if camera.projection is None else WIDE
    header = HEADER + (TRAINED if is_tested else untrained)
    named = {"root": job.config.root, "scene": job.scene}
    return header.format(**named) + yaml.safe_dump(values, sort_keys=False)
