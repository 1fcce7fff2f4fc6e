# What the rules share: the checked configuration, names of files, jobs. No rules here.
import sys
from typing import get_args

from snakemake.logging import logger

from baselines.config.learning import MODELS
from baselines.labels.injected import seed_names
from baselines.labels.methods import METHODS, frame_methods, graph_methods, truth_used
from baselines.localizers.registry import backbone_of
from baselines.references.registry import in_group
from baselines.training.memory import training_mb
from baselines.training.sharing import card_mb, rendering_percent, training_percent
from reproduction.config.load import check_mesh_files, check_results, parse_config
from reproduction.design.experiments import (
    INJECTED,
    Init,
    Run,
    design_name,
    read_design,
)
from reproduction.config.robustness import MIXED
from reproduction.design.files import SPLITS, Files
from reproduction.design.jobs import jobs_of_run
from reproduction.design.label_sets import INJECTED_PATTERN
from reproduction.design.labels import check_sources, estimation_parameters
from reproduction.design.profiles import refuse_idle_scenes
from reproduction.design.runs import training_parameters
from reproduction.design.side_tables import (
    SIDE_TABLES,
    code_of,
    made_side_tables,
    needs_of,
)
from reproduction.runs.renamed import refuse_old_names
from synfeal.config.effects import CLEAN
from synfeal.config.load import read_yaml
from synfeal.dataset.frame_files import SUFFIX
from synfeal.effects.files import light_share_files
from synfeal.errors import InputError
from synfeal.records.lock import begin_run
from synfeal.records.provenance import config_hash, seed_of

# Two attributes of `workflow` that Snakemake does not document, as it documents no other way to the
# names of configuration files and to the settings of a run
# (https://github.com/snakemake/snakemake/issues/3596): `configfiles`, for keys given twice and for
# messages, and `storage_settings`, as meshes in a storage are not looked for on this machine.
try:
    for path in workflow.configfiles:
        read_yaml(Path(path))  # Snakemake takes the last of keys that are there twice
    CONFIG = parse_config(
        config, " + ".join(map(str, workflow.configfiles)) or "config"
    )
    if not workflow.storage_settings.default_storage_provider:
        check_mesh_files(CONFIG.scenes)
    check_results(CONFIG.root)
    refuse_old_names(CONFIG.root)
    refuse_idle_scenes(CONFIG, map(Path, workflow.configfiles))
    DESIGN = read_design(CONFIG)
    check_sources(DESIGN.rows, design_name(CONFIG))
except InputError as error:
    sys.exit(f"error: {error}")

FILES = Files(CONFIG, DESIGN)
ROOT = FILES.root
# Wildcards of all jobs of a full run, by rule.
JOBS = jobs_of_run(FILES)


wildcard_constraints:
    scene="|".join(CONFIG.scenes),
    split="train|test",
    camera="network|estimation",
    sequence=r"seq-\d+",
    batch=r"\d+",
    init="|".join(get_args(Init)),
    model="|".join(MODELS),
    backbone="|".join(sorted({backbone_of(m, CONFIG.network) for m in MODELS})),
    repetition=r"\d+",
    size=r"\w+",
    error_kind="|".join(INJECTED),
    reconstructed="|".join(METHODS),
    external="|".join(CONFIG.references.external) or "none",
    effects="|".join([CLEAN, *CONFIG.robustness.effects, MIXED]),
    frame_method="|".join(frame_methods()),
    graph_method="|".join(graph_methods()),


def under(pattern, **names):
    """Files of the profile's results: the pattern with every combination of these names."""
    return expand(f"{ROOT}/{pattern}", **names)


def table_files(name):
    """A table, CSV and LaTeX."""
    return {kind: f"{ROOT}/tables/{name}.{kind}" for kind in ("csv", "tex")}


def dump(model, **kwargs):
    """A configuration model as plain data: what a rule's parameters record and compare."""
    return model.model_dump(mode="json", **kwargs)


def file_of(files):
    """A file that a rule may do without, where it lies here."""
    return str(files) if files else None


def grown(mem_mb):
    """Memory of a job in MB: as much again with every attempt that a profile's ``retries`` allows."""
    return lambda wildcards, attempt: attempt * mem_mb


# Jobs of a machine with a GPU ask for shares of it, in percent; `--resources gpu_percent=100`, as in
# profiles/default, lets as many run at a time as one card bears. Elsewhere they ask for none.
CARD_MB = card_mb()
TRAINING_CARD_MB = None if CONFIG.training.device == "cpu" else CARD_MB
DRAWING_CARD_MB = CARD_MB if CONFIG.render.backend in ("auto", "opengl") else None


def made_by(*names):
    """An output of every job of these rules; none of rules that the profile does without."""
    return [
        file
        for name in names
        for job in JOBS.get(name, [])
        for file in expand(plain(getattr(rules, name).output[0]), **job)
    ]


def measured_by(*names):
    """List the measurements that Snakemake made of every job of these rules."""
    return [
        file
        for name in names
        for job in JOBS.get(name, [])
        for file in expand(plain(getattr(rules, name).benchmark), **job)
    ]


def plain(path):
    """A file of the results as rules name it, wherever a storage plugin keeps it."""
    return f"{ROOT}{str(path).partition(ROOT)[2]}"
