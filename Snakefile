# From one textured mesh to every table of the Synfeal paper:
#   snakemake --cores 2 all
# Another profile:  snakemake --cores 2 --configfile config/smoke.yaml all
# One experiment:   snakemake --cores 2 results/mini/runs/large_room/6k/synfeal/pretrained/posenet2/seed0/metrics.json
from snakemake.utils import min_version

min_version("9.6")


configfile: "config/config.yaml"


include: "workflow/rules/common.smk"
include: "workflow/rules/collection.smk"
include: "workflow/rules/estimation.smk"
include: "workflow/rules/training.smk"
include: "workflow/rules/references.smk"
include: "workflow/rules/evidence.smk"


if FILES.has_robustness:

    include: "workflow/rules/robustness.smk"


# Layers of a run, by the rules that make them. A target asks for a file of every job, not for the
# last ones alone (reproduction/design/jobs.py says why); files that go once they are used it leaves
# out.
SCENES = ["scene", "light_shares", "cartons", "plan", "detail"]
FRAMES = ["pack", "cell_depth"]
LABELS = [
    "true_labels",
    "erroneous_labels",
    "render",
    "sfm",
    "rgbd",
    "estimate",
    "posegraph",
    "chain",
]
RUNS = ["pretrain", "train"]
REFERENCES = [
    "descriptors",
    "correspondences",
    "tracks",
    "image_references",
    "structure_references",
    "adjusted_references",
    "coordinate_references",
    "external_reference",
]
ROBUSTNESS = [
    "pack_varied",
    "train_varied",
    "varied_descriptors",
    "varied_structure",
    "effects_speed",
    "robustness",
]
TABLES = ["table"]
LABEL_TABLES = [name for name in MADE if name in ("assistance", "label_error")]
EVIDENCE = [
    "coverage",
    "dataset",
    "render_speed",
    "collection_speed",
    "side_table",
    "document",
    "figures",
    "summary",
    "claims",
]


localrules:
    all,
    scenes,
    datasets,
    labels,
    runs,
    start,
    tables,


rule all:
    default_target: True
    input:
        made_by(*SCENES),
        made_by(*FRAMES),
        made_by(*LABELS),
        made_by(*RUNS),
        made_by(*REFERENCES),
        made_by(*ROBUSTNESS),
        made_by(*TABLES),
        made_by(*EVIDENCE),
        f"{ROOT}/provenance.json",
        f"{ROOT}/report.html",


rule scenes:
    input:
        under("scenes/{scene}/properties.json", scene=CONFIG.scenes),


rule datasets:
    input:
        (
            under("datasets/{scene}/network/manifest.json", scene=CONFIG.datasets)
            if CONFIG.datasets is not None
            else FILES.manifests("network") + FILES.manifests("estimation")
        ),


rule labels:
    input:
        made_by(*SCENES),
        made_by(*LABELS),
        under("tables/{name}.csv", name=LABEL_TABLES),


rule runs:
    input:
        made_by(*SCENES),
        made_by(*FRAMES),
        made_by(*LABELS),
        made_by(*RUNS),


rule start:
    input:
        under("pretrained/{backbone}.pt", backbone=["googlenet", "resnet34"]),


rule tables:
    input:
        made_by(*SCENES),
        made_by(*FRAMES),
        made_by(*LABELS),
        made_by(*RUNS),
        under("tables/table1_meshes.csv"),
        made_by(*TABLES),


onstart:
    try:
        begin_run(CONFIG.root)
    except InputError as error:
        sys.exit(f"error: {error}")
    from reproduction.plan.progress import seconds_by_rule

    # For workflow/plugins alone.
    expected = {"expected_s": seconds_by_rule(FILES), "cores": workflow.cores or 1}
    logger.info(None, extra=expected)


onsuccess:
    if Path(ROOT, "report.html").exists():
        from reproduction.report.summary import findings_in

        print(*findings_in(Path(ROOT, "summary.md")), sep="\n")
        print(f"Report: {ROOT}/report.html (one page; open it in a browser)")
