"""The pretrained backbones that come with the package.

    python -m baselines.localizers.backbones.shipped results/start

writes what ``make start`` trained to where the package keeps it, in half precision, with a record
of its hash and origin.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

import safetensors.torch
import torch

from baselines.localizers.registry import BackboneName
from baselines.localizers.saved import checked_state, load_saved
from synfeal.errors import InputError, exit_status, read_as, why
from synfeal.records.files import atomic_path, read_json, write_json

SHIPPED = Path(__file__).parent / "shipped"
RECIPE = "config/start.yaml"
BACKBONES: tuple[BackboneName, ...] = ("googlenet", "resnet34")


def shipped_weights_path(name: BackboneName, directory: Path = SHIPPED) -> Path:
    """Return the file of a shipped backbone, a quarter of the full width, after checking its hash.

    Raises:
        InputError: none of this backbone are shipped, or the file is not the one that was.
    """
    if name not in BACKBONES:
        raise InputError(
            "network.backbone",
            f"no weights of {name} are shipped, only of {', '.join(BACKBONES)}",
            "choose googlenet, or make some with pretraining.source: rooms",
        )
    path = directory / f"{name}.safetensors"
    try:
        expected = read_json(directory / "record.json")["sha256"][name]
        found = hashlib.sha256(path.read_bytes()).hexdigest()
    except (OSError, ValueError, LookupError) as error:
        raise InputError(
            path, f"cannot be read ({why(error)})", "install the package again"
        ) from error
    if found != expected:
        raise InputError(path, "is not the file that was shipped", "install the package again")
    return path


def ship(results: Path, directory: Path = SHIPPED) -> None:
    """Copy the backbones of ``results`` to ``directory``, with a record.

    Raises:
        InputError: a backbone is missing or cannot be read.
    """
    hashes = {
        name: _ship(results / "pretrained" / f"{name}.pt", name, directory) for name in BACKBONES
    }
    write_json(
        directory / "record.json",
        {"sha256": hashes, "recipe": RECIPE, "torch": str(torch.__version__)},
    )


def _ship(trained: Path, name: BackboneName, directory: Path) -> str:
    with read_as(trained, "a backbone", remedy="; run `make start` first"):
        state = checked_state(load_saved(trained))
    half = {k: v.half() if v.is_floating_point() else v for k, v in state.items()}
    content = safetensors.torch.save({k: v.contiguous() for k, v in half.items()})
    with atomic_path(directory / f"{name}.safetensors") as temporary:
        temporary.write_bytes(content)
    return hashlib.sha256(content).hexdigest()


if __name__ == "__main__":
    sys.exit(exit_status(lambda: ship(Path(sys.argv[1])), "nothing was shipped"))
