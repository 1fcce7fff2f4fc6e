"""Every kind of file a stage reads: a sound one, its reader, and what the reader promises."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image

from baselines.groundtruth.images import link_images, read_image
from baselines.groundtruth.methods import check_sources
from baselines.groundtruth.posegraph.graph import (
    Edge,
    PoseGraph,
    check_connected,
    read_g2o,
    write_g2o,
)
from baselines.groundtruth.trajectory import BatchTrajectory, read_trajectory, write_trajectory
from baselines.localizers.backbones.weights import load_backbone_weights
from baselines.localizers.registry import build_localizer
from baselines.training.checkpoint import read_checkpoint, save_checkpoint
from baselines.training.data import ImageStatistics, read_images
from baselines.training.description import ModelDescription
from baselines.training.score import score_run
from synfeal.camera.calibration_files import read_calibration
from synfeal.config import Config, load_config, read_experiments
from synfeal.config.models import CameraConfig, LocalizerConfig, NetworkConfig, RenderConfig
from synfeal.dataset.manifest import write_manifest
from synfeal.dataset.packed import join_packed, pack_frames, read_packed, write_packed_record
from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.dataset.sevenscenes import (
    Sequence,
    pose_text,
    read_depth_m,
    read_pose,
    read_split,
    write_splits,
)
from synfeal.files import write_json
from synfeal.mesh.load import load_mesh
from synfeal.mesh.save import save_glb
from synfeal.mesh.triangles import Triangles, load_collision_mesh, save_collision_mesh
from synfeal.planning.repeat import read_poses
from synfeal.report.assistance import assistance_record
from synfeal.report.stats import combine, read_metrics
from synfeal.validation.images import read_color, read_depth_mm
from synfeal.validation.manifest import camera_of_dataset
from synfeal.validation.run import validate
from tests.mesh_samples import UV, box_mesh, store_gltf, textured, triangle_gltf, write_obj
from tests.planar_scene import straight_path
from tests.report_results import design_of

CAMERA = CameraConfig(width=24, height=18)
CPU = torch.device("cpu")
N = 6
POSES = straight_path(N, 0.1, 3.0)


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    Attributes:
        name: of the kind.
        file: its path, below a folder.
        write: writes a sound file there, and around it what belongs to it.
        read: what a stage does with the path.
        is_valid: whether a value keeps what the reader promises.
        form: separator of a table's cells, ``json``, or empty for what is binary.
        n_flips: bytes changed at random, in the head of the file and again anywhere.
    """

    name: str
    file: str
    write: Callable[[Path], object]
    read: Callable[[Path], object]
    is_valid: Callable[[Any], bool] = lambda value: True
    form: str = ""
    n_flips: int = 12

    def make(self, folder):
        """A sound file in a folder."""
        path = folder / self.file
        path.parent.mkdir(parents=True, exist_ok=True)
        self.write(path)
        return path


@contextmanager
def removed(*outputs):
    """What a reader writes beside the file goes before the folder is looked at."""
    try:
        yield
    finally:
        for output in outputs:
            shutil.rmtree(output) if output.is_dir() else output.unlink(missing_ok=True)


def is_rigid(pose):
    turned = pose[..., :3, :3] @ np.swapaxes(pose[..., :3, :3], -1, -2)
    return bool(np.isfinite(pose).all() and np.allclose(turned, np.eye(3), atol=1e-6))


def is_pose_table(table):
    whole = (table.frame >= 0).all() and (table.path >= 0).all()
    return bool(whole and (np.abs(table.frame) < 1e12).all() and is_rigid(table.world_from_cam))


def finite_numbers(value):
    """No text where numbers are, and all of them finite."""
    if isinstance(value, dict):
        return all(map(finite_numbers, value.values()))
    if isinstance(value, list | tuple):
        return all(map(finite_numbers, value))
    return not isinstance(value, float) or math.isfinite(value)


def write_table(path):
    write_pose_table(path, POSES)


def write_pose(path):
    path.write_text(pose_text(POSES.world_from_cam[0]))


def read_poses_of(path):
    return read_poses(path, "train")


