# What the rules share: the checked configuration, and which files a target needs. No rules here.
import sys
from functools import cache, partial
from typing import get_args

from snakemake.io import is_flagged, strip_wildcard_constraints
from snakemake.logging import logger

from baselines.localizers.registry import backbone_of
from baselines.labels.batches import batches_of
from baselines.labels.methods import (
    METHODS,
    frame_methods,
    graph_methods,
    stages_of,
    truth_used,
)
from reproduction.design.labels import check_sources, estimation_parameters
from reproduction.design.references import answered_by, data_sets, has_structure
from baselines.references.registry import in_group
from baselines.training.record import training_mb
from reproduction.design.runs import training_parameters
from reproduction.design.experiments import Run, read_design
from reproduction.config.load import check_mesh_files, parse_config
from reproduction.config.load import check_results
from synfeal.config.load import read_yaml
from reproduction.design.experiments import (
    INJECTED,
    Init,
    common_every,
    design_name,
    split_init,
)
from baselines.config.learning import MODELS
from synfeal.config.effects import CLEAN, MIXED
from synfeal.dataset.frame_files import SUFFIX
from synfeal.dataset.finish import origin_of
from synfeal.dataset.sevenscenes import sequences_of
from synfeal.effects.scene import carton_files
from synfeal.effects.light import GROUPS as LIGHT_GROUPS
from synfeal.errors import InputError
from baselines.labels.injected import seed_names
from synfeal.records.provenance import config_hash, seed_of
from reproduction.runs.restore import restored_files
from synfeal.records.lock import begin_run

try:
    for path in workflow.configfiles:
        read_yaml(Path(path))  # Snakemake takes the last of keys that are there twice
    CONFIG = parse_config(
        config, " + ".join(map(str, workflow.configfiles)) or "config"
    )
    if not workflow.storage_settings.default_storage_provider:
        check_mesh_files(CONFIG.scenes)
    check_results(CONFIG.root)
    DESIGN = read_design(CONFIG)
    EXPERIMENTS = DESIGN.rows
    check_sources(EXPERIMENTS, design_name(CONFIG))
    RESTORED = restored_files(CONFIG)
except InputError as error:
    sys.exit(f"error: {error}")

ROOT = CONFIG.root.as_posix()
# Jobs look for it in the configuration, also where the profile does not name it.
config["results"] = CONFIG.results.as_posix()
ARCHIVE = SUFFIX if CONFIG.archive_sequences else ""
SPLITS = ("train", "test")
SCENES = sorted({e.scene for e in EXPERIMENTS})
SIZES = sorted({(e.scene, e.size) for e in EXPERIMENTS})
RUNS = [run.directory for run in DESIGN.runs]
METRICS = [f"{ROOT}/runs/{run}/metrics.json" for run in RUNS]
TRUE_SETS = [f"{scene}/{size}/synfeal" for scene, size in SIZES]
ESTIMATED_SETS = ["/".join(names) for names in DESIGN.estimated]
POSE_SETS = sorted({*TRUE_SETS, *ESTIMATED_SETS})
TABLE_NAMES = ["table1_meshes", *DESIGN.tables]
DRAWN_TABLES = ("table3_inconsistencies", "table4_size", "table7_images_shown")
DRAWN = [table for table in TABLE_NAMES if table in DRAWN_TABLES]
# Of label sets that a method re-estimates; without one these tables would have no rows.
LABEL_TABLES = ("assistance", "label_error") if DESIGN.estimated else ()
RECONSTRUCTED = tuple(METHODS)
EXTERNAL = CONFIG.references.external
ROBUSTNESS = CONFIG.robustness
ROBUST_SET = f"{ROBUSTNESS.scene}/{ROBUSTNESS.size}/synfeal"


