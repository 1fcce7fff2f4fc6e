"""Every kind of file a stage reads: a sound one, its reader, and what the reader promises."""

import json
import math
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import torch
from PIL import Image

from baselines.config.learning import LocalizerConfig, NetworkConfig
from baselines.labels import batches
from baselines.labels.posegraph import graph as posegraph
from baselines.localizers.backbones.weights import load_backbone_weights
from baselines.training.checkpoint import read_checkpoint
from baselines.training.data import read_images
from baselines.training.score import score_run
from reproduction.config.load import load_config
from reproduction.config.profile import Config
from reproduction.design.experiments import read_experiments
from reproduction.design.labels import check_sources
from reproduction.statistics.limits import combine, read_metrics
from reproduction.tables.assistance import assistance_record
from synfeal.camera.calibration import read_calibration
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset.depth import read_depth_m
from synfeal.dataset.images import read_rgb
from synfeal.dataset.known_camera import camera_of_dataset
from synfeal.dataset.packed import pack_frames, read_packed
from synfeal.dataset.packed import write_packed as write_joined
from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.dataset.sevenscenes import pose_text, read_pose, read_split
from synfeal.mesh.load import load_mesh
from synfeal.mesh.save import save_glb
from synfeal.mesh.triangles import load_collision_mesh
from synfeal.planning.repeat import read_poses
from synfeal.records.files import write_json
from synfeal.validation.run import validate
from tests.support import mesh_samples as meshes
from tests.support.colored_frames import save, untrained
from tests.support.damaged_sets import write_planar_set
from tests.support.report_results import CONFIG, design_of, fill_assistance
from tests.support.room_scene import straight_path
from tests.synfeal.test_calibration import OLD_OPENCV

CAMERA = CameraConfig(width=24, height=18)
TINY = NetworkConfig(input_px=32, width=0.01)
CPU = torch.device("cpu")
N = 6
POSES = straight_path(N, 0.1, 3.0)


@dataclass(frozen=True)
class Kind:
    name: str
    file: str  # below a folder
    write: Callable[[Path], object]  # there, and around it what belongs to it
    read: Callable[[Path], object]
    is_valid: Callable[[Any], bool] = lambda value: True  # what the reader promises
    form: str = ""  # separator of a table's cells, or json
    n_flips: int = 12  # bytes changed at random, in the head of the file and again anywhere

    def make(self, folder):
        path = folder / self.file
        path.parent.mkdir(parents=True, exist_ok=True)
        self.write(path)
        return path


def elsewhere(read):
    """A reader that writes what it makes into a directory of its own."""

    def reads(path):
        with TemporaryDirectory() as out:
            return read(path, Path(out))

    return reads


def text(content):
    return lambda path: path.write_text(content)


