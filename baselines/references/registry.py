"""The reference methods: the one list that rules, tables and figures are made from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

from baselines.groundtruth.methods import METHODS
from synfeal.config import Experiment
from synfeal.config.models import ExternalConfig

Group = Literal["images", "structure"]
DataSet = tuple[str, str, str]  # scene, size, label set
Externals = Mapping[str, ExternalConfig]


@dataclass(frozen=True)
class Reference:
    """A reference method.

    Attributes:
        title: as tables and figures call it.
        group: which methods are answered by one job: ``images`` looks at the frames that localizers
            see, of every data set; ``structure`` at frames with depth, where some label set of the
            data set is estimated from them.
        answer: place of its function, ``module:name``, from
            :class:`~baselines.references.evidence.Evidence` to poses (N, 4, 4) of the test frames,
            NaN where it finds none. By place, so that a table of titles loads no estimator.
    """

    title: str
    group: Group
    answer: str


_PACKAGE = "baselines.references"
REFERENCES: dict[str, Reference] = {
    "nearest-thumbnail": Reference(
        "Nearest image, thumbnails", "images", f"{_PACKAGE}.retrieval:by_thumbnail"
    ),
    "nearest-vlad": Reference(
        "Nearest image, DenseVLAD", "images", f"{_PACKAGE}.retrieval:by_vlad"
    ),
    "nearest-pose": Reference(
        "Nearest training pose (oracle)", "images", f"{_PACKAGE}.oracle:nearest_pose"
    ),
    "structure-depth": Reference(
        "Structure, points from depth", "structure", f"{_PACKAGE}.structure:on_depth"
    ),
    "structure-rays": Reference(
        "Structure, points triangulated", "structure", f"{_PACKAGE}.triangulation:triangulated"
    ),
}


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
    groups = ["images", *(["structure"] if has_structure(rows, scene, size) else [])]
    own = [name for name, reference in REFERENCES.items() if reference.group in groups]
    return [*own, *(n for n, e in external.items() if not e.labels or labels in e.labels)]


def titles_of(external: Externals) -> dict[str, str]:
    """What tables call the methods, by name."""
    own = {name: reference.title for name, reference in REFERENCES.items()}
    return own | {name: method.title for name, method in external.items()}
