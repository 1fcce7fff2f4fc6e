# Tables, figures and the summary: they read result files and compute nothing upstream.


rule table1_meshes:
    input:
        properties=under("scenes/{scene}/properties.json", scene=FILES.scenes),
    output:
        **table_files("table1_meshes"),
    log:
        f"{ROOT}/logs/tables/table1_meshes.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/table1_meshes.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        scenes=FILES.scenes,
    script:
        "../scripts/run_table1_meshes.py"


rule table:
    input:
        metrics=lambda w: under("runs/{run}/metrics.json", run=FILES.runs_of(w.table)),
        errors=lambda w: under(
            "runs/{run}/errors.csv",
            run=FILES.runs_of(w.table) if w.table == "table3_inconsistencies" else [],
        ),
    output:
        **table_files("{table}"),
    log:
        f"{ROOT}/logs/tables/{{table}}.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/{{table}}.tsv"
    wildcard_constraints:
        table="table[2-9]_[a-z_]+",
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        design=dump(DESIGN),
    script:
        "../scripts/run_table.py"


rule references_table:
    input:
        metrics=FILES.of_references("metrics.json"),
        facts=FILES.of_references("facts.json"),
        localizers=FILES.of_runs("metrics.json"),
    output:
        **table_files("references"),
    log:
        f"{ROOT}/logs/tables/references.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/references.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        design=dump(DESIGN),
        references=dump(CONFIG.references),
    script:
        "../scripts/run_references_table.py"


rule label_ranking:
    input:
        predictions=FILES.ranked_predictions(),
        labels=FILES.ranking_labels(),
    output:
        **table_files("label_ranking"),
    log:
        f"{ROOT}/logs/tables/label_ranking.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/label_ranking.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        design=dump(DESIGN),
        references=dump(CONFIG.references),
    script:
        "../scripts/run_label_ranking.py"


rule shape_changes:
    input:
        errors=FILES.compared_errors(),
        labels=under("labels/{set}/{split}.csv", set=FILES.true_sets, split=SPLITS),
    output:
        **table_files("shape_changes"),
    log:
        f"{ROOT}/logs/tables/shape_changes.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/shape_changes.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        design=dump(DESIGN),
    script:
        "../scripts/run_shape_changes.py"


rule recall:
    input:
        metrics=FILES.of_runs("metrics.json"),
    output:
        **table_files("recall"),
    log:
        f"{ROOT}/logs/tables/recall.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/recall.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        design=dump(DESIGN),
    script:
        "../scripts/run_recall.py"


rule assistance:
    input:
        records=under("labels/{set}/assistance.json", set=FILES.estimated_sets),
    output:
        **table_files("assistance"),
    log:
        f"{ROOT}/logs/tables/assistance.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/assistance.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        design=dump(DESIGN),
    script:
        "../scripts/run_assistance.py"


rule label_error:
    input:
        labels=under("labels/{set}/{split}.csv", set=FILES.pose_sets, split=SPLITS),
        unassisted=under(
            "labels/{set}/{split}-unassisted.csv",
            set=FILES.estimated_sets,
            split=SPLITS,
        ),
        records=under("labels/{set}/assistance.json", set=FILES.estimated_sets),
        facts=FILES.batch_facts(),
    output:
        **table_files("label_error"),
    log:
        f"{ROOT}/logs/tables/label_error.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/label_error.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        design=dump(DESIGN),
    script:
        "../scripts/run_label_error.py"


rule speed_vs_error:
    input:
        curves=under("scenes/{scene}/collision_curve.csv", scene=FILES.scenes),
        rendering=under("scenes/{scene}/render_speed.csv", scene=FILES.scenes),
        labels=under(
            "tables/{t}.csv", t={"label_error"}.intersection(FILES.label_tables)
        ),
        trainings=under("tables/{t}.csv", t={"table4_size"}.intersection(FILES.tables)),
        histories=under("runs/{run}/history.csv", run=FILES.runs_of("table4_size")),
        effects=FILES.drawn_robustness(),
        measured=under("benchmarks/train/{run}.tsv", run=FILES.runs_of("table4_size")),
    output:
        csv=f"{ROOT}/tables/speed_vs_error.csv",
    log:
        f"{ROOT}/logs/tables/speed_vs_error.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/speed_vs_error.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        scenes=FILES.scenes,
    script:
        "../scripts/run_speed_vs_error.py"


rule hard_cases:
    output:
        csv=f"{ROOT}/tables/hard_cases.csv",
    log:
        f"{ROOT}/logs/tables/hard_cases.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/hard_cases.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(2000),
    script:
        "../scripts/run_hard_cases.py"