def noise(shape, most, dtype=np.uint8):
    return np.random.default_rng(1).integers(most // 16, most, shape).astype(dtype)


def image(*values):
    return lambda path: Image.fromarray(noise(*values)).save(path)


def is_rigid(pose):
    turned = pose[..., :3, :3] @ np.swapaxes(pose[..., :3, :3], -1, -2)
    return bool(np.isfinite(pose).all() and np.allclose(turned, np.eye(3), atol=1e-6))


def is_pose_table(table):
    counts = np.array([table.frame, table.path])
    return bool((counts >= 0).all() and (counts < 1e12).all() and is_rigid(table.world_from_cam))


write_color, write_depth = image((18, 24, 3), 256), image((18, 24), 4000, np.uint16)
write_table = partial(write_pose_table, table=POSES)
repeated = partial(read_poses, split="train")
write_data_set = partial(write_planar_set, camera=CAMERA, counts=(2, 2))
write_packed = partial(np.save, arr=noise((N, 8, 8, 3), 256))
FOUND = batches.BatchTrajectory(POSES.world_from_cam, np.ones(N, bool))
LINEAR = torch.nn.Linear(3, 2)
is_finite = partial(json.dumps, allow_nan=False)  # raises where a number is not


def write_graph(path):
    pose = POSES.world_from_cam
    edges = [posegraph.Edge(i, i + 1, pose[0], np.eye(6)) for i in range(N - 1)]
    posegraph.write_g2o(path, posegraph.PoseGraph(pose, tuple(edges)))


def is_graph(graph):
    posegraph.check_connected(graph)
    return is_rigid(graph.first_from_cam) and all(is_rigid(e.i_from_j) for e in graph.edges)


def packed(path, out):
    pack_frames([path.parent], 8, out / "packed.npy")
    return np.load(out / "packed.npy")


def is_packed(frames):
    return frames.dtype == np.uint8 and frames.ndim == 4 and int(frames.sum()) >= 0


def write_record(path):
    write_packed(path.with_name("train.npy"))
    write_table(path.with_name("train.csv"))
    write_json(path, {"frames": N, "backend": "raycast"})


def recorded(path, out):
    frames, parts = out / "train.npy", [path.with_name("train.npy")]
    given = (path.with_name("train.csv"), parts, [path], CAMERA, RenderConfig(), "square")
    write_joined(*given, frames)
    return json.loads(frames.with_suffix(".json").read_text())["shards"][0]


TUM = "# timestamp tx ty tz qx qy qz qw\n" + "".join(f"{i} 0.1 0.2 {i} 0 0 0 1\n" for i in range(N))
K = [[500.0, 0, 320.0], [0, 500.0, 240.0], [0, 0, 1]]
JSON_CAMERA = json.dumps({"K": K, "dist": [0.1, 0, 0, 0, 0], "image_size": [640, 480]})
WRITE_POSE = text(pose_text(POSES.world_from_cam[0]))
COLMAP = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS\n1 OPENCV 640 480 500 500 320 240 0.1 0 0 0\n"


def is_camera(found):
    values = (found.fx, found.fy, *found.distortion)
    return found.fx > 0 < found.fy and all(map(math.isfinite, values))


def is_statistics(found):
    shapes = found.mean.shape == found.deviation.shape == (1, 3, 1, 1)
    return bool(shapes and found.mean.isfinite().all() and (found.deviation > 0).all())


def scored(path, out):
    write_table(labels := out / "labels.csv")
    score_run(path, labels, labels, labels, out / "errors.csv", out / "metrics.json", {})
    return json.loads((out / "metrics.json").read_text())


def write_metrics(path):
    write_table(predictions := path.with_name("predictions.csv"))
    scored(predictions, path.parent)


def read_design(path):
    config = load_config(CONFIG / "config.yaml", CONFIG / "smoke.yaml")
    rows = read_experiments(config.model_copy(update={"experiments": path}))
    check_sources(rows, path)
    return rows


def is_design(rows):
    """Whether every run and label set has a directory of its own."""
    for parts in (Path(run.directory).parts for run in design_of(rows).runs):
        assert len(parts) == 6
        assert all(part.strip(".") and "\0" not in part for part in parts)
    label_sets = {(row.scene, row.size, row.label_id) for row in rows}
    noise = {(row.scene, row.size, row.labels, row.noise_m, row.noise_deg) for row in rows}
    return len(label_sets) == len(noise)


COLOR, DEPTH, POSE = (f"frame-000000.{end}" for end in ("color.png", "depth.png", "pose.txt"))
# fmt: off
KINDS = (
    Kind("pose table", "train.csv", write_table, read_pose_table, is_pose_table, ","),
    Kind("TUM trajectory", "poses.txt", text(TUM), repeated, is_pose_table, " "),
    Kind("batch trajectory", "b.csv",
         lambda p: batches.write_trajectory(p, FOUND), batches.read_trajectory,
         lambda t: is_rigid(t.first_from_cam), ","),
    Kind("pose graph", "batch.g2o", write_graph, posegraph.read_g2o, is_graph, " "),
    Kind("pose", POSE, WRITE_POSE, read_pose, lambda p: bool(np.isfinite(p).all()), "\t"),
    Kind("split", "TrainSplit.txt", text("sequence1\nsequence2\n"),
         lambda p: read_split(p.parent, "train"), form="e"),
    Kind("colour image", COLOR, write_color, read_rgb, lambda rgb: rgb.ndim == 3),
    Kind("colour image, packed", COLOR, write_color, elsewhere(packed), is_packed),
    Kind("colour image, SfM", COLOR, write_color,
         elsewhere(lambda p, out: batches.link_images([p], CAMERA, out / "images"))),
    Kind("colour image, odometry", COLOR, write_color,
         lambda p: batches.read_image(p, CAMERA, "RGB"), lambda rgb: rgb.shape == (18, 24, 3)),
    Kind("depth image", DEPTH, write_depth, read_depth_m, lambda m: m.dtype == np.float32),
    Kind("packed frames", "train.npy", write_packed, read_packed, is_packed, n_flips=60),
    Kind("packed frames, training", "train.npy", write_packed, lambda p: read_images(p, N, 8, CPU)),
    Kind("record of packed frames", "seq-01.json", write_record, elsewhere(recorded),
         is_finite, "json"),
    Kind("manifest, camera", "manifest.json", lambda p: write_data_set(p.parent),
         lambda p: camera_of_dataset(p.parent, None), form="json"),
    *(Kind(f"{file}, validated", file, lambda p, up=up: write_data_set(p.parents[up]),
           lambda p, up=up: validate(p.parents[up], None, False), n_flips=6)
      for file, up in (("manifest.json", 0), ("TrainSplit.txt", 0), (f"seq-01/{POSE}", 1))),
    Kind("OpenCV's camera", "camera.yaml", text(OLD_OPENCV), read_calibration, is_camera, " "),
    Kind("JSON camera", "camera.json", text(JSON_CAMERA), read_calibration, is_camera, "json"),
    Kind("calibration of COLMAP", "cameras.txt", text(COLMAP), read_calibration, is_camera, " "),
    Kind("GLB", "scene.glb", lambda p: save_glb(p, meshes.box_mesh()), load_mesh, meshes.is_sound,
         n_flips=60),
    Kind("glTF", "scene.gltf", meshes.write_painted_gltf, load_mesh, meshes.is_sound, "json"),
    *(Kind(name, file, meshes.write_painted_obj, lambda p: load_mesh(p.with_name("scene.obj")),
           meshes.is_sound, form)
      for name, file, form in (("OBJ", "scene.obj", " "), ("material", "scene.mtl", " "),
                               ("texture", "wall.png", ""))),
    Kind("PLY", "scene.ply", meshes.write_ply, load_mesh, meshes.is_sound, " "),
    Kind("collision mesh", "collision.ply", meshes.write_collision, load_collision_mesh,
         meshes.is_sound_triangles, n_flips=60),
    Kind("checkpoint", "model.pt",
         lambda p: save(p, untrained("posenet2", TINY, LocalizerConfig())),
         lambda p: read_checkpoint(p, CPU).statistics, is_statistics, n_flips=40),
    Kind("backbone", "googlenet.pt", lambda p: torch.save(dict(LINEAR.state_dict()), p),
         lambda p: load_backbone_weights(LINEAR, p), n_flips=40),
    Kind("predictions", "predictions.csv", write_table, elsewhere(scored), is_finite, ","),
    Kind("metrics", "metrics.json", write_metrics, lambda p: combine([read_metrics(p)]),
         form="json"),
    Kind("assistance", "labels/large_room/6k/sfm/assistance.json",
         lambda p: fill_assistance(p.parents[4], {"sfm": 1}, batches=(1, 1)),
         lambda p: assistance_record(p.parents[4], "large_room", "6k", "sfm"), is_finite,
         "json"),
    Kind("profile", "mine.yaml", lambda p: shutil.copy(CONFIG / "config.yaml", p), load_config,
         lambda config: isinstance(config, Config), n_flips=60),
    Kind("experiments", "mine.csv",
         lambda p: shutil.copy(CONFIG / "experiments-smoke.csv", p), read_design, is_design, ","),
)
# fmt: on