def write_tum(path):
    lines = [f"{i} 0.1 0.2 {i} 0 0 0 1\n" for i in range(N)]
    path.write_text("# timestamp tx ty tz qx qy qz qw\n" + "".join(lines))


def write_batch(path):
    write_trajectory(path, BatchTrajectory(POSES.world_from_cam, np.ones(N, bool)))


def write_graph(path):
    pose = POSES.world_from_cam
    edges = [Edge(i, i + 1, pose[0], np.eye(6)) for i in range(N - 1)]
    write_g2o(path, PoseGraph(pose, tuple(edges)))


def is_graph(graph):
    check_connected(graph)
    return is_rigid(graph.first_from_cam) and all(is_rigid(e.i_from_j) for e in graph.edges)


def write_color(path):
    rgb = np.random.default_rng(1).integers(0, 256, (18, 24, 3), dtype=np.uint8)
    Image.fromarray(rgb).save(path)


def write_depth(path):
    mm = np.random.default_rng(2).integers(500, 4000, (18, 24)).astype(np.uint16)
    Image.fromarray(mm).save(path)


def linked(path):
    with removed(images := path.parent / "images"):
        link_images([path], CAMERA, images)


def packed(path):
    with removed(out := path.parent / "packed.npy"):
        pack_frames([path.parent], 8, out)
        return np.load(out)


def write_data_set(folder):
    sequences = [Sequence("seq-01", "train", 0, 2), Sequence("seq-02", "test", 0, 2)]
    for place, sequence in enumerate(sequences):
        directory = folder / sequence.name
        directory.mkdir(exist_ok=True)
        for frame, pose in enumerate(straight_path(4, 0.1, 3.0).world_from_cam[2 * place :][:2]):
            write_color(directory / f"frame-{frame:06d}.color.png")
            (directory / f"frame-{frame:06d}.pose.txt").write_text(pose_text(pose))
    write_splits(folder, sequences)
    write_manifest(folder, sequences, CAMERA, {})


def write_packed(path):
    np.save(path, np.random.default_rng(3).integers(0, 256, (N, 8, 8, 3), dtype=np.uint8))


def is_packed(frames):
    return frames.dtype == np.uint8 and frames.ndim == 4 and int(frames.sum()) >= 0


def write_record(path):
    write_packed(path.with_name("train.npy"))
    write_table(path.with_name("train.csv"))
    write_json(path, {"frames": N, "backend": "raycast"})


def recorded(path):
    frames, plan = path.with_name("train.npy"), path.with_name("train.csv")
    with removed(out := frames.with_suffix(".json")):
        write_packed_record(frames, [path], plan, CAMERA, RenderConfig())
        return json.loads(out.read_text())["shards"][0]


OPENCV = """%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   data: [500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   data: [0.1, -0.05, 0.001, 0.001, 0.0]
"""
K = [[500.0, 0, 320.0], [0, 500.0, 240.0], [0, 0, 1]]
JSON_CAMERA = json.dumps({"K": K, "dist": [0.1, 0, 0, 0, 0], "image_size": [640, 480]})
COLMAP = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS\n1 OPENCV 640 480 500 500 320 240 0.1 0 0 0\n"


def text(content):
    return lambda path: path.write_text(content)


def is_camera(calibration):
    values = (calibration.fx, calibration.fy, *calibration.distortion)
    return calibration.fx > 0 and calibration.fy > 0 and all(map(math.isfinite, values))


def write_gltf(path):
    write_wall(path)
    store_gltf(path.parent, *triangle_gltf(textured(), ["wall.png"]))


def write_wall(path):
    Image.new("RGB", (4, 4), (9, 99, 199)).save(path.parent / "wall.png")


def write_scene(path):
    write_wall(path)
    write_obj(path.parent)


def write_ply(path):
    rows = [f"{x} {y} {x * y} {60 * x} 9 99" for x, y in np.round(4 * UV, 2)]
    names = "".join(f"property float {a}\n" for a in "xyz")
    names += "".join(f"property uchar {c}\n" for c in ("red", "green", "blue"))
    head = f"ply\nformat ascii 1.0\nelement vertex 3\n{names}element face 1\n"
    head += "property list uchar int vertex_indices\nend_header\n"
    path.write_text(head + "\n".join(rows) + "\n3 0 1 2\n")


