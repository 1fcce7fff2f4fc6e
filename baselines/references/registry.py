"""The reference methods: the one list that rules, tables and figures are made from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from baselines.groundtruth.methods import METHODS, SIMULATOR
from synfeal.config import Experiment
from synfeal.config.models import ExternalConfig

Group = Literal["images", "structure", "adjusted", "coordinates"]
DataSet = tuple[str, str, str]  # scene, size, label set
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
PAPERS = ("table2_ground_truth", "table3_inconsistencies")


def in_group(group: Group) -> list[str]:
    """The methods of a group, in the order of the registry."""
    return [name for name, reference in REFERENCES.items() if reference.group == group]


def data_sets(rows: Iterable[Experiment]) -> list[DataSet]:
    """The data sets of a design, each once."""
    return sorted({(row.scene, row.size, row.label_id) for row in rows})


def has_structure(rows: Iterable[Experiment], scene: str, size: str) -> bool:
    """Whether frames with depth are rendered for a size: some label set is estimated from them."""
    return any((r.scene, r.size) == (scene, size) and r.labels in METHODS for r in rows)


def answered_by(rows: Iterable[Experiment], data_set: DataSet, external: Externals) -> list[str]:
    """The methods that answer for a data set: those of the registry, then somebody else's."""
    rows, (scene, size, labels) = list(rows), data_set
    groups: list[Group] = ["images"]
    if has_structure(rows, scene, size):
        groups.append("structure")
        same = [row for row in rows if (row.scene, row.size) == (scene, size)]
        papers = [row for row in same if row.table in PAPERS]
        groups += ["adjusted"] if any(row.label_id == labels for row in papers) else []
        groups += ["coordinates"] if labels in worst(papers) else []
    own = [name for name, reference in REFERENCES.items() if reference.group in groups]
    return [*own, *(n for n, e in external.items() if not e.labels or labels in e.labels)]


def worst(rows: Iterable[Experiment]) -> set[str]:
    """The simulator's label set, and the one with the largest noise of each block of Table 3."""
    rows = list(rows)
    blocks = {row.block for row in rows if row.block}
    by_noise = sorted(rows, key=lambda row: (row.noise_m, row.noise_deg), reverse=True)
    noisy = [next(row for row in by_noise if row.block == block) for block in blocks]
    return {SIMULATOR} | {row.label_id for row in noisy}


def titles_of(external: Externals) -> dict[str, str]:
    """What tables call the methods, by name."""
    own = {name: reference.title for name, reference in REFERENCES.items()}
    return own | {name: method.title for name, method in external.items()}
