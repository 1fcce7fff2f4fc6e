# From one textured mesh to every table of the Synfeal paper:
#   snakemake --cores 2 all
# Another profile:  snakemake --cores 2 --configfile config/smoke.yaml all
# One experiment:   snakemake --cores 2 results/mini/runs/large_room/6k/synfeal/pretrained/posenet2/seed0/metrics.json
from snakemake.utils import min_version

min_version("9.0")


configfile: "config/config.yaml"


include: "workflow/rules/common.smk"
include: "workflow/rules/collection.smk"
include: "workflow/rules/groundtruth.smk"
include: "workflow/rules/training.smk"
include: "workflow/rules/references.smk"
include: "workflow/rules/evidence.smk"


if robustness_asked():

    include: "workflow/rules/robustness.smk"


name_logs(workflow.rules)


localrules:
    all,
    scenes,
    datasets,
    labels,
    runs,
    start,
    tables,
    rescored,


rule all:
    default_target: True
    input:
        lambda w: and_behind(*EVIDENCE),
        f"{ROOT}/provenance.json",
        f"{ROOT}/report.html",


rule scenes:
    input:
        under("scenes/{scene}/properties.json", scene=CONFIG.scenes),


rule datasets:
    input:
        asked_datasets(),


rule labels:
    input:
        lambda w: and_behind(*LABELS),


rule runs:
    input:
        lambda w: and_behind(*METRICS, *every_label_set()),


rule start:
    input:
        under("pretrained/{backbone}.pt", backbone=["googlenet", "resnet34"]),


rule tables:
    input:
        lambda w: and_behind(
            *METRICS,
            *every_label_set(),
            *under("tables/{table}.csv", table=TABLE_NAMES),
        ),


# Every table from what was restored (synfeal restore), training nothing.
rule rescored:
    input:
        predictions_there,
        under(
            "tables/{table}.csv",
            table=[
                *TABLE_NAMES,
                "recall",
                *LABEL_TABLES,
                "speed_vs_error",
                "hard_cases",
            ],
        ),
        under("{file}", file=["tables/all_tables.tex", "claims.csv", "summary.md"]),


onstart:
    try:
        begin_run(CONFIG.root)
    except InputError as error:
        sys.exit(f"error: {error}")
    logger.info(
        None, extra={"plan": run_plan(workflow)}
    )  # for workflow/plugins alone


onsuccess:
    if Path(ROOT, "report.html").exists():
        print(f"Report: {ROOT}/report.html (one page; open it in a browser)")