wildcard_constraints:
    scene="|".join(CONFIG.scenes),
    split="train|test",
    camera="network|groundtruth",
    sequence=r"seq-\d+",
    batch=r"\d+",
    init="|".join(get_args(Init)),
    model="|".join(MODELS),
    backbone="|".join(sorted({backbone_of(m, CONFIG.network) for m in MODELS})),
    repetition=r"\d+",
    size=r"\w+",
    error_kind="|".join(INJECTED),
    reconstructed="|".join(RECONSTRUCTED),
    external="|".join(EXTERNAL) or "none",
    effects="|".join([CLEAN, *CONFIG.robustness.effects, MIXED]),
    frame_method="|".join(frame_methods()),
    graph_method="|".join(graph_methods()),


def under(pattern, **names):
    """Files of the profile's results: the pattern with every combination of these names."""
    return expand(f"{ROOT}/{pattern}", **names)


def dump(model, **kwargs):
    """A configuration model as plain data: what a rule's parameters record and compare."""
    return model.model_dump(mode="json", **kwargs)


def file_of(files):
    """A file that a rule may do without, where it lies here."""
    return str(files) if files else None


def n_frames(scene, camera, split):
    """Frames of a split that have to be rendered with a camera: no more than a consumer asks for."""
    if camera == "network":
        return CONFIG.n_largest(scene, split)
    sizes = {size for s, size, _ in DESIGN.estimated if s == scene}
    return max((CONFIG.n_frames(scene, size, split) for size in sizes), default=0)


@cache
def sequences(scene, camera):
    counts = [n_frames(scene, camera, split) for split in SPLITS]
    return sequences_of(*counts, CONFIG.shard_frames)


def sequence_named(wildcards, camera=None):
    """The sequence of a wildcard: which split and which frames it holds."""
    every = sequences(wildcards.scene, camera or wildcards.camera)
    return next(s for s in every if s.name == wildcards.sequence)


def packed_shards(scene, split, kind):
    """Parts of a split's packed frames, in order (``npy``), or what they are (``json``)."""
    names = [s.name for s in sequences(scene, "network") if s.split == split]
    return under(
        "frames/{scene}/shards/{name}.{kind}", scene=scene, name=names, kind=kind
    )


def sequence_dirs(scene, camera, split=None, stop=None):
    """A data set's sequences, directories or archives, of one split, with frames below ``stop``."""
    return [
        f"{ROOT}/datasets/{scene}/{camera}/{s.name}{ARCHIVE}"
        for s in sequences(scene, camera)
        if split in (None, s.split) and (stop is None or s.start < stop)
    ]


def plans_with_frames(scene, camera, kind):
    """Plans of a data set's splits that have frames; what they cover (``coverage.json``) is known
    of whole plans, which only the frames of the network camera are."""
    if kind != "csv" and camera != "network":
        return []
    splits = [split for split in SPLITS if n_frames(scene, camera, split)]
    return under("plans/{scene}/{split}.{kind}", scene=scene, split=splits, kind=kind)


def batches(scene, size, split):
    count = CONFIG.n_frames(scene, size, split)
    return batches_of(count, CONFIG.groundtruth.batch_frames)


def batch_of(wildcards):
    every = batches(wildcards.scene, wildcards.size, wildcards.split)
    return every[int(wildcards.batch)]


def batch_files(wildcards, split):
    scene, size, method = wildcards.scene, wildcards.size, wildcards.reconstructed
    stem = f"{ROOT}/groundtruth/{scene}/{size}/{method}/{split}"
    return [f"{stem}/batch-{b.index:03d}.csv" for b in batches(scene, size, split)]


def batch_sequences(wildcards):
    """Sequences that hold the frames of a batch."""
    stop = batch_of(wildcards).stop
    return sequence_dirs(wildcards.scene, "groundtruth", wildcards.split, stop)


def name_logs(rules):
    """Give jobs a log and a benchmark file, named after their rule and its wildcards.

    Those of tables lie together, under their names. Rules that name their own keep them.
    """
    for made in (r for r in rules if r.script and not r.log):
        path = Path(strip_wildcard_constraints(made.output[0]) if made.output else "")
        varied = Path(*(part for part in path.parts if "{" in part)).as_posix()
        name = Path(made.name, varied.partition(".")[0]).as_posix()
        if path.parent.name == "tables":
            name = f"tables/{path.stem}"
        made.log_modifier = made.benchmark_modifier = workflow.modifier.path_modifier
        made.set_log(f"{ROOT}/logs/{name}.log")
        made.benchmark = f"{ROOT}/benchmarks/{name}.tsv"


