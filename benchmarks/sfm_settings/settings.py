"""The settings that are compared: the chosen one, and others that differ in one or two things.

What was found is in ``results/benchmarks/sfm_settings.csv``; its errors after a similarity fit are
the mapper's own. In batches of 26 frames, as the default profile has them, weak features halve the
errors in the Large Room (placed at the first pose; by a third or more after a fit), change nothing
in the painted room, and cost a third more for no gain in the Sanctuary. In batches of 251 frames
of the Large Room 600 of them were the best in one, and bent the end of the other by over a metre;
400 of them and COLMAP's contrast did not, in less time.
"""

from __future__ import annotations

from synfeal.config.models import SfmConfig

CHOSEN = "chosen"

# As config/config.yaml has them for 320x240 and frames 25 cm apart.
_CHOSEN = SfmConfig(max_features=600, peak_threshold=0.002)

COLMAP_PEAK_THRESHOLD = 0.02 / 3

# The settings before these were compared.
_FORMER: dict[str, object] = {
    "peak_threshold": COLMAP_PEAK_THRESHOLD,
    "overlap": 10,
    "quadratic_overlap": False,
}
_FEWER: dict[str, object] = {"max_features": 400}

_CHANGES: dict[str, dict[str, object]] = {
    CHOSEN: {},
    "COLMAP's contrast": {"peak_threshold": COLMAP_PEAK_THRESHOLD},
    "800 features": {"max_features": 800},
    "400 features": _FEWER,
    "250 features": {"max_features": 250},
    "400, 10 neighbours": {**_FEWER, "overlap": 10, "quadratic_overlap": False},
    "400, overlap 4": {**_FEWER, "overlap": 4},
    "400, guided matching": {**_FEWER, "guided_matching": True},
    "400, global mapper": {**_FEWER, "mapper": "global"},
    "former, one start": {**_FORMER, "min_explained": 0.0},
    "former, four starts": {**_FORMER, "min_explained": 1.0},
}


def settings() -> dict[str, SfmConfig]:
    """All settings by name, the most telling first."""
    return {name: _CHOSEN.model_copy(update=change) for name, change in _CHANGES.items()}
