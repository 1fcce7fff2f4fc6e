"""The jobs of a full run, rule by rule.

Snakemake works out jobs from the files that a target asks for, and does not make a missing file
again that only finished files need (https://github.com/snakemake/snakemake/issues/1978). After a
change of the configuration and a job that failed, old tables would pass for new ones. So the
targets of the Snakefile ask for a file of every job, layer by layer, and this module lists them.
"""

from __future__ import annotations

from collections.abc import Iterable

from baselines.config.learning import MODELS
from baselines.labels.methods import frame_methods, graph_methods, stages_of
from baselines.references.registry import in_group
from baselines.registry.kinds import Group
from reproduction.config.robustness import MIXED
from reproduction.design.experiments import INJECTED
from reproduction.design.files import SPLITS, Files
from reproduction.design.label_sets import INJECTED_PATTERN
from reproduction.design.references import DataSet
from reproduction.design.side_tables import made_side_tables
from synfeal.config.effects import CLEAN

# Wildcards of a job, by name.
Job = dict[str, str]
# Measurements that are not called like their rule and its wildcards, below ``<root>/benchmarks``.
_BATCH = "{scene}/{size}/{split}/batch-{batch}"
MEASUREMENTS = {
    "detail": "detail/{scene}/detail_{camera}",
    "true_labels": "labels/{scene}/{size}/synfeal/{split}",
    "erroneous_labels": f"labels/{{scene}}/{{size}}/{INJECTED_PATTERN}/{{split}}",
    "sfm": f"sfm/{_BATCH}",
    "rgbd": f"rgbd/{_BATCH}",
    "estimate": f"{{frame_method}}/{_BATCH}",
    "posegraph": f"{{graph_method}}/{_BATCH}",
    "train": "train/{scene}/{size}/{labels}/{init}/{model}/seed{repetition}",
    "table": "tables/{table}",
    "side_table": "tables/{side}",
    "document": "tables/document",
}


def jobs_of_run(files: Files) -> dict[str, list[Job]]:
    """List the jobs that the target ``all`` needs.

    Args:
        files: Files of the profile.

    Returns:
        The wildcards of each job, by rule; rules without a job are left out.
    """
    jobs = _scenes(files) | _frames(files) | _labels(files) | _training(files)
    jobs |= _references(files) | _robustness(files) | _evidence(files)
    return {rule: found for rule, found in jobs.items() if found}


def measurement_of(rule: str, job: Job) -> str:
    """Name the file that measures a job, below ``<root>/benchmarks`` and without ``.tsv``."""
    return MEASUREMENTS.get(rule, "/".join([rule, *job.values()])).format(**job)


def _scenes(files: Files) -> dict[str, list[Job]]:
    rooms = files.config.rooms if files.backbones else []
    scenes = [{"scene": scene} for scene in files.scenes]
    shown = [(scene, files.config.render.effects) for scene in [*files.scenes, *rooms]]
    if files.has_robustness:
        scene = files.config.robustness.scene
        shown += [(scene, effects) for effects in files.variations.values()]
    clutter = [(scene, e.clutter) for scene, e in shown if e and e.clutter]
    return {
        "scene": [{"scene": scene} for scene in [*files.scenes, *rooms]],
        "plan": [
            *({"scene": scene, "split": split} for scene in files.scenes for split in SPLITS),
            *({"scene": room, "split": "train"} for room in rooms),
        ],
        "coverage": [{"scene": s, "split": split} for s in files.scenes for split in SPLITS],
        "cell_depth": scenes,
        "detail": _details(files, rooms),
        "light_shares": _each({"scene": s} for s, e in shown if files.light_shares(s, e)),
        "cartons": _each({"scene": s} for s, objects in clutter if not objects.files),
        "render_speed": scenes,
        "collection_speed": scenes,
    }


def _details(files: Files, rooms: Iterable[str]) -> list[Job]:
    """List the meshes that colours are drawn of, but for cameras that draw the full one."""
    drawn = [(scene, "network") for scene in [*files.scenes, *rooms]]
    drawn += [(scene, "estimation") for scene in files.depth_scenes]
    drawn = [key for key in drawn if files.detail(*key, "glb")]
    robust = files.config.robustness.scene
    effects = [*files.tested_effects, MIXED] if files.has_robustness else []
    if any(files.detail(robust, "network", "glb", files.varied_render(e)) for e in effects):
        drawn.append((robust, "network"))
    return _each({"scene": scene, "camera": camera} for scene, camera in drawn)


def _frames(files: Files) -> dict[str, list[Job]]:
    rooms = files.config.rooms if files.backbones else []
    packed = [(scene, split) for scene in files.scenes for split in SPLITS]
    packed += [(room, "train") for room in rooms]
    camera = "estimation"
    return {
        "render": [
            {"scene": scene, "camera": camera, "sequence": sequence.name}
            for scene in files.depth_scenes
            for sequence in files.sequences(scene, camera)
        ],
        "dataset": [{"scene": scene, "camera": camera} for scene in files.depth_scenes],
        "render_packed": [
            {"scene": scene, "sequence": sequence.name}
            for scene, split in packed
            for sequence in files.sequences(scene, "network")
            if sequence.split == split
        ],
        "pack": [{"scene": scene, "split": split} for scene, split in packed],
    }


