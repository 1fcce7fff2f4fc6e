"""One scene under measurement: configuration, camera paths, rendered frames."""

from __future__ import annotations

import hashlib
import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from baselines.groundtruth.batches import Batch, batches_of
from benchmarks.scene_difficulty.pool import run_tasks
from synfeal.config.load import merge, parse_config, read_yaml
from synfeal.config.models import Config
from synfeal.dataset.pose_table import PoseTable
from synfeal.dataset.render_sequence import render_sequence
from synfeal.errors import InputError
from synfeal.files import write_json
from synfeal.planning.plan import plan_scene
from synfeal.scenes.prepare import prepare_scene
from synfeal.seeds import generator_of

# Taken from the paper's profile; all else is the configuration's.
PAPER_KEYS = ("collection", "groundtruth")
CAMERA = {"width": 320, "height": 240, "horizontal_fov_deg": 60.0}

# Frames of the paths that are planned, and how many of them, evenly spread, are looked at one by
# one: so many paths that most places are seen from several of them.
PLANNED_FRAMES = 20_000
SAMPLED_FRAMES = 500


@dataclass(frozen=True, eq=False)
class Survey:
    """What every part of the measurement works on; compared and hashed by identity.

    Attributes:
        scene: its name in the configuration.
        cfg: the configuration, with the paper's camera paths and batches.
        work: directory of this scene's mesh and frames.
        out: directory of the tables.
        n_batches: batches to reconstruct.
        jobs: processes to use.
        plan: poses along the simulator's paths.
    """

    scene: str
    cfg: Config
    work: Path
    out: Path
    n_batches: int
    jobs: int
    plan: PoseTable

    def table(self, name: str) -> Path:
        """Where the table of a part is written."""
        return self.out / f"{self.scene}-{name}.csv"

    @property
    def truth(self) -> PoseTable:
        """True poses of all batches."""
        return self.plan.first(self.n_batches * self.cfg.groundtruth.batch_frames + 1)

    @property
    def batches(self) -> list[Batch]:
        """The batches: each shares its first frame with the one before."""
        return batches_of(len(self.truth), self.cfg.groundtruth.batch_frames)

    @property
    def sample(self) -> PoseTable:
        """Frames spread evenly over all paths."""
        step = PLANNED_FRAMES // SAMPLED_FRAMES
        chosen = slice(step // 2, PLANNED_FRAMES, step)
        plan = self.plan
        return PoseTable(
            plan.frame[chosen], plan.path[chosen], plan.position_m[chosen], plan.quat_wxyz[chosen]
        )

    def batch_dir(self, batch: Batch) -> Path:
        """Frames of a batch."""
        return self.work / f"batch-{batch.index:03d}"

    @property
    def sample_dir(self) -> Path:
        """Frames of the sample."""
        return self.work / "sample"


def read_setting(config: Path) -> Config:
    """The configuration with the camera paths and batches of ``paper.yaml`` beside it.

    Raises:
        InputError: either file is missing or wrong.
    """
    paper_path = config.with_name("paper.yaml")
    paper = {key: value for key, value in read_yaml(paper_path).items() if key in PAPER_KEYS}
    camera = {"groundtruth_camera": CAMERA}
    raw = merge(merge(read_yaml(config), paper), camera)
    return parse_config(raw, f"{config} + {paper_path}")


def open_survey(
    scene: str, cfg: Config, work: Path, out: Path, n_batches: int, jobs: int
) -> Survey:
    """Build the scene, plan its paths, and find its directories.

    Frames lie in a directory named after everything they depend on, so those of another scene or
    setting are never taken. ``<out>/<scene>/setting.json`` guards the results likewise.

    Raises:
        InputError: the scene is unknown or cannot be used, or ``out`` holds results of another
            mesh or setting.
    """
    if scene not in cfg.scenes:
        raise InputError(f"--scene: '{scene}' is not one of {', '.join(sorted(cfg.scenes))}")
    out = out.resolve()
    work.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{scene}-", dir=work) as temporary:
        built = Path(temporary) / "scene"
        prepare_scene(scene, cfg.scenes[scene], cfg.collection.collision_agreement, cfg.seed, built)
        setting = _setting_of(scene, cfg, built)
        _guard(out / scene / "setting.json", setting)
        key = hashlib.sha256(json.dumps(setting, sort_keys=True).encode()).hexdigest()[:12]
        directory = work.resolve() / f"{scene}-{key}"
        if not directory.exists():
            built.replace(directory)
    n_frames = max(PLANNED_FRAMES, n_batches * cfg.groundtruth.batch_frames + 1)
    rng = generator_of(cfg.seed, "plan", scene, "train")
    collision = directory / "collision.ply"
    plan = plan_scene(collision, cfg.scenes[scene], cfg.collection, n_frames, rng)
    return Survey(scene, cfg, directory, out, n_batches, jobs, plan)


def render_missing(survey: Survey, blocks: dict[Path, PoseTable]) -> None:
    """Render colour and depth of every block whose directory is not there yet."""
    camera, mesh = survey.cfg.groundtruth_camera, survey.work / "mesh.glb"
    tasks = [
        (mesh, camera, poses, directory, True)
        for directory, poses in blocks.items()
        if not directory.exists()
    ]
    run_tasks(render_sequence, tasks, survey.jobs, "render")


def _setting_of(scene: str, cfg: Config, built: Path) -> dict[str, Any]:
    """Everything the results of a scene depend on besides the code that measures."""
    return {
        "scene": scene,
        "seed": cfg.seed,
        "mesh_sha256": _sha256(built / "mesh.glb"),
        "collision_sha256": _sha256(built / "collision.ply"),
        "sampling": cfg.scenes[scene].model_dump(mode="json", exclude={"sizes"}),
        "collection": cfg.collection.model_dump(mode="json"),
        "camera": cfg.groundtruth_camera.model_dump(mode="json"),
        "groundtruth": cfg.groundtruth.model_dump(mode="json"),
    }


def _guard(path: Path, setting: dict[str, Any]) -> None:
    """Record the setting beside its results, or refuse to mix it with another one's.

    Raises:
        InputError: the recorded setting is another one.
    """
    if not path.exists():
        write_json(path, setting)
        return
    found = json.loads(path.read_text(encoding="utf-8"))
    differing = sorted(key for key in setting if found.get(key) != setting[key])
    if differing:
        raise InputError(
            f"{path}: results were measured with another {', '.join(differing)};"
            f" delete {path.parent} or choose another --out"
        )


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
