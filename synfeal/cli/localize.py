"""``synfeal localize``: where was a picture taken?"""

from __future__ import annotations

import argparse
import logging
from pathlib import Path
from typing import TYPE_CHECKING

from synfeal.cli.options import Command, Options

if TYPE_CHECKING:
    from baselines.localize.run import Localized
    from baselines.training.description import FrameCamera, ModelDescription
    from synfeal.dataset.packed import View

OPTIONS: Options = (
    (
        "model",
        {"type": Path, "metavar": "MODEL", "help": "model.pt of a training run in this place"},
    ),
    (
        "images",
        {
            "type": Path,
            "nargs": "+",
            "metavar": "IMAGE",
            "help": "PNG or JPEG of any size, or a directory of them; their short side must have"
            " the field of view of the training frames' short side, or be whole as those were: what"
            " the model says, cropping and shrinking is all that is done to them",
        },
    ),
    (
        "--out",
        {"type": Path, "default": Path("poses.csv"), "help": "file to write (poses.csv)"},
    ),
    (
        "--device",
        {"choices": ("auto", "cpu", "cuda"), "default": "auto", "help": "where to run (auto)"},
    ),
)

log = logging.getLogger("synfeal")


def run(arguments: argparse.Namespace) -> None:
    """Carry out the command."""
    from baselines.localize.run import localize  # above this module, as in architecture.md

    out: Path = arguments.out
    done = localize(arguments.model, arguments.images, out, arguments.device)
    if done.n_failed:
        message = "%d of %d poses are not finite: the training of %s diverged"
        log.warning(message, done.n_failed, done.n_images, arguments.model)
    print(f"{arguments.model}: {model_text(done.description)}")
    print(f"{out}: {poses_text(done)}")


def model_text(description: ModelDescription) -> str:
    """Which localizer it is, and which pictures it can read."""
    px, camera = description.network.input_px, description.camera
    if camera is None:
        view = "the field of view of its training frames is not known"
    else:
        lens = ", through the same distorting lens" if any(camera.distortion) else ""
        view = f"{_seen(camera, description.network.view)}{lens}"
    return f"{description.localizer}, pictures shrunk to {px} x {px} pixels; {view}"


def _seen(camera: FrameCamera, view: View) -> str:
    """What of the world a picture must show."""
    if view == "square":
        return f"the short side must see {camera.short_side_fov_deg:.1f} degrees"
    across, down = camera.fov_deg
    return f"they must see {across:.1f} x {down:.1f} degrees, as the training frames do"


def poses_text(done: Localized) -> str:
    """How many poses, and what they took."""
    alone_ms = done.read_ms + done.network_ms
    parts = f"median: read {done.read_ms:.2f}, network {done.network_ms:.2f}"
    rate = f"{done.images_per_s:.0f} pictures/s in batches, on {done.device}"
    poses = "1 pose" if done.n_images == 1 else f"{done.n_images} poses"
    return f"{poses}; {alone_ms:.2f} ms for one picture ({parts}), {rate}"


COMMAND = Command(
    "localize",
    "poses of your own pictures by a trained model",
    "Estimates where pictures were taken, with a model trained in that place.",
    "synfeal localize results/mini/runs/.../model.pt photos/ --out poses.csv",
    OPTIONS,
    run,
)
