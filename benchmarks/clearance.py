"""Effect of a least clearance of cameras: how near they come, and how much there is to see.

    python -m benchmarks.clearance results/benchmarks/clearance.csv --profile night --every 50

plans the smallest training set of each room of a profile with several clearances, in the meshes of
its results, and counts SIFT features in one of every so many frames.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
import pycolmap
from PIL import Image

from baselines.labels.sfm.features import extract_features
from reproduction.config.load import load_config
from reproduction.config.profile import Config
from synfeal.dataset.pose_table import PoseTable
from synfeal.effects.scene import open_scene
from synfeal.mesh.clearance import Clearance
from synfeal.mesh.triangles import load_collision_mesh
from synfeal.planning.plan import plan_mesh
from synfeal.records.provenance import generator_of
from synfeal.records.tables import write_frame

CLEARANCES_M = (0.0, 0.1, 0.2, 0.3)
NEAR_M = (0.05, 0.1, 0.2)
FEW = 60


def count_features(mesh: Path, plan: PoseTable, config: Config, every: int) -> np.ndarray:
    """Draw some views of a plan, and count the SIFT features of each.

    Args:
        mesh: Textured mesh of the room.
        plan: Poses.
        config: Profile, for the camera and the settings of features.
        every: Draw the first of each so many poses.

    Returns:
        Number of features of each view (N,).
    """
    camera = config.estimation_camera
    sfm = config.estimation.sfm.model_copy(update={"few_features": 0})
    with TemporaryDirectory() as temporary:
        images, database = Path(temporary, "images"), Path(temporary, "database.db")
        images.mkdir()
        with open_scene(mesh, camera, config.render) as renderer:
            for number, pose in enumerate(plan.world_from_cam[::every]):
                Image.fromarray(renderer.render(pose)).save(images / f"{number:06d}.png")
        extract_features(images, database, camera, sfm)
        with pycolmap.Database.open(database) as opened:
            ids = [image.image_id for image in opened.read_all_images()]
            return np.array([opened.num_keypoints_for_image(number) for number in ids])


def main() -> None:
    """Plan with every clearance and write a row for each."""
    pycolmap.logging.minloglevel = pycolmap.logging.Level.WARNING.value
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("--profile", default="night")
    parser.add_argument("--results", type=Path, default=Path("results"))
    parser.add_argument("--scenes", nargs="+", default=["large_room", "sanctuary"])
    parser.add_argument("--every", type=int, default=50)
    args = parser.parse_args()
    config = load_config(Path("config/config.yaml"), Path(f"config/{args.profile}.yaml"))
    rows = []
    for name in args.scenes:
        folder = args.results / args.profile / "scenes" / name
        collision = load_collision_mesh(folder / "collision.ply")
        near = [Clearance(*collision, limit_m) for limit_m in NEAR_M]
        for clearance_m in CLEARANCES_M:
            scene = config.scenes[name].model_copy(update={"min_clearance_m": clearance_m})
            count = config.n_frames(name, "6k", "train")
            began, rng = time.process_time(), generator_of(config.seed, "plan", name, "train")
            plan = plan_mesh(collision, name, scene, config.collection, count, rng, "train")
            row = {"scene": name, "min_clearance_m": clearance_m, "frames": count}
            row |= {"plan_s": time.process_time() - began, "paths": len(set(plan.path.tolist()))}
            for limit_m, checked in zip(NEAR_M, near, strict=True):
                closer = 1 - checked.keeps(plan.position_m).mean()
                row[f"share_within_{100 * limit_m:.0f}cm"] = closer
            features = count_features(folder / "mesh.glb", plan, config, args.every)
            row["frames_looked_at"] = len(features)
            row["median_features"] = np.median(features)
            row["share_with_few_features"] = np.mean(features < FEW)
            rows.append(row)
            write_frame(args.table, pd.DataFrame(rows), "%.4g")
            print(row, flush=True)


if __name__ == "__main__":
    main()
