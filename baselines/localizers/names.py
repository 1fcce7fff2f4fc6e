"""Which backbone each localizer stands on; free of torch, so that a planner may import it."""

from __future__ import annotations

from typing import Literal

BackboneName = Literal["googlenet", "resnet34"]

BACKBONE_OF: dict[str, BackboneName] = {
    "posenet": "googlenet",
    "poselstm": "googlenet",
    "hourglass": "resnet34",
    "posenet2resnet": "resnet34",
    "posenet2": "googlenet",
}
