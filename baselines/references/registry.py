"""The reference methods: the one list that rules, tables and figures are made from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from baselines.config.references import ExternalConfig, Group

Externals = Mapping[str, ExternalConfig]


@dataclass(frozen=True)
class Reference:
    """A reference method."""

    title: str  # as tables and figures call it
    # which methods are answered by one job: ``images`` looks at the frames that localizers see, of
    # every data set; ``structure`` at frames with depth, where some label set of the data set is
    # estimated from them. ``adjusted`` and ``coordinates`` do, too, for label sets of the paper
    # alone, the latter for those of :func:`worst`: they take longer.
    group: Group
    # place of its function in this package, ``module:name``, from the ``Evidence`` to poses
    # (N, 4, 4) of the test frames, NaN where it finds none. A table of titles loads no estimator.
    answer: str


REFERENCES: dict[str, Reference] = {
    "nearest-thumbnail": Reference("Nearest image, thumbnails", "images", "retrieval:by_thumbnail"),
    "nearest-vlad": Reference("Nearest image, DenseVLAD", "images", "retrieval:by_vlad"),
    "nearest-pose": Reference("Nearest training pose (oracle)", "images", "retrieval:nearest_pose"),
    "structure-depth": Reference("Structure, points from depth", "structure", "structure:on_depth"),
    "structure-rays": Reference(
        "Structure, points triangulated", "structure", "structure:triangulated"
    ),
    "structure-adjusted": Reference(
        "Structure, bundle-adjusted", "adjusted", "adjustment:adjusted"
    ),
    "scene-coordinates": Reference(
        "Scene coordinates", "coordinates", "scene_coordinates:by_coordinates"
    ),
}


def in_group(group: Group) -> list[str]:
    """The methods of a group, in the order of the registry."""
    return [name for name, reference in REFERENCES.items() if reference.group == group]


def titles_of(external: Externals) -> dict[str, str]:
    """What tables call the methods, by name."""
    own = {name: reference.title for name, reference in REFERENCES.items()}
    return own | {name: method.title for name, method in external.items()}