def unless_restored(outputs, **sources):
    """Inputs of a rule, paths or functions by name; none where ``outputs`` were restored.

    What was restored (``synfeal restore``) is done, whatever is made again of what it came from.
    """

    def needed(source, wildcards):
        if all(output.format(**wildcards) in RESTORED for output in outputs):
            return []
        return source(wildcards) if callable(source) else source.format(**wildcards)

    return {name: partial(needed, source) for name, source in sources.items()}


def evidence_for(names, **files):
    """Inputs of a job that answers by these methods; none where all their scores were restored."""
    labels = f"{ROOT}/labels/{{scene}}/{{size}}"
    for split in SPLITS:
        files[split] = f"{labels}/{{labels}}/{split}.csv"
        files[f"{split}_truth"] = f"{labels}/synfeal/{split}.csv"
    scores = [f"{REFERENCE}/{name}/metrics.json" for name in names]
    return unless_restored(scores, **files)


def backbone_weights(wildcards):
    """The pretrained backbone a run starts from; nothing when it starts from scratch."""
    if split_init(wildcards.init)[0] == "scratch":
        return []
    return f"{ROOT}/pretrained/{backbone_of(wildcards.model, CONFIG.network)}.pt"


def grown(mem_mb):
    """Memory of a job in MB: as much again with every attempt that a profile's ``retries`` allows."""
    return lambda wildcards, attempt: attempt * mem_mb


def train_mem_mb(wildcards, attempt):
    scene, size = wildcards.scene, wildcards.size
    frames = sum(CONFIG.n_frames(scene, size, split) for split in SPLITS)
    return attempt * training_mb(frames, CONFIG.network, CONFIG.training.batch_size)


def predictions_there(wildcards):
    """Predictions of every run, none of which is to be made for this."""
    paths = under("runs/{run}/predictions.csv", run=RUNS)
    missing = [path for path in paths if not Path(path).exists()]
    if missing:
        sys.exit(
            f"error: {len(missing)} of {len(paths)} runs have no predictions, the first of them"
            f" {missing[0]}; restore them (synfeal restore), or make 'all'"
        )
    return paths


def runs_of(table):
    return [run.directory for run in DESIGN.table_runs(table)]


def table_files(name):
    """A table, CSV and LaTeX."""
    return {kind: f"{ROOT}/tables/{name}.{kind}" for kind in ("csv", "tex")}


def table4_files(pattern):
    """A file of each training run (``{run}``) of Table 4; of restored runs those that were kept."""
    runs = runs_of("table4_size")
    made = [run for run in runs if f"{ROOT}/runs/{run}/predictions.csv" not in RESTORED]
    files = {run: f"{ROOT}/{pattern.format(run=run)}" for run in runs}
    return [file for run, file in files.items() if run in made or file in RESTORED]


def manifests(camera):
    """Data sets of image files; those of the network camera are made on demand only."""
    labelled = sorted({scene for scene, _, _ in DESIGN.estimated})
    scenes = SCENES if camera == "network" else labelled
    return under("datasets/{scene}/{camera}/manifest.json", scene=scenes, camera=camera)


def asked_datasets():
    """Data sets of image files that the configuration names, or all of the design."""
    if CONFIG.datasets is None:
        return manifests("network") + manifests("groundtruth")
    return under("datasets/{scene}/network/manifest.json", scene=CONFIG.datasets)


def common_test_set(scene):
    """What localizers of all sizes are tested on, beside their own test sets: the true poses of the
    largest, and of how many of its frames one is taken."""
    sizes = {e.size for e in EXPERIMENTS if e.scene == scene}
    counts = {CONFIG.n_frames(scene, size, "test"): size for size in sizes}
    poses = f"{ROOT}/labels/{scene}/{counts[max(counts)]}/synfeal/test.csv"
    return poses, common_every(counts)


