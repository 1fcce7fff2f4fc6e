"""What acts on which path, and which objects stand along it, as tables."""

from __future__ import annotations

import pandas as pd

from synfeal.config.models import EffectsConfig
from synfeal.effects.apply import (
    EFFECTS,
    Poses,
    crowd_generator,
    path_effects,
    path_light,
    paths_of,
)
from synfeal.effects.crowd import Crowd

# The middle of an object's bottom in the world, and its size before it is turned, metres.
PLACE = ("x_m", "y_m", "z_m", "size_x_m", "size_y_m", "size_z_m")


def effects_table(config: EffectsConfig, poses: Poses) -> pd.DataFrame:
    """What acts on each path and in which light, as columns; one row a path."""
    rows = []
    for first, last in paths_of(poses):
        own = path_effects(config, poses, first)
        light = path_light(own, poses, first)
        acts = {name: int(getattr(own, name) is not None) for name in EFFECTS}
        state = {}
        if light is not None:
            state = {"lights": light.state, "ev": light.ev, "temperature_k": light.temperature_k}
        rows.append({"path": poses.path[first], "frames": last - first, **acts, **state})
    return pd.DataFrame(rows)


def objects_table(config: EffectsConfig, poses: Poses, crowd: Crowd) -> pd.DataFrame:
    """What stands along each path and where, as columns; one row an object."""
    rows = []
    for first, last in paths_of(poses):
        if path_effects(config, poses, first).clutter is None:
            continue
        rng = crowd_generator(config, poses, first)
        for place in crowd.along(poses.position_m[first:last], rng)[1]:
            corners = dict(zip(PLACE, [*place["position_m"], *place["size_m"]], strict=True))
            about = {"name": place["name"], **corners, "yaw_deg": place["yaw_deg"]}
            rows.append({"path": poses.path[first], **about})
    return pd.DataFrame(rows, columns=["path", "name", *PLACE, "yaw_deg"])