def write_collision(path):
    (part,) = box_mesh().parts
    save_collision_mesh(path, Triangles(part.vertices_m, part.faces))


def is_triangles(mesh):
    in_range = mesh.faces.min() >= 0 and mesh.faces.max() < len(mesh.vertices_m)
    return bool(len(mesh.faces) and in_range and np.isfinite(mesh.vertices_m).all())


def is_mesh(mesh):
    triangles = [Triangles(part.vertices_m, part.faces) for part in mesh.parts]
    return bool(triangles) and all(map(is_triangles, triangles))


def write_checkpoint(path):
    statistics = ImageStatistics(torch.zeros(1, 3, 1, 1), torch.ones(1, 3, 1, 1))
    network, hyper = NetworkConfig(input_px=32, width=0.01), LocalizerConfig()
    localizer = build_localizer("posenet2", network, hyper)
    description = ModelDescription(localizer="posenet2", network=network, hyper=hyper)
    save_checkpoint(path, localizer, statistics, description)


def is_statistics(found):
    shapes = found.mean.shape == found.deviation.shape == (1, 3, 1, 1)
    return bool(shapes and found.mean.isfinite().all() and (found.deviation > 0).all())


def network():
    return torch.nn.Linear(3, 2)


def scored(path):
    errors, metrics = path.with_name("e.csv"), path.with_name("m.json")
    write_table(labels := path.parents[1] / "labels.csv")
    with removed(errors, metrics):
        score_run(path, labels, labels, labels, errors, metrics, {})
        return json.loads(metrics.read_text())


def write_metrics(path):
    write_table(labels := path.with_name("labels.csv"))
    score_run(labels, labels, labels, labels, path.with_name("errors.csv"), path, {})


def write_assistance(path):
    record = {
        **{"index": 0, "start": 0, "stop": 4, "registered": 4, "filled": 0},
        **{"lost": False, "assisted": True, "error_before_m": 0.3, "error_before_deg": 1.0},
        **{"error_after_m": 0.0, "error_after_deg": 0.0},
    }
    splits = {split: {"records": [record]} for split in ("train", "test")}
    write_json(path, {"method": "sfm", "splits": splits})


COLOR, DEPTH, POSE = (f"frame-000000.{end}" for end in ("color.png", "depth.png", "pose.txt"))
OF_SET = "seq-01/frame-000000.pose.txt"


def validated(folder):
    return validate(folder, None, False)


CONFIG = Path(__file__).parent.parent / "config"


def copied(name):
    return lambda path: shutil.copy(CONFIG / name, path)


def read_design(path):
    config = load_config(CONFIG / "config.yaml", CONFIG / "smoke.yaml")
    rows = read_experiments(config.model_copy(update={"experiments": path}))
    check_sources(rows, path)
    return rows


def is_design(rows):
    """Whether every run and label set has a directory of its own below the results."""
    for run in design_of(rows).runs:
        assert all(part.strip(".") and "\0" not in part for part in Path(run.directory).parts)
        assert len(Path(run.directory).parts) == 6
    label_sets = {(row.scene, row.size, row.label_id) for row in rows}
    noise = {(row.scene, row.size, row.labels, row.noise_m, row.noise_deg) for row in rows}
    return len(label_sets) == len(noise)


