"""Every kind of file a stage reads: a sound one, its reader, and what the reader promises."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Callable
from collections.abc import Sequence as Sequence_
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image

from baselines.groundtruth.images import read_image
from baselines.groundtruth.posegraph.graph import (
    Edge,
    PoseGraph,
    check_connected,
    read_g2o,
    write_g2o,
)
from baselines.groundtruth.sfm.images import link_images
from baselines.groundtruth.trajectory import BatchTrajectory, read_trajectory, write_trajectory
from baselines.localizers.backbones.weights import load_backbone_weights
from baselines.localizers.registry import build_localizer
from baselines.training.checkpoint import read_checkpoint, save_checkpoint
from baselines.training.data import ImageStatistics, read_images
from baselines.training.description import ModelDescription
from baselines.training.score import score_run
from synfeal.camera.calibration_files import read_calibration
from synfeal.config.models import CameraConfig, LocalizerConfig, NetworkConfig, RenderConfig
from synfeal.dataset.manifest import verify_manifest, write_manifest
from synfeal.dataset.packed import join_packed, pack_frames, read_packed
from synfeal.dataset.packed_record import write_packed_record
from synfeal.dataset.pose_table import PoseTable, read_pose_table, write_pose_table
from synfeal.dataset.sequences import Sequence
from synfeal.dataset.sevenscenes import pose_text, read_depth_m, read_pose, read_split, write_splits
from synfeal.files import write_json
from synfeal.mesh.load import load_mesh
from synfeal.mesh.save import save_glb
from synfeal.mesh.triangles import Triangles, load_collision_mesh, save_collision_mesh
from synfeal.planning.repeat import read_poses
from synfeal.report.assistance import assistance_record
from synfeal.report.stats import combine, read_metrics
from synfeal.report.tables import Value, write_rows
from synfeal.validation.camera import camera_of_dataset
from synfeal.validation.images import read_color, read_depth_mm
from synfeal.validation.run import validate
from tests.mesh_samples import UV, box_mesh, store_gltf, textured, triangle_gltf, write_obj
from tests.planar_scene import straight_path

CAMERA = CameraConfig(width=24, height=18)
N = 6


@dataclass(frozen=True)
class Kind:
    """A kind of file.

    Attributes:
        name: of the kind.
        make: writes a sound file, and what has to lie around it, into a folder; returns its path.
        read: what a stage does with the path.
        is_valid: whether a value keeps what the reader promises.
        form: separator of a table's cells, ``json``, or empty for what is binary.
        n_flips: bytes changed at random, in the head of the file and again anywhere.
    """

    name: str
    make: Callable[[Path], Path]
    read: Callable[[Path], object]
    is_valid: Callable[[Any], bool] = lambda value: True
    form: str = ""
    n_flips: int = 12


def poses() -> PoseTable:
    return straight_path(N, 0.1, 3.0)


def is_rigid(pose: np.ndarray) -> bool:
    turned = pose[..., :3, :3] @ np.swapaxes(pose[..., :3, :3], -1, -2)
    return bool(np.isfinite(pose).all() and np.allclose(turned, np.eye(3), atol=1e-6))


def is_pose_table(table: PoseTable) -> bool:
    whole = (table.frame >= 0).all() and (table.path >= 0).all()
    return bool(whole and (np.abs(table.frame) < 1e12).all() and is_rigid(table.world_from_cam))


def finite_numbers(value: Any) -> bool:
    """No text where numbers are, and all of them finite."""
    if isinstance(value, dict):
        return all(map(finite_numbers, value.values()))
    if isinstance(value, list | tuple):
        return all(map(finite_numbers, value))
    return not isinstance(value, float) or math.isfinite(value)


def _table(folder: Path, name: str = "train.csv") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    write_pose_table(folder / name, poses())
    return folder / name


def _tum(folder: Path) -> Path:
    lines = [f"{i} 0.1 0.2 {i} 0 0 0 1\n" for i in range(N)]
    (folder / "poses.txt").write_text("# timestamp tx ty tz qx qy qz qw\n" + "".join(lines))
    return folder / "poses.txt"


def _trajectory(folder: Path) -> Path:
    write_trajectory(folder / "b.csv", BatchTrajectory(poses().world_from_cam, np.ones(N, bool)))
    return folder / "b.csv"


def _g2o(folder: Path) -> Path:
    pose = poses().world_from_cam
    edges = [Edge(i, i + 1, pose[0], np.eye(6)) for i in range(N - 1)]
    write_g2o(folder / "batch.g2o", PoseGraph(pose, tuple(edges)))
    return folder / "batch.g2o"


def is_graph(graph: PoseGraph) -> bool:
    check_connected(graph)
    return is_rigid(graph.first_from_cam) and all(is_rigid(e.i_from_j) for e in graph.edges)


def _color(folder: Path) -> Path:
    rgb = np.random.default_rng(1).integers(0, 256, (18, 24, 3), dtype=np.uint8)
    Image.fromarray(rgb).save(folder / "frame-000000.color.png")
    return folder / "frame-000000.color.png"


def _depth(folder: Path) -> Path:
    mm = np.random.default_rng(2).integers(500, 4000, (18, 24)).astype(np.uint16)
    Image.fromarray(mm).save(folder / "frame-000000.depth.png")
    return folder / "frame-000000.depth.png"


def _pose(folder: Path) -> Path:
    (folder / "frame-000000.pose.txt").write_text(pose_text(poses().world_from_cam[0]))
    return folder / "frame-000000.pose.txt"


def _read_rgbd(path: Path) -> object:
    return read_image(path, CAMERA, "RGB")


def _link(path: Path) -> None:
    images = path.parent / "images"
    try:
        link_images([path], CAMERA, images)
    finally:
        shutil.rmtree(images, ignore_errors=True)


def _pack(path: Path) -> np.ndarray:
    out = path.parent / "packed.npy"
    try:
        pack_frames([path.parent], 8, out)
        return np.load(out)
    finally:
        out.unlink(missing_ok=True)


def _data_set(folder: Path) -> Path:
    sequences = [Sequence("seq-01", "train", 0, 2), Sequence("seq-02", "test", 0, 2)]
    for place, sequence in enumerate(sequences):
        directory = folder / sequence.name
        directory.mkdir()
        for frame, pose in enumerate(straight_path(4, 0.1, 3.0).world_from_cam[2 * place :][:2]):
            shutil.copy(_color(folder), directory / f"frame-{frame:06d}.color.png")
            (directory / f"frame-{frame:06d}.pose.txt").write_text(pose_text(pose))
    _color(folder).unlink()
    write_splits(folder, sequences)
    write_manifest(folder, sequences, CAMERA, {})
    return folder / "manifest.json"


def _split_of_set(folder: Path) -> Path:
    return _data_set(folder).with_name("TrainSplit.txt")


def _pose_of_set(folder: Path) -> Path:
    return _data_set(folder).parent / "seq-01/frame-000000.pose.txt"


def _split(folder: Path) -> Path:
    (folder / "TrainSplit.txt").write_text("sequence1\nsequence2\n")
    return folder / "TrainSplit.txt"


def _packed(folder: Path) -> Path:
    frames = np.random.default_rng(3).integers(0, 256, (N, 8, 8, 3), dtype=np.uint8)
    np.save(folder / "train.npy", frames)
    return folder / "train.npy"


def is_packed(frames: np.ndarray) -> bool:
    return frames.dtype == np.uint8 and frames.ndim == 4 and int(frames.sum()) >= 0


def _record(folder: Path) -> Path:
    _packed(folder)
    _table(folder)
    write_json(folder / "seq-01.json", {"frames": N, "backend": "raycast"})
    return folder / "seq-01.json"


def _write_record(path: Path) -> object:
    frames, plan = path.with_name("train.npy"), path.with_name("train.csv")
    try:
        write_packed_record(frames, [path], plan, CAMERA, RenderConfig())
        return json.loads(frames.with_suffix(".json").read_text())["shards"][0]
    finally:
        frames.with_suffix(".json").unlink(missing_ok=True)


def _opencv(folder: Path) -> Path:
    matrix = "rows: 3\n   cols: 3\n   data: [500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0]"
    (folder / "camera.yaml").write_text(
        "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n"
        f"camera_matrix: !!opencv-matrix\n   {matrix}\n"
        "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n"
        "   data: [0.1, -0.05, 0.001, 0.001, 0.0]\n"
    )
    return folder / "camera.yaml"


def _json_camera(folder: Path) -> Path:
    k = [[500.0, 0, 320.0], [0, 500.0, 240.0], [0, 0, 1]]
    write_json(
        folder / "camera.json", {"K": k, "dist": [0.1, 0, 0, 0, 0], "image_size": [640, 480]}
    )
    return folder / "camera.json"


def _colmap(folder: Path) -> Path:
    text = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS\n1 OPENCV 640 480 500 500 320 240 0.1 0 0 0\n"
    (folder / "cameras.txt").write_text(text)
    return folder / "cameras.txt"


def is_camera(calibration: Any) -> bool:
    values = (calibration.fx, calibration.fy, *calibration.distortion)
    return calibration.fx > 0 and calibration.fy > 0 and all(map(math.isfinite, values))


def _glb(folder: Path) -> Path:
    save_glb(folder / "scene.glb", box_mesh())
    return folder / "scene.glb"


def _gltf(folder: Path) -> Path:
    Image.new("RGB", (4, 4), (9, 99, 199)).save(folder / "wall.png")
    return store_gltf(folder, *triangle_gltf(textured(), ["wall.png"]))


def _obj(folder: Path) -> Path:
    Image.new("RGB", (4, 4), (9, 99, 199)).save(folder / "wall.png")
    return write_obj(folder)


def _ply(folder: Path) -> Path:
    rows = [f"{x} {y} {x * y} {60 * x} 9 99" for x, y in np.round(4 * UV, 2)]
    names = "".join(f"property float {a}\n" for a in "xyz")
    names += "".join(f"property uchar {c}\n" for c in ("red", "green", "blue"))
    head = f"ply\nformat ascii 1.0\nelement vertex 3\n{names}element face 1\n"
    head += "property list uchar int vertex_indices\nend_header\n"
    (folder / "scene.ply").write_text(head + "\n".join(rows) + "\n3 0 1 2\n")
    return folder / "scene.ply"


def is_mesh(mesh: Any) -> bool:
    return bool(mesh.parts) and all(
        is_triangles(Triangles(p.vertices_m, p.faces)) for p in mesh.parts
    )


def _collision(folder: Path) -> Path:
    (part,) = box_mesh().parts
    save_collision_mesh(folder / "collision.ply", Triangles(part.vertices_m, part.faces))
    return folder / "collision.ply"


def is_triangles(mesh: Triangles) -> bool:
    in_range = mesh.faces.min() >= 0 and mesh.faces.max() < len(mesh.vertices_m)
    return bool(len(mesh.faces) and in_range and np.isfinite(mesh.vertices_m).all())


def _network() -> torch.nn.Module:
    return torch.nn.Linear(3, 2)


def _checkpoint(folder: Path) -> Path:
    statistics = ImageStatistics(torch.zeros(1, 3, 1, 1), torch.ones(1, 3, 1, 1))
    network, hyper = NetworkConfig(input_px=32, width=0.01), LocalizerConfig()
    localizer = build_localizer("posenet2", network, hyper)
    description = ModelDescription(localizer="posenet2", network=network, hyper=hyper)
    save_checkpoint(folder / "model.pt", localizer, statistics, description)
    return folder / "model.pt"


def _read_checkpoint(path: Path) -> ImageStatistics:
    return read_checkpoint(path, torch.device("cpu")).statistics


def is_statistics(found: ImageStatistics) -> bool:
    shapes = found.mean.shape == found.deviation.shape == (1, 3, 1, 1)
    return bool(shapes and found.mean.isfinite().all() and (found.deviation > 0).all())


def _weights(folder: Path) -> Path:
    torch.save(dict(_network().state_dict()), folder / "googlenet.pt")
    return folder / "googlenet.pt"


def _predictions(folder: Path) -> Path:
    return _table(folder, "predictions.csv")


def _score(path: Path) -> object:
    outputs = path.with_name("e.csv"), path.with_name("m.json")
    try:
        score_run(path, *3 * [_table(path.parents[1] / "labels")], *outputs, {})
        return json.loads(outputs[1].read_text())
    finally:
        for output in outputs:
            output.unlink(missing_ok=True)


def _metrics(folder: Path) -> Path:
    labels = _table(folder, "labels.csv")
    score_run(labels, labels, labels, labels, folder / "errors.csv", folder / "metrics.json", {})
    return folder / "metrics.json"


def _labels_estimated(folder: Path) -> Path:
    record = {
        **{"index": 0, "start": 0, "stop": 4, "registered": 4, "filled": 0},
        **{"lost": False, "assisted": True, "error_before_m": 0.3, "error_before_deg": 1.0},
        **{"error_after_m": 0.0, "error_after_deg": 0.0},
    }
    splits = {split: {"records": [record]} for split in ("train", "test")}
    path = folder / "labels/large_room/6k/sfm/assistance.json"
    write_json(path, {"method": "sfm", "splits": splits})
    for split in splits:
        facts = folder / f"groundtruth/large_room/6k/sfm/{split}/batch-000.json"
        write_json(facts, {"mapping_s": 1.5, "peak_memory_mb": 99.0})
    return path


def table_of(name: str, columns: Sequence_[str], **cells: Value) -> Callable[[Path], Path]:
    """A table of two like rows: 1 but for ``cells``."""

    def make(folder: Path) -> Path:
        path = folder / "tables" / f"{name}.csv"
        write_rows(path, columns, 2 * [dict.fromkeys(columns, 1.0) | cells])
        return path

    return make


def _material(folder: Path) -> Path:
    return _obj(folder).with_suffix(".mtl")


def _texture(folder: Path) -> Path:
    return _obj(folder).with_name("wall.png")


ROOM = ("sfm", "large_room", "6k")

KINDS: tuple[Kind, ...] = (
    Kind("pose table", _table, read_pose_table, is_pose_table, ","),
    Kind("poses to repeat", _table, lambda p: read_poses(p, "train"), is_pose_table, ","),
    Kind("TUM trajectory", _tum, lambda p: read_poses(p, "train"), is_pose_table, " "),
    Kind(
        "batch trajectory", _trajectory, read_trajectory, lambda t: is_rigid(t.first_from_cam), ","
    ),
    Kind("pose graph", _g2o, read_g2o, is_graph, " "),
    Kind("pose", _pose, read_pose, lambda p: bool(np.isfinite(p).all()), "\t"),
    Kind("pose to repeat", _pose, lambda p: read_poses(p.parent, "train"), is_pose_table, "\t"),
    Kind("split", _split, lambda p: read_split(p.parent, "train"), form="e"),
    Kind("colour image", _color, read_color, lambda rgb: rgb.ndim == 3),
    Kind("colour image, packed", _color, _pack, is_packed),
    Kind("colour image, SfM", _color, _link),
    Kind("colour image, odometry", _color, _read_rgbd, lambda rgb: rgb.shape == (18, 24, 3)),
    Kind("depth image", _depth, read_depth_mm, lambda mm: mm.dtype == np.uint16),
    Kind("depth image, metres", _depth, read_depth_m, lambda m: bool((m >= 0).all())),
    Kind("packed frames", _packed, read_packed, is_packed, n_flips=60),
    Kind("packed frames, joined", _packed, lambda p: join_packed([p], p.with_name("all.npy"))),
    Kind("packed frames, training", _packed, lambda p: read_images(p, N, 8, torch.device("cpu"))),
    Kind("record of packed frames", _record, _write_record, finite_numbers, "json"),
    Kind("manifest, hashes", _data_set, lambda p: verify_manifest(p.parent), form="json"),
    Kind("manifest, camera", _data_set, lambda p: camera_of_dataset(p.parent, None), form="json"),
    Kind("manifest, validated", _data_set, lambda p: validate(p.parent, None, False), n_flips=6),
    Kind("split, validated", _split_of_set, lambda p: validate(p.parent, None, False), n_flips=6),
    Kind("pose, validated", _pose_of_set, lambda p: validate(p.parents[1], None, False), n_flips=6),
    Kind("calibration of OpenCV", _opencv, read_calibration, is_camera, " "),
    Kind("calibration as JSON", _json_camera, read_calibration, is_camera, "json"),
    Kind("calibration of COLMAP", _colmap, read_calibration, is_camera, " "),
    Kind("GLB", _glb, load_mesh, is_mesh, n_flips=60),
    Kind("glTF", _gltf, load_mesh, is_mesh, "json"),
    Kind("OBJ", _obj, load_mesh, is_mesh, " "),
    Kind("PLY", _ply, load_mesh, is_mesh, " "),
    Kind("material", _material, lambda p: load_mesh(p.with_suffix(".obj")), is_mesh, " "),
    Kind("texture", _texture, lambda p: load_mesh(p.with_name("scene.obj")), is_mesh),
    Kind("collision mesh", _collision, load_collision_mesh, is_triangles, n_flips=60),
    Kind("checkpoint", _checkpoint, _read_checkpoint, is_statistics, n_flips=40),
    Kind("backbone", _weights, lambda p: load_backbone_weights(_network(), p), n_flips=40),
    Kind("predictions", _predictions, _score, finite_numbers, ","),
    Kind("metrics", _metrics, lambda p: combine([read_metrics(p)]), form="json"),
    Kind(
        "assistance",
        _labels_estimated,
        lambda p: assistance_record(p.parents[4], *ROOM),
        finite_numbers,
        "json",
    ),
)
