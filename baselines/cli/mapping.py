"""The command ``synfeal map``, and ``synfeal localize`` with what it writes."""

from __future__ import annotations

import argparse
import logging
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from baselines.cli.training import TURNED_TEXT
from synfeal.cli.meshes import RGBD_OPTIONS
from synfeal.cli.options import command, keywords, option

if TYPE_CHECKING:
    from baselines.references.localized import LocalizedInMap


# Beyond, a focal length is not that of the camera: tolerances of lenses are a third of it.
WRONG_FOCAL = 0.03

log = logging.getLogger("synfeal")


@command(
    "build a map of a place, to localize photographs without training",
    "synfeal map mydata --out mymap",
    option(
        "dataset",
        "data set of collect --depth, posed photographs (flat folder, seq-XX, TUM RGB-D), or a"
        " capture, such as a COLMAP model with its photographs (docs/captures.md)",
        type=Path,
        metavar="DATASET",
    ),
    option("--out", "folder to write", type=Path, required=True, metavar="DIR"),
    option(
        "--range",
        "range of frames to take, from 0, STOP exclusive (all)",
        type=int,
        nargs=2,
        metavar=("START", "STOP"),
    ),
    option("--stride", "take every N-th frame (1)", type=int, default=1, metavar="N"),
    option(
        "--most",
        "largest number of frames; if there are more, N of them, spread evenly (1000)",
        type=int,
        default=1000,
        metavar="N",
    ),
    *RGBD_OPTIONS,
    option("--seed", "seed of the vocabulary that retrieval learns (0)", type=int, default=0),
    function="baselines.api:map",
    was={"--frames": "--range", "--every": "--stride", "--poses-are": "--convention"},
)
def map(arguments: argparse.Namespace) -> None:  # noqa: A001 (the name of the command)
    """Build a map of image features, placed in space by depth, from renderings or photographs."""
    from baselines.api import map as build
    from baselines.references.localized import describe_map

    made = build(**keywords(arguments, map))
    print(f"{arguments.out}: {describe_map(made)}, {made.record['seconds']:.0f} s")
    print(f"synfeal localize {quote(str(arguments.out))} photos/ --out poses.csv")


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


def report_localized(arguments: argparse.Namespace, done: LocalizedInMap) -> None:
    """Say what ``synfeal localize`` found with a map, and what may be wrong with it."""
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
    if not done.states_errors:
        log.warning(
            "poses state no error: %s was not tried on frames of its own, or found too few of"
            " them; the same synfeal build, or synfeal map into another folder, tries it",
            arguments.model,
        )
    if done.n_found == 0 and not done.n_ambiguous:
        log.warning("is it another place, or is the focal length of the photographs wrong?")
    print(f"{arguments.model}: {done.n_frames} frames, {done.n_points} features")
    print(f"{arguments.out}: {found_text(done)}")


def found_text(done: LocalizedInMap) -> str:
    """Summarise in a line how many photographs were localized, in which world, how fast."""
    lost = done.n_images - done.n_found
    world = {"sequence": " in the world of the sequence", "mesh": " in the world of the mesh"}
    where = world[done.world] if done.world else ""
    counted = f"{done.n_found} of {done.n_images} photographs localized{where}, {lost} not"
    support = f" by {done.inliers:.0f} inliers (median)" if done.n_found else ""
    turned = f"; {TURNED_TEXT.format(done.n_turned)}" if done.n_turned else ""
    return f"{counted}{support}{turned}; {done.seconds:.2f} s a photograph (median)"