def smallest_train(scene):
    """Training frames of the smallest size of a scene that the design uses."""
    sizes = {e.size for e in EXPERIMENTS if e.scene == scene}
    return min(CONFIG.n_frames(scene, size, "train") for size in sizes)


REFERENCE_FILES = ("predictions.csv", "errors.csv", "metrics.json", "facts.json")


def reference_files(stem, names):
    """What the reference methods ``names`` leave behind for one data set."""
    return [f"{stem}/{name}/{file}" for name in names for file in REFERENCE_FILES]


def external_poses(wildcards):
    """The file with the answers of somebody else's localizer, if it is not run here."""
    pattern = EXTERNAL[wildcards.external].poses
    return pattern.format(**placeholders(wildcards)) if pattern else []


def placeholders(wildcards):
    return {name: wildcards[name] for name in ("scene", "size", "labels")}


def reference_sets(file):
    """One file per reference method and data set of the design."""
    return [
        f"{ROOT}/references/{s}/{z}/{l}/{name}/{file}"
        for s, z, l in data_sets(EXPERIMENTS)
        for name in answered_by(EXPERIMENTS, (s, z, l), CONFIG.references)
    ]


def beside_mesh(scene, effects):
    """What effects need of a scene: the shares of its light, where its lamps are switched, and
    built-in objects."""
    lights = LIGHT_GROUPS if effects and effects.light and effects.light.states else []
    clutter = effects.clutter if effects else None
    return [
        *(f"{ROOT}/scenes/{scene}/light_{group}.glb" for group in lights),
        *(map(str, clutter.files) if clutter else []),
        *(cartons_of(scene) if clutter and not clutter.files else []),
    ]


def detail_of(scene, camera, kind, render=CONFIG.render):
    """What colours of a camera's frames are drawn of (``glb``), and what was left out (``json``);
    nothing where the full mesh is drawn."""
    full = render.draws_full_mesh
    return [] if full else f"{ROOT}/scenes/{scene}/detail_{camera}.{kind}"


def varied_detail(effects, kind):
    """The same of frames with effects."""
    usual = VARIATIONS.get(effects, CONFIG.render.effects)
    render = CONFIG.render.model_copy(update={"effects": usual})
    return detail_of(ROBUSTNESS.scene, "network", kind, render)


def cartons_of(scene):
    """The built-in objects of a scene."""
    return [
        path.as_posix()
        for path in carton_files(CONFIG.root / f"scenes/{scene}/mesh.glb")
    ]


HAS_MESH = {name for name, scene in CONFIG.scenes.items() if scene.source == "mesh"}
VARIATIONS = ROBUSTNESS.rendered(CONFIG.collection, ROBUSTNESS.scene in HAS_MESH)
ROBUST_EFFECTS = [name for name in VARIATIONS if name != MIXED]
ROBUST_STRUCTURE = has_structure(EXPERIMENTS, ROBUSTNESS.scene, ROBUSTNESS.size)


def robust_run(model):
    return Run(
        ROBUSTNESS.scene, ROBUSTNESS.size, "synfeal", "pretrained", model, repetition=0
    )


def robust_frames(split):
    return CONFIG.n_frames(ROBUSTNESS.scene, ROBUSTNESS.size, split)


def varied_render(wildcards):
    effects = VARIATIONS.get(wildcards.effects, CONFIG.render.effects)
    return dump(CONFIG.render.model_copy(update={"effects": effects}))


def varied_extras(names):
    """What one of these variations needs of the scene beside its mesh."""
    usual = CONFIG.render.effects
    files = [
        beside_mesh(ROBUSTNESS.scene, VARIATIONS.get(name, usual)) for name in names
    ]
    return sorted({file for extras in files for file in extras})


