# Tables, figures and the summary: they read result files and compute nothing upstream.


use rule call as table1_meshes with:
    input:
        properties=under("scenes/{scene}/properties.json", scene=SCENES),
    output:
        **table_files("table1_meshes"),
    params:
        function="reproduction.tables.meshes:write_meshes_table",
        scenes=SCENES,


use rule call as table with:
    input:
        metrics=lambda w: under("runs/{run}/metrics.json", run=runs_of(w.table)),
        errors=lambda w: under(
            "runs/{run}/errors.csv",
            run=runs_of(w.table) if w.table == "table3_inconsistencies" else [],
        ),
    output:
        **table_files("{table}"),
    wildcard_constraints:
        table="table[2-9]_[a-z_]+",
    params:
        function="reproduction.tables.write:write_table",
        design=dump(DESIGN),


use rule call as recall with:
    input:
        metrics=METRICS,
    output:
        **table_files("recall"),
    params:
        function="reproduction.tables.recall:write_recall_table",
        design=dump(DESIGN),


use rule call as assistance with:
    input:
        records=under("labels/{set}/assistance.json", set=ESTIMATED_SETS),
    output:
        **table_files("assistance"),
    params:
        function="reproduction.tables.assistance:write_assistance_table",
        design=dump(DESIGN),


use rule call as label_error with:
    input:
        labels=under("labels/{set}/{split}.csv", set=POSE_SETS, split=SPLITS),
        unassisted=under(
            "labels/{set}/{split}-unassisted.csv", set=ESTIMATED_SETS, split=SPLITS
        ),
        records=under("labels/{set}/assistance.json", set=ESTIMATED_SETS),
        facts=batch_facts(),
    output:
        **table_files("label_error"),
    params:
        function="reproduction.tables.label_error:write_label_error_table",
        design=dump(DESIGN),


use rule call as speed_vs_error with:
    input:
        curves=under("scenes/{scene}/collision_curve.csv", scene=SCENES),
        rendering=under("scenes/{scene}/render_speed.csv", scene=SCENES),
        labels=under("tables/{t}.csv", t={"label_error"}.intersection(LABEL_TABLES)),
        trainings=under("tables/{t}.csv", t={"table4_size"} & {*TABLE_NAMES}),
        histories=table4_files("runs/{run}/history.csv"),
        effects=drawn_robustness(),
        measured=table4_files("benchmarks/train/{run}.tsv"),
    output:
        csv=f"{ROOT}/tables/speed_vs_error.csv",
    params:
        function="reproduction.tables.speed_vs_error:write_speed_vs_error",
        scenes=SCENES,


use rule call_2gb as hard_cases with:
    output:
        csv=f"{ROOT}/tables/hard_cases.csv",
    params:
        function="reproduction.hard_cases.table:write_hard_cases",


use rule call as document with:
    input:
        tables=[
            *under("tables/{t}.tex", t=[*TABLE_NAMES, "references", "recall"]),
            *robustness_tables("tex"),
        ],
    output:
        tex=f"{ROOT}/tables/all_tables.tex",
    log:
        f"{ROOT}/logs/tables/document.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/document.tsv"
    params:
        function="reproduction.report.document:write_document",


use rule call_2gb as figures with:
    input:
        tables=under("tables/{table}.csv", table=DRAWN),
        references=rules.references_table.output.csv if DRAWN else [],
        robustness=drawn_robustness(),
        speed=rules.speed_vs_error.output.csv,
        labels=under("labels/{set}/{split}.csv", set=POSE_SETS, split=SPLITS),
        assistance=under("labels/{set}/assistance.json", set=ESTIMATED_SETS),
        errors=under("runs/{run}/errors.csv", run=runs_of("table4_size")),
        collision=under("scenes/{scene}/collision.ply", scene=SCENES),
        frames=under("frames/{scene}/test.npy", scene=SCENES),
    output:
        dir=directory(f"{ROOT}/figures"),
    params:
        function="reproduction.figures.registry:write_figures",
        design=dump(DESIGN),


use rule call as summary with:
    input:
        metrics=METRICS,
        references=rules.references_table.output.csv,
        recall=rules.recall.output.csv,
        robustness=robustness_tables(),
        properties=rules.table1_meshes.input.properties,
    output:
        md=f"{ROOT}/summary.md",
    params:
        function="reproduction.report.summary:write_summary",
        design=dump(DESIGN),


use rule call as claims with:
    input:
        errors=under("runs/{run}/errors.csv", run=RUNS),
        common_errors=under("runs/{run}/common_errors.csv", run=RUNS),
        labels=under("labels/{set}/{split}.csv", set=TRUE_SETS, split=SPLITS),
        estimated=under("labels/{set}/train.csv", set=ESTIMATED_SETS),
        assistance=under("labels/{set}/assistance.json", set=ESTIMATED_SETS),
        properties=rules.table1_meshes.input.properties,
        speed=under("scenes/{scene}/collection_speed.json", scene=SCENES),
    output:
        csv=f"{ROOT}/claims.csv",
    params:
        function="reproduction.claims.table:write_claims",
        design=dump(DESIGN),
        seed=CONFIG.seed,


RESULTS = [
    *under("tables/{table}.csv", table=TABLE_NAMES),
    rules.speed_vs_error.output.csv,
    rules.hard_cases.output.csv,
    *under("tables/{table}.csv", table=LABEL_TABLES),
    rules.references_table.output.csv,
    rules.recall.output.csv,
    *robustness_tables(),
    rules.figures.output.dir,
    rules.summary.output.md,
    rules.claims.output.csv,
]


LABELS = [
    *every_label_set(),
    *under("tables/{table}.csv", table=LABEL_TABLES),
    *label_figures(),
]

# All but what records and reports a run; how much of its scene a plan covers is read by people alone.
EVIDENCE = [
    *RESULTS,
    rules.document.output.tex,
    *every_label_set(),
    *under("plans/{scene}/{split}.coverage.json", scene=SCENES, split=SPLITS),
    *manifests("groundtruth"),
]


use rule call as provenance with:
    input:
        results=RESULTS,
        measured=lambda w: measurements(*EVIDENCE),
    output:
        json=f"{ROOT}/provenance.json",
        csv=f"{ROOT}/benchmarks.csv",
    params:
        function="reproduction.report.html.provenance:write_provenance",
        seed=CONFIG.seed,
        config_hash=config_hash(CONFIG),


use rule call_4gb as report with:
    input:
        provenance=rules.provenance.output.json,
        results=RESULTS,
        metrics=METRICS,
        meshes=under("scenes/{scene}/mesh.glb", scene=SCENES),
        plans=under("plans/{scene}/{split}.csv", scene=SCENES, split=SPLITS),
        labels=under("labels/{set}/{split}.csv", set=POSE_SETS, split=SPLITS),
    output:
        html=f"{ROOT}/report.html",
    params:
        function="reproduction.report.html.page:write_report",
        design=dump(DESIGN),
        with_robustness=robustness_asked(),
