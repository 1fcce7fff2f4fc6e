"""What acts on which path, as a table."""

from __future__ import annotations

import pandas as pd

from synfeal.config.models import EffectsConfig
from synfeal.effects.apply import EFFECTS, Poses, path_effects, path_light, paths_of


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
