"""The command ``synfeal train``, and ``synfeal localize`` with a trained model."""

from __future__ import annotations

import argparse
import logging
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from baselines.config.learning import MODELS
from synfeal.cli.options import command, keywords, option

if TYPE_CHECKING:
    from baselines.training.checkpoint import UnseenScore
    from baselines.training.localize import Localized
    from baselines.training.train import TrainedModel

log = logging.getLogger("synfeal")

CALIBRATION_OPTIONS = (
    option(
        "--camera",
        "calibration of the photographs: OpenCV, ROS or COLMAP (docs/cameras.md)",
        type=Path,
        metavar="FILE",
    ),
    option(
        "--focal",
        "focal length of the photographs in their pixels, in place of a calibration",
        type=float,
        dest="focal_px",
        metavar="PX",
    ),
    option(
        "--exif",
        "read the focal length in the photographs' EXIF data if neither is given (yes)",
        action=argparse.BooleanOptionalAction,
    ),
)

WORLD_OPTION = option(
    "--world",
    "world that poses are written in, where the place was scanned from a sequence (sequence)",
    choices=("sequence", "mesh"),
    default="sequence",
)

LOCALIZE_OPTIONS = (
    *CALIBRATION_OPTIONS,
    WORLD_OPTION,
    option(
        "--turns",
        "with a model: average each pose over N pairs of opposite virtual rotations of the camera"
        " (8); 0: the picture alone, faster and less exact",
        type=int,
        metavar="N",
    ),
)


@command(
    "train a localizer on a data set of your own",
    "synfeal train mydata --out trained",
    option(
        "datasets",
        "data set of collect, or a sequence of photographs with poses (flat folder, seq-XX,"
        " TUM RGB-D); several are combined",
        type=Path,
        nargs="+",
        metavar="DATASET",
    ),
    option("--out", "directory of the model", type=Path, required=True, metavar="DIR"),
    option("--localizer", "localizer to train (posenet2)", choices=MODELS, default="posenet2"),
    option(
        "--images", "number of images to train on, repeats included (30000)", type=int, metavar="N"
    ),
    option("--minutes", "train for about this long instead", type=float, metavar="M"),
    option(
        "--range",
        "range of photographs to take, from 0, STOP exclusive; repeat it for further ranges",
        type=int,
        nargs=2,
        action="append",
        default=[],
        metavar=("START", "STOP"),
    ),
    option(
        "--held-out",
        "share of the paths that is held out to measure the error, one after the other (0.1)",
        type=float,
        default=0.1,
        metavar="SHARE",
    ),
    option(
        "--randomisation",
        "`on`: vary light, lens and sensor each time an image is shown; `off`; or a YAML file of"
        " ranges (docs/localizing.md) (on)",
        default="on",
        metavar="on|off|FILE",
    ),
    *CALIBRATION_OPTIONS,
    option(
        "--input",
        "side of the network's image (64 on a processor, 224 on a GPU)",
        type=int,
        dest="input_px",
        metavar="PX",
    ),
    option(
        "--width",
        "factor on the network's channels (0.25 on a processor, 1 on a GPU)",
        type=float,
        metavar="FACTOR",
    ),
    option("--batch", "images per step (64)", type=int, default=64, metavar="N"),
    option(
        "--start",
        "weights that the backbone starts from (those of the package at width 0.25, else none)",
        type=Path,
        metavar="FILE",
    ),
    option("--device", "where to train (auto)", choices=("auto", "cpu", "cuda"), default="auto"),
    option("--seed", "seed of all random numbers (0)", type=int, default=0),
    function="baselines.api:train",
    was={"--frames": "--range"},
)
def train(arguments: argparse.Namespace) -> None:
    """Train a localizer on data sets; after an interruption, the same command continues."""
    from baselines.api import train as learn

    logging.getLogger("baselines.training").setLevel(logging.INFO)
    try:
        done = learn(**keywords(arguments, train))
    except KeyboardInterrupt as interrupt:
        raise KeyboardInterrupt("run the same command again to go on") from interrupt
    warn_of_ignorance(done.unseen)
    print(trained_text(done))
    print(f"synfeal localize {quote(str(done.model))} photos/ --out poses.csv")


def trained_text(done: TrainedModel) -> str:
    """Summarise in a line what was trained and its errors, those on the test split first."""
    before = "had ended before: " if done.finished_before else ""
    learned = (
        f"{before}{done.images} images shown of {done.n_frames} frames on {done.n_paths} paths"
    )
    found = []
    if done.unseen is not None and done.unseen.frames == "test split":
        found.append(unseen_text(done.unseen))
    if done.errors is not None:
        errors = _errors_text(done.errors.position_m, done.errors.orientation_deg)
        found.append(f"{errors} on held-out places")
    known = ", ".join(found)
    said = f"median error {known}" if known else "nothing was held out, so its error is not known"
    return f"{done.model}: {learned}; {said}"