rule document:
    input:
        tables=[
            *under("tables/{t}.tex", t=[*FILES.tables, "references", "recall"]),
            *under("tables/{t}.tex", t=[*FILES.ranking_tables, *FILES.shape_tables]),
            *FILES.robustness_tables("tex"),
        ],
    output:
        tex=f"{ROOT}/tables/all_tables.tex",
    log:
        f"{ROOT}/logs/tables/document.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/document.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    script:
        "../scripts/run_document.py"


rule figures:
    input:
        tables=under("tables/{table}.csv", table=FILES.drawn_tables),
        references=rules.references_table.output.csv if FILES.drawn_tables else [],
        robustness=FILES.drawn_robustness(),
        ranking=under("tables/{t}.csv", t=FILES.ranking_tables),
        speed=rules.speed_vs_error.output.csv,
        labels=under("labels/{set}/{split}.csv", set=FILES.pose_sets, split=SPLITS),
        assistance=under("labels/{set}/assistance.json", set=FILES.estimated_sets),
        errors=under("runs/{run}/errors.csv", run=FILES.runs_of("table4_size")),
        collision=under("scenes/{scene}/collision.ply", scene=FILES.scenes),
        frames=under("frames/{scene}/test.npy", scene=FILES.scenes),
    output:
        dir=directory(f"{ROOT}/figures"),
    log:
        f"{ROOT}/logs/figures.log",
    benchmark:
        f"{ROOT}/benchmarks/figures.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(2000),
    params:
        design=dump(DESIGN),
    script:
        "../scripts/run_figures.py"


rule summary:
    input:
        metrics=FILES.of_runs("metrics.json"),
        references=rules.references_table.output.csv,
        recall=rules.recall.output.csv,
        robustness=FILES.robustness_tables(),
        properties=rules.table1_meshes.input.properties,
    output:
        md=f"{ROOT}/summary.md",
    log:
        f"{ROOT}/logs/summary.log",
    benchmark:
        f"{ROOT}/benchmarks/summary.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        design=dump(DESIGN),
    script:
        "../scripts/run_summary.py"


rule claims:
    input:
        errors=FILES.of_runs("errors.csv"),
        common_errors=FILES.of_runs("common_errors.csv"),
        labels=under("labels/{set}/{split}.csv", set=FILES.true_sets, split=SPLITS),
        estimated=under("labels/{set}/train.csv", set=FILES.estimated_sets),
        assistance=under("labels/{set}/assistance.json", set=FILES.estimated_sets),
        properties=rules.table1_meshes.input.properties,
        speed=under("scenes/{scene}/collection_speed.json", scene=FILES.scenes),
    output:
        csv=f"{ROOT}/claims.csv",
    log:
        f"{ROOT}/logs/claims.log",
    benchmark:
        f"{ROOT}/benchmarks/claims.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        design=dump(DESIGN),
        seed=CONFIG.seed,
    script:
        "../scripts/run_claims.py"


# Files that the record has hashes of, and the report shows.
RESULTS = [
    *under("tables/{table}.csv", table=FILES.tables),
    rules.speed_vs_error.output.csv,
    rules.hard_cases.output.csv,
    *under("tables/{table}.csv", table=FILES.label_tables),
    rules.references_table.output.csv,
    rules.recall.output.csv,
    *under("tables/{table}.csv", table=[*FILES.ranking_tables, *FILES.shape_tables]),
    *FILES.robustness_tables(),
    rules.figures.output.dir,
    rules.summary.output.md,
    rules.claims.output.csv,
]


rule provenance:
    input:
        results=RESULTS,
        measured=lambda w: measured_by(*JOBS),
    output:
        json=f"{ROOT}/provenance.json",
        csv=f"{ROOT}/benchmarks.csv",
    log:
        f"{ROOT}/logs/provenance.log",
    benchmark:
        f"{ROOT}/benchmarks/provenance.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        seed=CONFIG.seed,
        config_hash=config_hash(CONFIG),
    script:
        "../scripts/run_provenance.py"


rule report:
    input:
        provenance=rules.provenance.output.json,
        results=RESULTS,
        metrics=FILES.of_runs("metrics.json"),
        meshes=under("scenes/{scene}/mesh.glb", scene=FILES.scenes),
        plans=under("plans/{scene}/{split}.csv", scene=FILES.scenes, split=SPLITS),
        labels=under("labels/{set}/{split}.csv", set=FILES.pose_sets, split=SPLITS),
    output:
        html=f"{ROOT}/report.html",
    log:
        f"{ROOT}/logs/report.log",
    benchmark:
        f"{ROOT}/benchmarks/report.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(4000),
    params:
        design=dump(DESIGN),
        with_robustness=FILES.has_robustness,
    script:
        "../scripts/run_report.py"
