"""Draw where an estimated batch goes wrong: what there was to see, and the errors.

    python -m benchmarks.batch_trace results/benchmarks/sfm_trace --scene large_room --batch 18 \
        --trajectory before=before.csv --trajectory after=after.csv

writes ``<stem>.csv`` and ``<stem>.png``: frame by frame the distance to the nearest surface, the
number of features, usual and weak, and of each of some trajectories whether it has the frame, and
how far off it is there.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
import pycolmap
from matplotlib.figure import Figure

from baselines.labels.batches import link_images, read_trajectory
from baselines.labels.sfm.features import extract_features
from benchmarks.label_batches import Files, errors_of, frames_of
from reproduction.config.load import load_config
from reproduction.config.profile import Config
from synfeal.mesh.clearance import cut_to_size, point_triangle_distances
from synfeal.mesh.triangles import load_collision_mesh
from synfeal.records.tables import write_frame

PIECE_M = 1.0


def features_of(color: Files, config: Config) -> tuple[np.ndarray, np.ndarray]:
    """Return how many usual features each image has, and how many it is given in the end."""
    counts = []
    for few in (0, config.estimation.sfm.few_features):
        with TemporaryDirectory() as temporary:
            images, database = Path(temporary, "images"), Path(temporary, "database.db")
            link_images(color, config.estimation_camera, images)
            sfm = config.estimation.sfm.model_copy(update={"few_features": few})
            extract_features(images, database, config.estimation_camera, sfm)
            with pycolmap.Database.open(database) as opened:
                found = sorted(opened.read_all_images(), key=lambda image: image.name)
                ids = [image.image_id for image in found]
                counts.append(np.array([opened.num_keypoints_for_image(i) for i in ids]))
    return counts[0], counts[1]


def nearest_surface_m(points_m: np.ndarray, collision: Path) -> np.ndarray:
    """Return the distance of each point (N, 3) to the nearest triangle of a mesh, (N,)."""
    mesh = load_collision_mesh(collision)
    pieces = cut_to_size(mesh.vertices_m[mesh.faces], PIECE_M)
    nearest_m = np.full(len(points_m), np.inf)
    for row, point in enumerate(points_m):
        there = np.tile(point, (len(pieces), 1))
        nearest_m[row] = point_triangle_distances(there, pieces).min()
    return nearest_m


def draw(trace: pd.DataFrame, names: list[str], title: str) -> Figure:
    """Draw distance, features, errors and registered frames below each other.

    Args:
        trace: A row per frame, with the columns of the CSV.
        names: Names of the trajectories, each with columns ``registered_<name>`` and
            ``error_<name>_m``.
        title: Title of the figure.
    """
    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    figure.suptitle(title)
    heights = [2, 2, 2, 0.4 * len(names)]
    near, seen, off, found = figure.subplots(4, 1, sharex=True, height_ratios=heights)
    near.plot(trace.frame, 100 * trace.nearest_surface_m, color="0.2")
    near.set_ylabel("nearest surface (cm)")
    near.set_ylim(bottom=0)
    seen.plot(trace.frame, trace.features, label="usual contrast")
    seen.plot(trace.frame, trace.features_in_the_end, "--", label="with weak ones")
    seen.set_yscale("symlog", linthresh=10)
    seen.set_ylim(0, 2 * trace.features_in_the_end.max())
    seen.set_ylabel("features")
    seen.legend(loc="lower left")
    for name in names:
        off.plot(trace.frame, 100 * trace[f"error_{name}_m"], label=name)
    off.set_yscale("symlog", linthresh=1)
    off.set_ylim(bottom=0)
    off.set_ylabel("position error (cm)")
    off.legend(loc="lower right", ncols=len(names))
    for row, name in enumerate(names):
        there = trace[f"registered_{name}"].to_numpy() == 1
        found.fill_between(trace.frame, row + 0.1, row + 0.9, where=there, step="mid")
    found.set_yticks([row + 0.5 for row in range(len(names))], names)
    found.set_xlabel("frame of the batch (filled: registered)")
    found.set_xlim(0, len(trace) - 1)
    return figure


def main() -> None:
    """Trace the batch that the command line names."""
    pycolmap.logging.minloglevel = pycolmap.logging.Level.WARNING.value
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("stem", type=Path)
    parser.add_argument("--profile", default="night")
    parser.add_argument("--results", type=Path, default=Path("results"))
    parser.add_argument("--scene", required=True)
    parser.add_argument("--batch", type=int, required=True)
    parser.add_argument("--trajectory", action="append", default=[], help="NAME=FILE")
    args = parser.parse_args()
    config = load_config(Path("config/config.yaml"), Path(f"config/{args.profile}.yaml"))
    root = args.results / args.profile
    color, _, world_from_cam = frames_of(root, config, args.scene, args.batch)
    usual, in_the_end = features_of(color, config)
    collision = root / "scenes" / args.scene / "collision.ply"
    columns = {
        "frame": np.arange(len(color)),
        "nearest_surface_m": nearest_surface_m(world_from_cam[:, :3, 3], collision),
        "features": usual,
        "features_in_the_end": in_the_end,
    }
    names = []
    for given in args.trajectory:
        name, _, path = given.partition("=")
        names.append(name)
        trajectory = read_trajectory(Path(path))
        columns[f"registered_{name}"] = trajectory.registered.astype(int)
        columns[f"error_{name}_m"] = errors_of(trajectory, world_from_cam)[0]
    trace = pd.DataFrame(columns)
    write_frame(args.stem.with_suffix(".csv"), trace, "%.4g")
    draw(trace, names, f"{args.scene}, batch {args.batch}").savefig(
        args.stem.with_suffix(".png"), dpi=110
    )


if __name__ == "__main__":
    main()
