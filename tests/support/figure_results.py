"""A small results tree whose poses, label errors and frames are known, for tests of the figures."""

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from baselines.config.learning import MODELS
from synfeal.dataset.pose_table import write_pose_table
from synfeal.geometry.poses import pose_matrix
from synfeal.mesh.triangles import Triangles, save_collision_mesh
from synfeal.records.files import write_json
from tests.support.property_support import table_of
from tests.support.report_results import TABLE4, batch_record, experiment, write_errors

METHODS = ("sfm", "rgbd-toro")
N_FRAMES = {("6k", "train"): 9, ("6k", "test"): 5, ("20k", "train"): 12, ("20k", "test"): 6}
N_TEST_FRAMES = 6
BATCHES = {"train": ((0, 5), (4, 9)), "test": ((0, 5),)}
LOOKS_ALONG_X = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])


def design():
    """Two sizes of one scene, and two ground-truth methods at the smaller one."""
    sizes = [experiment(TABLE4, size=size) for size in ("20k", "6k")]
    labelled = [experiment("table2_ground_truth", labels=method) for method in METHODS]
    return (*sizes, *labelled)


def true_poses(count, y=1.0):
    """Cameras on a line along x at height 1.5 m, all looking along x."""
    position = np.stack([np.linspace(0.5, 3.5, count), np.full(count, y), np.full(count, 1.5)])
    return pose_matrix(np.tile(LOOKS_ALONG_X, (count, 1, 1)), position.T)


def wrong_poses(count, step_m, step_deg):
    """The true poses, the k-th moved by k steps along y and turned by k steps about z."""
    poses, k = true_poses(count), np.arange(count)
    poses[:, 1, 3] += step_m * k
    turn = Rotation.from_euler("z", (step_deg * k)[:, None], degrees=True).as_matrix()
    poses[:, :3, :3] = turn @ poses[:, :3, :3]
    return poses


def room():
    """A room of 4 x 2 x 3 m, open to nothing, with a table top at 0.8 m."""
    shell = trimesh.creation.box(bounds=[[0, 0, 0], [4, 2, 3]])
    table = trimesh.creation.box(bounds=[[1, 0.5, 0.7], [2, 1.5, 0.8]])
    mesh = trimesh.util.concatenate([shell, table])
    return Triangles(np.asarray(mesh.vertices, float), np.asarray(mesh.faces, int))


def pixels(number):
    return np.full((8, 8, 3), 20 * number, np.uint8)


def fill_figures(root):
    """Labels, records of assistance, collision mesh, test frames and errors of :func:`design`."""
    for (size, split), count in N_FRAMES.items():
        truth = root / "labels" / "large_room" / size / "synfeal" / f"{split}.csv"
        write_pose_table(truth, table_of(true_poses(count, 1.0 if split == "train" else 1.2)))
    for k, method in enumerate(METHODS, start=1):
        _fill_method(root / "labels" / "large_room" / "6k" / method, k)
    save_collision_mesh(root / "scenes" / "large_room" / "collision.ply", room())
    (root / "frames" / "large_room").mkdir(parents=True)
    shown = [pixels(number) for number in range(N_TEST_FRAMES)]
    np.save(root / "frames" / "large_room" / "test.npy", np.stack(shown))
    errors = [[9, 9, 0.4, 30], [9, 9, 0.1, 10], [9, 9, 0.2, 20], [9, 9, np.inf, np.inf]]
    for model in MODELS:
        write_errors(root, design()[0], model, errors)
    return root


def _fill_method(folder, k):
    """Labels that are off by k cm and k degrees more with every frame; the last batch assisted."""
    splits = {}
    for split, batches in BATCHES.items():
        count = batches[-1][1]
        write_pose_table(folder / f"{split}.csv", table_of(wrong_poses(count, 0.01 * k, k)))
        splits[split] = {
            "records": [batch_record(0, (a, b) == batches[-1], start=a, stop=b) for a, b in batches]
        }
    write_json(folder / "assistance.json", {"method": "", "splits": splits})
