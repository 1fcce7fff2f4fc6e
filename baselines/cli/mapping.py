"""The command ``synfeal map``, and ``synfeal localize`` with what it writes."""

from __future__ import annotations

import argparse
import logging
from pathlib import Path
from typing import TYPE_CHECKING

from baselines.cli.training import photograph_camera
from synfeal.cli.meshes import RGBD_OPTIONS
from synfeal.cli.options import command, option
from synfeal.errors import InputError

if TYPE_CHECKING:
    from baselines.references.localized import LocalizedInMap
    from synfeal.scanning.camera import CameraOptions


# Beyond, a focal length is not that of the camera: tolerances of lenses are a third of it.
WRONG_FOCAL = 0.03

log = logging.getLogger("synfeal")


@command(
    "build a map of a place, to localize photographs without training",
    "synfeal map mydata --out mymap",
    option(
        "dataset",
        "data set of collect --depth, or posed photographs with depth (flat folder, seq-XX,"
        " TUM RGB-D)",
        type=Path,
        metavar="DATASET",
    ),
    option("--out", "folder to write", type=Path, required=True, metavar="DIR"),
    option(
        "--frames",
        "range of frames to take, from 0, STOP exclusive (all)",
        type=int,
        nargs=2,
        metavar=("START", "STOP"),
    ),
    option("--every", "take every K-th frame (1)", type=int, default=1, metavar="K"),
    option(
        "--most",
        "largest number of frames; if there are more, N of them, spread evenly (1000)",
        type=int,
        default=1000,
        metavar="N",
    ),
    *RGBD_OPTIONS,
    option("--seed", "seed of the vocabulary that retrieval learns (0)", type=int, default=0),
)
def map(arguments: argparse.Namespace) -> None:  # noqa: A001 (the name of the command)
    """Build a map of image features, placed in space by depth, from renderings or photographs."""
    from baselines.references.localized import describe_map
    from baselines.references.map_frames import FrameChoice, read_map_frames
    from baselines.references.mapped import build_map

    if not 0 <= arguments.seed < 2**63:
        raise InputError(f"--seed: must be 0 to 2^63 - 1, found {arguments.seed}")
    start, stop = arguments.frames or (0, None)
    choice = FrameChoice(start, stop, every=arguments.every, most=arguments.most)
    frames = read_map_frames(
        folder=arguments.dataset,
        choice=choice,
        cameras=camera_options(arguments),
        poses_are=arguments.poses_are or "world_from_cam",
    )
    made = build_map(frames, arguments.out, arguments.seed)
    print(f"{arguments.out}: {describe_map(made)}, {made.record['seconds']:.0f} s")
    print(f"synfeal localize {arguments.out} photos/ --out poses.csv")


def camera_options(arguments: argparse.Namespace) -> CameraOptions:
    """Read the options of colour and depth camera, :data:`RGBD_OPTIONS`."""
    from synfeal.scanning.camera import CameraOptions

    aside = arguments.depth_from_color
    return CameraOptions(
        preset=arguments.preset,
        color_camera=arguments.color_camera,
        depth_camera=arguments.depth_camera,
        color_focal_px=arguments.color_focal,
        depth_focal_px=arguments.depth_focal,
        depth_from_color=None if aside is None else tuple(aside),
        depth_units_per_m=arguments.depth_scale,
    )


MAP_OPTIONS = (
    option(
        "--confidence",
        "with a map: leave out poses below this confidence, as not localized (0.99)",
        type=float,
        metavar="C",
    ),
    option(
        "--refine",
        "of a map: draw the mesh that it shows from each pose found and match that too, which makes"
        " poses more exact",
        type=Path,
        metavar="MESH",
    ),
)


def localize_by_map(arguments: argparse.Namespace) -> None:
    """Carry out ``synfeal localize`` with a map."""
    from baselines.references.confidence import LEAST_CONFIDENCE
    from baselines.references.localized import localize_in_map

    out: Path = arguments.out
    confidence = arguments.confidence
    done = localize_in_map(
        arguments.model,
        arguments.images,
        out,
        camera=photograph_camera(arguments),
        world=arguments.world,
        least_confidence=LEAST_CONFIDENCE if confidence is None else confidence,
        refine=arguments.refine,
    )
    if abs(done.focal_ratio - 1.0) > WRONG_FOCAL:  # not of NaN
        log.warning(
            "the photographs fit best with %.3f times the focal length given; is it that of their"
            " camera? poses are off by about as large a share of the distance to what is seen",
            done.focal_ratio,
        )
    if done.n_ambiguous:
        log.warning(
            "%d of %d photographs are ambiguous: another place of the map looks like what they"
            " show, so they get no pose; take photographs that show more, or something unique",
            done.n_ambiguous,
            done.n_images,
        )
    if done.n_found == 0 and not done.n_ambiguous:
        log.warning("is it another place, or is the focal length of the photographs wrong?")
    print(f"{arguments.model}: {done.n_frames} frames, {done.n_points} features")
    print(f"{out}: {found_text(done)}")


def found_text(done: LocalizedInMap) -> str:
    """Summarise in a line how many photographs were localized, in which world, how fast."""
    lost = done.n_images - done.n_found
    world = {"sequence": " in the world of the sequence", "mesh": " in the world of the mesh"}
    where = world[done.world] if done.world else ""
    counted = f"{done.n_found} of {done.n_images} photographs localized{where}, {lost} not"
    support = f" by {done.inliers:.0f} inliers (median)" if done.n_found else ""
    return f"{counted}{support}; {done.seconds:.2f} s a photograph (median)"
