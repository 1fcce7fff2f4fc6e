"""A data set in closed form, and the errors a data set can hide: each changes a copy of it."""

import itertools
import json
import shutil

import numpy as np
from PIL import Image

from synfeal.config.dataset import CameraConfig
from synfeal.dataset.finish import write_manifest
from synfeal.dataset.pose_table import write_pose_table
from synfeal.dataset.sevenscenes import Sequence, write_splits
from tests.support.room_scene import straight_path, write_planes

CAMERA = CameraConfig(width=96, height=72, horizontal_fov_deg=60.0)


def write_planar_set(folder, camera=CAMERA, counts=(24, 8)):
    """Training and test frames of two planes, as ``synfeal collect`` lays them out."""
    sequences = [
        Sequence(f"seq-{number:02d}", split, 0, count)
        for number, split, count in zip((1, 2), ("train", "test"), counts, strict=True)
    ]
    for sequence, step_m, turn_deg in zip(sequences, (0.04, 0.05), (1.5, 2.0), strict=True):
        directory = folder / sequence.name
        directory.mkdir(parents=True, exist_ok=True)
        truth = straight_path(len(sequence), step_m, turn_deg)
        write_planes(directory, truth, camera)
        for number, pose in enumerate(truth.world_from_cam):
            write_pose(directory / f"frame-{number:06d}.pose.txt", pose)
        write_pose_table(folder / f"{sequence.split}.csv", truth)
    write_splits(folder, sequences)
    write_manifest(folder, sequences, camera, {})


def write_pose(path, world_from_cam):
    np.savetxt(path, world_from_cam, fmt="%.10e", delimiter="\t")


def copy_of_first_frames(folder, out, kept=(5, 3)):
    """A data set of few frames, which can be damaged and checked quickly."""
    shutil.copytree(folder, out)
    for sequence, count in zip(("seq-01", "seq-02"), kept, strict=True):
        for path in (out / sequence).iterdir():
            if int(path.name[6:12]) >= count:
                path.unlink()
    return out


def without_manifest_hashes(folder):
    """Leave the camera, so that only geometry can tell what was changed."""
    path = folder / "manifest.json"
    path.write_text(json.dumps({"camera": json.loads(path.read_text())["camera"]}))
    for name in ("train.csv", "test.csv"):
        (folder / name).unlink(missing_ok=True)


def frame_files(folder, kind, sequence="seq-01"):
    return sorted((folder / sequence).glob(f"frame-*.{kind}"))


def pose_of_the_neighbour(folder):
    poses = frame_files(folder, "pose.txt")
    middle = len(poses) // 2
    shutil.copy(poses[middle + 1], poses[middle])


def poses_shifted_by_one(folder):
    """Each frame has the pose of the next one; the last frame goes."""
    poses = frame_files(folder, "pose.txt")
    for pose, following in itertools.pairwise(poses):
        shutil.copy(following, pose)
    for kind in ("color.png", "depth.png", "pose.txt"):
        frame_files(folder, kind)[-1].unlink()


def transposed_rotations(folder):
    for path in folder.glob("seq-*/*.pose.txt"):
        pose = np.loadtxt(path)
        pose[:3, :3] = pose[:3, :3].T
        write_pose(path, pose)


def half_pixel(folder):
    """The camera of OpenCV's convention, whose first pixel is centred at (0, 0)."""
    path = folder / "manifest.json"
    manifest = json.loads(path.read_text())
    manifest["camera"]["cx"] -= 0.5
    manifest["camera"]["cy"] -= 0.5
    path.write_text(json.dumps(manifest))


def _change_depth(folder, change):
    for path in folder.glob("seq-*/*.depth.png"):
        depth = np.asarray(Image.open(path)).astype(np.float64)
        changed = np.where(depth == 65535, 65535, change(depth).round().clip(0, 65535))
        Image.fromarray(changed.astype(np.uint16)).save(path)


def depth_of_tum(folder):
    """5,000 units to the metre."""
    _change_depth(folder, lambda depth: 5.0 * depth)


def depth_in_centimetres(folder):
    _change_depth(folder, lambda depth: depth / 10.0)


def depth_in_metres(folder):
    _change_depth(folder, lambda depth: depth / 1000.0)


def depth_along_the_ray(folder):
    camera = json.loads((folder / "manifest.json").read_text())["camera"]
    row, column = np.mgrid[: camera["height"], : camera["width"]] + 0.5
    x = (column - camera["cx"]) / camera["fx"]
    y = (row - camera["cy"]) / camera["fy"]
    _change_depth(folder, lambda depth: depth * np.sqrt(1.0 + x**2 + y**2))


def _swap_middle(folder, *kinds):
    for kind in kinds:
        files = frame_files(folder, kind)
        middle = len(files) // 2
        first, second = files[middle].read_bytes(), files[middle + 1].read_bytes()
        files[middle].write_bytes(second)
        files[middle + 1].write_bytes(first)


def swapped_colors(folder):
    _swap_middle(folder, "color.png")


def swapped_depths(folder):
    _swap_middle(folder, "depth.png")


def swapped_frames(folder):
    _swap_middle(folder, "color.png", "depth.png")


# What each error must be found by; other checks may fail too.
FOUND_BY = {
    pose_of_the_neighbour: "depth",
    poses_shifted_by_one: "depth",
    transposed_rotations: "depth",
    half_pixel: "camera",
    depth_of_tum: "depth",
    depth_in_centimetres: "depth",
    depth_in_metres: "pairs",
    depth_along_the_ray: "depth",
    swapped_colors: "colours",
    swapped_depths: "depth",
}