def robustness_asked():
    """Whether the robustness table has rows: effects, and runs on its data set."""
    wanted = (ROBUSTNESS.scene, ROBUSTNESS.size, "synfeal", "pretrained")
    trained = any((r.scene, r.size, r.labels, r.init) == wanted for r in DESIGN.runs)
    return ROBUSTNESS.made and bool(ROBUST_EFFECTS) and trained


def robustness_made():
    """Whether the robustness table is made here; frames with effects are not restored."""
    return robustness_asked() and not RESTORED


def varied_structure():
    """Structure-based poses of the varied test frames, where there are frames with depth."""
    names = [CLEAN, *ROBUST_EFFECTS] if ROBUST_STRUCTURE else []
    return under("robustness/structure/{name}.csv", name=names)


def robustness_tables(kind="csv"):
    """The robustness table, where it is made."""
    return [f"{ROOT}/tables/robustness.{kind}"] if robustness_made() else []


def drawn_robustness():
    """What figures and speeds read of it, where anything is drawn of training runs."""
    if not (robustness_made() and DRAWN):
        return []
    speed = f"{ROOT}/scenes/{ROBUSTNESS.scene}/effects_speed.csv"
    return [speed, *robustness_tables()]


def label_figures():
    """The figures of a design that draws nothing of training runs."""
    return [] if DRAWN else [f"{ROOT}/figures"]


def batch_facts():
    """What every batch of the estimated label sets took, stage by stage."""
    return sorted(
        {
            f"{ROOT}/groundtruth/{scene}/{size}/{stage}/{split}/batch-{b.index:03d}.json"
            for scene, size, method in DESIGN.estimated
            for stage in stages_of(method)
            for split in SPLITS
            for b in batches(scene, size, split)
        }
    )


def run_plan(workflow):
    """What this run is going to do, worked out if somebody shows it (workflow/plugins)."""
    jobs = [job.benchmark for job in workflow.dag.needrun_jobs() if job.benchmark]

    def plan():
        from reproduction.plan.progress import plan_run

        return plan_run(CONFIG, DESIGN, map(str, jobs), workflow.cores or 1)

    return plan


def every_label_set():
    every = sorted({f"{e.scene}/{e.size}/{e.label_id}" for e in EXPERIMENTS})
    return under("labels/{set}/{split}.csv", set=[*POSE_SETS, *every], split=SPLITS)


def plain(path):
    """A file of the results as rules name it, wherever a storage plugin keeps it."""
    return f"{ROOT}{str(path).partition(ROOT)[2]}"


@cache
def jobs_behind(*files):
    """The jobs that files come from, each once: rule, wildcards, and what is asked of it."""
    stored = workflow.modifier.path_modifier.apply_default_storage
    jobs, left = {}, list(files)
    while left:
        asked = plain(left.pop())
        path = stored(asked)
        maker = next((r for r in workflow.rules if r.is_producer(path)), None)
        wildcards = maker.get_wildcards(path) if maker else {}
        job = maker and (maker.name, *sorted(wildcards.items()))
        if maker and job not in jobs:
            jobs[job] = maker, wildcards, asked
            left += maker.expand_input(wildcards)[0]
    return list(jobs.values())


# Of a job that fails or is killed no output stays, and Snakemake does not make a file again that
# only finished files need: after a change of the configuration the tables of the old one would
# pass for the new. So the targets ask for an output of every job, not of the last ones alone.
def and_behind(*files):
    """Files, and an output of every job they come from; for input functions: rules are known then."""
    made = jobs_behind(*files)
    return [
        asked for maker, _, asked in made if not is_flagged(maker.output[0], "temp")
    ]


def measurements(*files):
    """What the jobs behind files took, but for what was restored without it."""
    found = {}
    for maker, wildcards, _ in jobs_behind(*files):
        outputs = map(plain, maker.expand_output(wildcards)[0])
        found[plain(maker.expand_benchmark(wildcards))] = RESTORED.intersection(outputs)
    return [
        file for file, restored in found.items() if not restored or file in RESTORED
    ]