def _labels(files: Files) -> dict[str, list[Job]]:
    rows = [row for row in files.design.rows if row.labels in INJECTED]
    estimated = files.design.estimated
    found: dict[str, list[Job]] = {"sfm": [], "rgbd": [], "estimate": [], "posegraph": []}
    for scene, size, method in estimated:
        for stage in stages_of(method):
            rule, names = _estimation(stage)
            found[rule] += [
                {"scene": scene, "size": size, "split": split, "batch": f"{b.index:03d}", **names}
                for split in SPLITS
                for b in files.batches(scene, size, split)
            ]
    return {
        "true_labels": [
            {"scene": scene, "size": size, "split": split}
            for scene, size in files.sizes
            for split in SPLITS
        ],
        "erroneous_labels": _each(
            {
                "scene": row.scene,
                "size": row.size,
                "error_kind": row.labels,
                "noise_m": f"{row.noise_m:g}",
                "noise_deg": f"{row.noise_deg:g}",
                "split": split,
            }
            for row in rows
            for split in SPLITS
        ),
        **{rule: _each(jobs) for rule, jobs in found.items()},
        "chain": [
            {"scene": scene, "size": size, "reconstructed": method}
            for scene, size, method in estimated
        ],
    }


def _estimation(stage: str) -> tuple[str, Job]:
    """Return the rule of a stage of label estimation, and the wildcard that names its method."""
    if stage in frame_methods():
        return "estimate", {"frame_method": stage}
    if stage in graph_methods():
        return "posegraph", {"graph_method": stage}
    return stage, {}


def _training(files: Files) -> dict[str, list[Job]]:
    runs = files.design.runs
    names = ("scene", "size", "labels", "init", "model", "repetition")
    return {
        "pretrain": [{"backbone": backbone} for backbone in files.backbones],
        "train": [{name: str(getattr(run, name)) for name in names} for run in runs],
    }


def _references(files: Files) -> dict[str, list[Job]]:
    answers = files.references()

    def asked(*groups: Group) -> list[DataSet]:
        """Return data sets that methods of these groups answer for."""
        names = {name for group in groups for name in in_group(group)}
        return [key for key, methods in answers.items() if names.intersection(methods)]

    matched = {(scene, size) for scene, size, _ in asked("structure", "adjusted")}
    viewed = {(scene, size) for scene, size, _ in asked("coordinates")}
    featured = [(*key, split) for key in sorted(matched) for split in SPLITS]
    if files.has_robustness and files.has_robust_structure:
        robust = files.config.robustness
        featured.append((robust.scene, robust.size, "train"))
    sizes = [{"scene": scene, "size": size} for scene, size in sorted(matched)]
    described = asked("images", "structure", "adjusted")
    return {
        "descriptors": _each({"scene": scene} for scene, _, _ in described),
        "features": _each(
            {"scene": scene, "size": size, "split": split} for scene, size, split in featured
        ),
        "correspondences": sizes,
        "tracks": sizes,
        "views": [
            {"scene": scene, "size": size, "split": split}
            for scene, size in sorted(viewed)
            for split in SPLITS
        ],
        "image_references": [_data_set(key) for key in asked("images")],
        "structure_references": [_data_set(key) for key in asked("structure")],
        "adjusted_references": [_data_set(key) for key in asked("adjusted")],
        "coordinate_references": [_data_set(key) for key in asked("coordinates")],
        "external_reference": [
            {**_data_set(key), "external": name}
            for key, methods in answers.items()
            for name in methods
            if name in files.config.references.external
        ],
    }


def _data_set(key: DataSet) -> Job:
    scene, size, labels = key
    return {"scene": scene, "size": size, "labels": labels}


def _robustness(files: Files) -> dict[str, list[Job]]:
    if not files.has_robustness:
        return {}
    varied = [{"effects": name, "split": "test"} for name in files.tested_effects]
    varied += [{"effects": MIXED, "split": split} for split in SPLITS]
    structure = [CLEAN, *files.tested_effects] if files.has_robust_structure else []
    return {
        "render_varied": varied,
        "pack_varied": varied,
        "train_varied": [{"model": model} for model in MODELS],
        "varied_descriptors": [{"trained_on": name} for name in (CLEAN, MIXED)],
        "varied_structure": [{"effects": name} for name in structure],
        "effects_speed": [{} for _ in files.effects_speed()],
        "robustness": [{}],
    }


def _evidence(files: Files) -> dict[str, list[Job]]:
    return {
        "table": [{"table": table} for table in files.design.tables],
        "side_table": [{"side": name} for name in made_side_tables(files)],
        **{rule: [{}] for rule in ("document", "figures", "summary", "claims")},
    }


def _each(jobs: Iterable[Job]) -> list[Job]:
    """Drop repeated jobs, keeping their order."""
    return [dict(key) for key in dict.fromkeys(tuple(job.items()) for job in jobs)]
