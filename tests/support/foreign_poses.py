"""Poses as other programs write them: by their own writers, or by the rules of their sources."""

import numpy as np
import pycolmap
from evo.core.trajectory import PosePath3D, PoseTrajectory3D
from evo.tools import file_interface
from scipy.spatial.transform import Rotation

from synfeal.dataset.pose_table import write_pose_table
from synfeal.dataset.sevenscenes import Sequence, pose_text, write_splits
from tests.support.property_support import random_table, table_of

PER_SEQUENCE, RATE_HZ = 12, 30.0
TEST = ("seq-02", "seq-03")


def disturbed(poses, position_m, angle_deg, seed=1):
    """Every pose off by random amounts of about this size."""
    rng = np.random.default_rng(seed)
    off = poses.copy()
    off[:, :3, 3] += position_m * rng.normal(size=(len(poses), 3))
    turn = Rotation.from_rotvec(np.radians(angle_deg) * rng.normal(size=(len(poses), 3)))
    off[:, :3, :3] = poses[:, :3, :3] @ turn.as_matrix()
    return off


def write_dataset(folder):
    """Three sequences without images, two of them for test; returns the test poses."""
    poses = random_table(3 * PER_SEQUENCE, 0).world_from_cam
    names = ("seq-01", *TEST)
    splits = ("train", "test", "test")
    for index, name in enumerate(names):
        (folder / name).mkdir(parents=True)
        for number in range(PER_SEQUENCE):
            path = folder / name / f"frame-{number:06d}.pose.txt"
            path.write_text(pose_text(poses[index * PER_SEQUENCE + number]))
    write_splits(
        folder, [Sequence(n, s, 0, PER_SEQUENCE) for n, s in zip(names, splits, strict=True)]
    )
    return poses[PER_SEQUENCE:]


def frame_names():
    """Sequence and number of the test frames, in order."""
    return [(name, number) for name in TEST for number in range(PER_SEQUENCE)]


def write_tum(folder, poses):
    """By evo's writer: a trajectory for each sequence."""
    folder.mkdir()
    for index, name in enumerate(TEST):
        part = poses[index * PER_SEQUENCE : (index + 1) * PER_SEQUENCE]
        stamps = np.arange(PER_SEQUENCE) / RATE_HZ
        trajectory = PoseTrajectory3D(poses_se3=list(part), timestamps=stamps)
        file_interface.write_tum_trajectory_file(folder / f"{name}.txt", trajectory)
    return folder


def write_colmap(folder, poses, binary):
    """By pycolmap's writer."""
    folder.mkdir()
    model = pycolmap.Reconstruction()
    camera = pycolmap.Camera.create_from_model_name(1, "PINHOLE", 500.0, 640, 480)
    model.add_camera_with_trivial_rig(camera)
    frames = zip(frame_names(), poses, strict=True)
    for image_id, ((sequence, number), pose) in enumerate(frames, start=1):
        name = f"{sequence}/frame-{number:06d}.color.png"
        image = pycolmap.Image(name=name, camera_id=1, image_id=image_id)
        cam_from_world = pycolmap.Rigid3d(np.linalg.inv(pose)[:3])
        model.add_image_with_trivial_frame(image, cam_from_world)
    (model.write_binary if binary else model.write_text)(folder)
    return folder


def _inverse_lines(poses):
    """``qw qx qy qz tx ty tz`` of ``cam_from_world``."""
    inverse = np.linalg.inv(poses)
    quat = Rotation.from_matrix(inverse[:, :3, :3]).as_quat(scalar_first=True)
    rows = np.concatenate([quat, inverse[:, :3, 3]], axis=1)
    return [" ".join(map(repr, row)) for row in rows.tolist()]


def _write_lines(path, poses, name, end=""):
    """A line for each test frame: the name of its image, its pose, and what follows."""
    lines = zip(frame_names(), _inverse_lines(poses), strict=True)
    path.write_text("".join(f"{name.format(*frame)} {line}{end}\n" for frame, line in lines))
    return path


def write_ace(path, poses):
    """ACE's rule (``test_ace.py``): image name, pose, rotation and position error, inliers."""
    return _write_lines(path, poses, "{}-frame-{:06d}.color.png", " 1.25 0.5 731")


def write_hloc(path, poses):
    """hloc's rule (``localize_sfm.main`` with ``prepend_camera_name``)."""
    return _write_lines(path, poses, "{}/frame-{:06d}.color.png")


def write_ace0(path, poses):
    """ACE0's rule (``write_pose_to_pose_file``): image, pose, focal length and confidence."""
    return _write_lines(path, poses, "data/{}/frame-{:06d}.color.png", " 525.5 6731.0")


def write_pgt(path, poses):
    """The rule of the pseudo ground truth: image name, pose, focal length."""
    return _write_lines(path, poses, "{}/frame-{:06d}.color.png", " 525.505")


def write_kitti(path, poses):
    """By evo's writer: a line for each frame of the split."""
    file_interface.write_kitti_poses_file(path, PosePath3D(poses_se3=list(poses)))
    return path


EUROC_HEADER = (
    "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [],"
    " q_RS_z [], v_RS_R_x [m s^-1]"
)


def write_euroc(path, poses, stamps_ns):
    """EuRoC's rule (``state_groundtruth_estimate0/data.csv``), with one column that is not read."""
    quat = Rotation.from_matrix(poses[:, :3, :3]).as_quat(scalar_first=True)
    rows = np.concatenate([poses[:, :3, 3], quat, np.zeros((len(poses), 1))], axis=1).tolist()
    lines = [
        f"{stamp},{','.join(map(repr, row))}" for stamp, row in zip(stamps_ns, rows, strict=True)
    ]
    path.write_text("\n".join([EUROC_HEADER, *lines]) + "\n")
    return path


def write_tree(folder, poses):
    for (sequence, number), pose in zip(frame_names(), poses, strict=True):
        (folder / sequence).mkdir(parents=True, exist_ok=True)
        (folder / sequence / f"frame-{number:06d}.pose.txt").write_text(pose_text(pose))
    return folder


def write_table(path, poses):
    write_pose_table(path, table_of(poses, path=np.arange(len(poses))))
    return path


def write_localized(path, poses):
    """Write as ``synfeal localize`` does."""
    quat = Rotation.from_matrix(poses[:, :3, :3]).as_quat(scalar_first=True)
    rows = np.concatenate([poses[:, :3, 3], quat], axis=1).tolist()
    lines = [
        f"set/{sequence}/frame-{number:06d}.color.png,{','.join(map(repr, row))}"
        for (sequence, number), row in zip(frame_names(), rows, strict=True)
    ]
    path.write_text("image,tx,ty,tz,qw,qx,qy,qz\n" + "".join(f"{line}\n" for line in lines))
    return path


WRITERS = {
    "7-Scenes": write_tree,
    "TUM": write_tum,
    "COLMAP text": lambda p, poses: write_colmap(p, poses, binary=False),
    "COLMAP binary": lambda p, poses: write_colmap(p, poses, binary=True),
    "hloc": write_hloc,
    "ACE": write_ace,
    "ACE0": write_ace0,
    "pseudo ground truth": write_pgt,
    "KITTI": write_kitti,
    "pose table": write_table,
    "synfeal localize": write_localized,
}
