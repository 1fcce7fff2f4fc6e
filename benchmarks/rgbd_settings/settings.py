"""The settings that are compared: the default one, and others that differ in one or two things.

Without loops the poses are those of the odometry, which every row has too.
"""

from __future__ import annotations

from synfeal.config.models import RgbdConfig

CHOSEN = "chosen"

_CHANGES: dict[str, dict[str, object]] = {
    CHOSEN: {},
    "Kinect": {"sensor": "kinect"},
    "start: features": {"start": "features"},
    "hybrid": {"method": "hybrid"},
    "hybrid, start: features": {"method": "hybrid", "start": "features"},
    "start: identity": {"start": "identity"},
    "keyframe every 5": {"keyframe_every": 5},
    "keyframe every 20": {"keyframe_every": 20},
    "6 loops a keyframe": {"loops_per_keyframe": 6},
    "intensity": {"method": "intensity"},
    "hybrid, Kinect": {"method": "hybrid", "sensor": "kinect"},
}


def settings() -> dict[str, RgbdConfig]:
    """All settings by name, the most telling first."""
    return {name: RgbdConfig().model_copy(update=change) for name, change in _CHANGES.items()}
