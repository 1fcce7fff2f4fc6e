"""Reference methods that answer for each data set of the design."""

from __future__ import annotations

from collections.abc import Iterable

from baselines.config.references import ReferencesConfig
from baselines.labels.methods import METHODS, SIMULATOR
from baselines.references.registry import REFERENCES
from baselines.registry.kinds import Group
from reproduction.design.experiments import Experiment

DataSet = tuple[str, str, str]  # scene, size, label set
PAPERS = ("table2_ground_truth", "table3_inconsistencies")


def data_sets(rows: Iterable[Experiment]) -> list[DataSet]:
    """List the data sets of a design, each once."""
    return sorted({(row.scene, row.size, row.label_id) for row in rows})


def has_depth_frames(
    rows: Iterable[Experiment], scene: str, size: str, references: ReferencesConfig
) -> bool:
    """Tell whether large frames with depth are rendered for a size.

    They are where labels are estimated from them. Reference methods that need them, if they are
    asked for, answer there too, or have them rendered for all sizes.

    Args:
        rows: Rows of the design.
        scene: Name of the scene.
        size: Name of the size.
        references: Groups of methods that are asked, and the sizes that they answer for.
    """
    own = [row for row in rows if (row.scene, row.size) == (scene, size)]
    if references.structure_sizes == "all" and not {"images"}.issuperset(references.groups):
        return bool(own)
    return any(row.labels in METHODS for row in own)


def answered_by(
    rows: Iterable[Experiment], data_set: DataSet, references: ReferencesConfig
) -> list[str]:
    """List the reference methods that answer for a data set.

    Args:
        rows: Rows of the design, which decide what is rendered for the data set.
        data_set: Scene, size and label set.
        references: Groups of methods that are asked, and external localizers.

    Returns:
        Names of methods of the registry, then those of external localizers.
    """
    rows, (scene, size, labels) = list(rows), data_set
    groups: set[Group] = {"images"}
    if has_depth_frames(rows, scene, size, references):
        same = [row for row in rows if (row.scene, row.size) == (scene, size)]
        papers = [row for row in same if row.table in PAPERS]
        few = worst(papers)
        if references.structure_sets == "all" or labels in few | {"sfm"}:
            groups.add("structure")
        if any(row.label_id == labels for row in papers):
            groups.add("adjusted")
        if labels in few:
            groups.add("coordinates")
    asked = groups & set(references.groups)
    own = [name for name, reference in REFERENCES.items() if reference.group in asked]
    external = references.external.items()
    return [*own, *(name for name, each in external if not each.labels or labels in each.labels)]


def worst(rows: Iterable[Experiment]) -> set[str]:
    """Select the simulator's label set, and the noisiest one of each block of Table 3."""
    rows = list(rows)
    blocks = {row.block for row in rows if row.block}
    by_noise = sorted(rows, key=lambda row: (row.noise_m, row.noise_deg), reverse=True)
    noisy = [next(row for row in by_noise if row.block == block) for block in blocks]
    return {SIMULATOR} | {row.label_id for row in noisy}