def warn_of_ignorance(unseen: UnseenScore | None) -> None:
    """Say where a model is lost outside of the places that it has learned from."""
    if unseen is None or unseen.knows_place:
        return
    log.warning(
        "the model does not know places that it has not been shown: always answering the middle of"
        " the training positions has a median error of %.2f m there, the model %s; collect frames"
        ' of more places (`mode="random"`, more `frames`), or train longer (`images`)',
        unseen.constant_m,
        "none" if unseen.position_m is None else f"{unseen.position_m:.2f} m",
    )


def unseen_text(unseen: UnseenScore) -> str:
    """Summarise the errors where a localizer has not been."""
    errors = _errors_text(unseen.position_m, unseen.orientation_deg)
    frames = "test frames" if unseen.frames == "test split" else "held-out frames"
    return f"{errors} on {unseen.n_frames} {frames}"


def _errors_text(position_m: float | None, orientation_deg: float | None) -> str:
    if position_m is None or orientation_deg is None:
        return "not finite"
    return f"{position_m:.3f} m / {orientation_deg:.1f} degrees"


def report_localized(arguments: argparse.Namespace, done: Localized) -> None:
    """Say what ``synfeal localize`` did with a checkpoint, and what may be wrong with it."""
    if done.n_failed:
        message = "%d of %d poses are not finite: the training of %s diverged"
        log.warning(message, done.n_failed, done.n_images, arguments.model)
    if done.n_beyond:
        log.warning(
            "%d of %d poses lie far outside of where training frames were: these pictures may be"
            " of another place",
            done.n_beyond,
            done.n_images,
        )
    warn_of_unlike(arguments.model, done)
    warn_of_ignorance(done.description.unseen)
    print(f"{arguments.model}: {model_text(done)}")
    if done.n_resampled:
        print(f"{arguments.model}: {resampled_text(done)}")
    print(f"{arguments.out}: {poses_text(done)}")


# Of pictures of the place 5 % are called unlike; twice as many are no chance any more.
SUSPICIOUS = 0.1


def warn_of_unlike(model: Path, done: Localized) -> None:
    """Say that pictures seem to be of another place, or that the model cannot tell."""
    if done.n_unlike is None:
        log.warning(
            "%s: cannot tell pictures of another place (written before models could, by the"
            " benchmark, or from one path); synfeal train makes one that can",
            model,
        )
    elif done.n_unlike > SUSPICIOUS * done.n_images:
        scene = done.description.scene
        log.warning(
            "%d of %d pictures are unlike the frames that %s was trained on%s (column typicality:"
            " 0.05 or less, as of 5 %% of pictures of that place); do not trust their poses if they"
            " are of another place",
            done.n_unlike,
            done.n_images,
            model,
            f" in '{scene}'" if scene else "",
        )


def model_text(done: Localized) -> str:
    """Summarise in a line which localizer a model is and which field of view it expects."""
    description = done.description
    px, camera = description.network.input_px, description.camera
    if camera is None:
        view = "the field of view of its training frames is not known"
    elif description.network.view == "square":
        view = f"the short side must see {camera.short_side_fov_deg:.1f} degrees"
    else:
        across, down = camera.fov_deg
        view = f"they must see {across:.1f} x {down:.1f} degrees, as the training frames do"
    lens = ", through the same distorting lens" if camera and any(camera.distortion) else ""
    unseen = description.unseen
    error = "" if unseen is None else f"; its median error was {unseen_text(unseen)}"
    return f"{description.localizer}, pictures shrunk to {px} x {px} pixels; {view}{lens}{error}"


# Of photographs and the file of --camera, which is of the sensor.
TURNED_TEXT = "{} of them stand upright by their EXIF, the calibration was turned with them"
SOURCES = {
    "file": "their calibration",
    "focal": "their focal length",
    "exif": "the focal length in their EXIF",
}


def resampled_text(done: Localized) -> str:
    """Say by what pictures were brought to the training camera, and what they lack of its view."""
    which = "all" if done.n_resampled == done.n_images else f"{done.n_resampled} of {done.n_images}"
    by = SOURCES[done.calibration] if done.calibration else ""
    text = f"{which} pictures were brought to that view by {by}"
    if done.n_turned:
        text += f"; {TURNED_TEXT.format(done.n_turned)}"
    if done.outside < 5e-4:
        return text
    return (
        f"{text}; {done.outside:.1%} of it lies outside of them and is filled with their border:"
        " take pictures with a wider lens, or train with a narrower camera"
    )


def poses_text(done: Localized) -> str:
    """Summarise in a line how many poses were written, in which world, how fast."""
    alone_ms = done.read_ms + done.network_ms
    views = f" on {done.views} views" if done.views > 1 else ""
    parts = f"median: read {done.read_ms:.2f}, network {done.network_ms:.2f}{views}"
    rate = f"{done.images_per_s:.0f} pictures/s in batches, on {done.device}"
    poses = "1 pose" if done.n_images == 1 else f"{done.n_images} poses"
    world = {"sequence": " in the world of the sequence", "mesh": " in the world of the mesh"}
    where = world[done.world] if done.world else ""
    return f"{poses}{where}; {alone_ms:.2f} ms for one picture ({parts}), {rate}"
