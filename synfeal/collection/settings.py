"""Settings of a collection from options, those that it takes from photographs among them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from synfeal.config.collect import CollectConfig, LikeConfig, checked
from synfeal.config.collection import AROUND_M
from synfeal.errors import Argument, InputError
from synfeal.planning.like import MIN_SEEN, MIN_VIEW_DISTANCE_M, Like, like_trajectory, resized

MARGIN_M, MARGIN_DEG = 0.2, 10.0


def collect_config(options: Mapping[str, Any]) -> tuple[CollectConfig, Like | None]:
    """Build the settings of a collection.

    Args:
        options: Fields of :class:`CollectConfig` and of :class:`LikeConfig` by name, of which None
            stands for the default.

    Returns:
        The settings, and what they take from a sequence of photographs, if from any.

    Raises:
        InputError: An option cannot be used; or the sequence cannot be read, or does not say what
            its camera is.
    """
    asked = {name: options.get(name) for name in LikeConfig.model_fields}
    given = {k: v for k, v in options.items() if v is not None and k not in asked}
    wanted = checked(LikeConfig, asked)
    if wanted.like is None:
        return checked(CollectConfig, given), None
    is_around = given.get("mode") == "around"
    if is_around:
        given.setdefault("poses", wanted.like)
        _refuse_box_options(wanted)
        # So that the box holds all cameras; it bounds none.
        margin_m = given.get("around_m", AROUND_M)
    else:
        margin_m = MARGIN_M if wanted.margin_m is None else wanted.margin_m
    like = like_trajectory(
        mesh=Path(given["mesh"]),
        sequence=wanted.like,
        frames=None if wanted.like_range is None else slice(*wanted.like_range),
        margin_m=margin_m,
        margin_deg=MARGIN_DEG if wanted.angle_margin_deg is None else wanted.angle_margin_deg,
    )
    chosen = {
        "box": [like.box],
        "roll_deg": like.roll_deg,
        "pitch_deg": like.pitch_deg,
        "yaw_deg": like.yaw_deg,
        "mode": "random",
        "min_view_distance_m": MIN_VIEW_DISTANCE_M,
        "min_seen": MIN_SEEN,
        **given,
    }
    if not given.keys() & {"camera", "fov_deg", "projection"}:
        if like.camera is None:
            raise InputError(
                Argument("like"), f"{wanted.like}: nothing says what its camera is", "give one"
            )
        camera = resized(like.camera, chosen.pop("width", None), chosen.pop("height", None))
        chosen["camera"] = camera.model_copy(update={"stereo_baseline_m": None})
    return checked(CollectConfig, chosen), like


def _refuse_box_options(wanted: LikeConfig) -> None:
    """Refuse what says which box cameras are in, where they are placed by each photograph."""
    for name, instead in (
        ("margin_m", "give `around_m`"),
        ("like_range", "give a sequence of those photographs alone"),
    ):
        if getattr(wanted, name) is not None:
            raise InputError(Argument(name), 'does not go with `mode="around"`', instead)