# fmt: off
KINDS = (
    Kind("pose table", "train.csv", write_table, read_pose_table, is_pose_table, ","),
    Kind("poses to repeat", "train.csv", write_table, read_poses_of, is_pose_table, ","),
    Kind("TUM trajectory", "poses.txt", write_tum, read_poses_of, is_pose_table, " "),
    Kind("batch trajectory", "b.csv", write_batch, read_trajectory,
         lambda t: is_rigid(t.first_from_cam), ","),
    Kind("pose graph", "batch.g2o", write_graph, read_g2o, is_graph, " "),
    Kind("pose", POSE, write_pose, read_pose, lambda p: bool(np.isfinite(p).all()), "\t"),
    Kind("pose to repeat", POSE, write_pose, lambda p: read_poses_of(p.parent), is_pose_table,
         "\t"),
    Kind("split", "TrainSplit.txt", text("sequence1\nsequence2\n"),
         lambda p: read_split(p.parent, "train"), form="e"),
    Kind("colour image", COLOR, write_color, read_color, lambda rgb: rgb.ndim == 3),
    Kind("colour image, packed", COLOR, write_color, packed, is_packed),
    Kind("colour image, SfM", COLOR, write_color, linked),
    Kind("colour image, odometry", COLOR, write_color, lambda p: read_image(p, CAMERA, "RGB"),
         lambda rgb: rgb.shape == (18, 24, 3)),
    Kind("depth image", DEPTH, write_depth, read_depth_mm, lambda mm: mm.dtype == np.uint16),
    Kind("depth image, metres", DEPTH, write_depth, read_depth_m, lambda m: bool((m >= 0).all())),
    Kind("packed frames", "train.npy", write_packed, read_packed, is_packed, n_flips=60),
    Kind("packed frames, joined", "train.npy", write_packed,
         lambda p: join_packed([p], p.with_name("all.npy"))),
    Kind("packed frames, training", "train.npy", write_packed, lambda p: read_images(p, N, 8, CPU)),
    Kind("record of packed frames", "seq-01.json", write_record, recorded, finite_numbers, "json"),
    Kind("manifest, camera", "manifest.json", lambda p: write_data_set(p.parent),
         lambda p: camera_of_dataset(p.parent, None), form="json"),
    Kind("manifest, validated", "manifest.json", lambda p: write_data_set(p.parent),
         lambda p: validated(p.parent), n_flips=6),
    Kind("split, validated", "TrainSplit.txt", lambda p: write_data_set(p.parent),
         lambda p: validated(p.parent), n_flips=6),
    Kind("pose, validated", OF_SET, lambda p: write_data_set(p.parents[1]),
         lambda p: validated(p.parents[1]), n_flips=6),
    Kind("calibration of OpenCV", "camera.yaml", text(OPENCV), read_calibration, is_camera, " "),
    Kind("calibration as JSON", "camera.json", text(JSON_CAMERA), read_calibration, is_camera,
         "json"),
    Kind("calibration of COLMAP", "cameras.txt", text(COLMAP), read_calibration, is_camera, " "),
    Kind("GLB", "scene.glb", lambda p: save_glb(p, box_mesh()), load_mesh, is_mesh, n_flips=60),
    Kind("glTF", "scene.gltf", write_gltf, load_mesh, is_mesh, "json"),
    Kind("OBJ", "scene.obj", write_scene, load_mesh, is_mesh, " "),
    Kind("PLY", "scene.ply", write_ply, load_mesh, is_mesh, " "),
    Kind("material", "scene.mtl", write_scene, lambda p: load_mesh(p.with_suffix(".obj")), is_mesh,
         " "),
    Kind("texture", "wall.png", write_scene, lambda p: load_mesh(p.with_name("scene.obj")),
         is_mesh),
    Kind("collision mesh", "collision.ply", write_collision, load_collision_mesh, is_triangles,
         n_flips=60),
    Kind("checkpoint", "model.pt", write_checkpoint, lambda p: read_checkpoint(p, CPU).statistics,
         is_statistics, n_flips=40),
    Kind("backbone", "googlenet.pt", lambda p: torch.save(dict(network().state_dict()), p),
         lambda p: load_backbone_weights(network(), p), n_flips=40),
    Kind("predictions", "predictions.csv", write_table, scored, finite_numbers, ","),
    Kind("metrics", "metrics.json", write_metrics, lambda p: combine([read_metrics(p)]),
         form="json"),
    Kind("assistance", "labels/large_room/6k/sfm/assistance.json", write_assistance,
         lambda p: assistance_record(p.parents[4], "large_room", "6k", "sfm"), finite_numbers,
         "json"),
    Kind("profile", "mine.yaml", copied("config.yaml"), load_config,
         lambda config: isinstance(config, Config), n_flips=60),
    Kind("experiments", "mine.csv", copied("experiments-smoke.csv"), read_design, is_design, ","),
)
# fmt: on
