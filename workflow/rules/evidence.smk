# Tables, figures and the summary: they read result files and compute nothing upstream.


rule table1_meshes:
    input:
        properties=expand(
            f"{ROOT}/scenes/{{scene}}/properties.json",
            scene=sorted({e.scene for e in EXPERIMENTS}),
        ),
    output:
        csv=report(
            f"{ROOT}/tables/table1_meshes.csv",
            caption="../report/table1_meshes.rst",
            category="Tables",
        ),
        tex=f"{ROOT}/tables/table1_meshes.tex",
    log:
        f"{ROOT}/logs/tables/table1_meshes.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/table1_meshes.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(1000),
    params:
        scenes=sorted({e.scene for e in EXPERIMENTS}),
    script:
        "../scripts/table1_meshes.py"


rule table:
    input:
        metrics=lambda w: metrics_of(DESIGN.table_runs(w.table)),
    output:
        csv=report(
            f"{ROOT}/tables/{{table}}.csv",
            caption="../report/table.rst",
            category="Tables",
        ),
        tex=f"{ROOT}/tables/{{table}}.tex",
    log:
        f"{ROOT}/logs/tables/{{table}}.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/{{table}}.tsv"
    wildcard_constraints:
        table="table[2-9]_[a-z_]+",
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(1000),
    params:
        design=dump(DESIGN),
    script:
        "../scripts/table.py"


rule recall:
    input:
        metrics=all_metrics(),
    output:
        csv=report(
            f"{ROOT}/tables/recall.csv",
            caption="../report/recall.rst",
            category="Tables",
        ),
        tex=f"{ROOT}/tables/recall.tex",
    log:
        f"{ROOT}/logs/tables/recall.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/recall.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(1000),
    params:
        design=dump(DESIGN),
    script:
        "../scripts/recall.py"


rule assistance:
    input:
        records=assistance_files(),
    output:
        csv=f"{ROOT}/tables/assistance.csv",
        tex=f"{ROOT}/tables/assistance.tex",
    log:
        f"{ROOT}/logs/tables/assistance.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/assistance.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(1000),
    params:
        rows=[dump(e) for e in EXPERIMENTS if e.labels in RECONSTRUCTED],
    script:
        "../scripts/assistance.py"


rule label_error:
    input:
        labels=pose_labels(),
        unassisted=unassisted_labels(),
        records=assistance_files(),
        facts=batch_facts(),
    output:
        csv=f"{ROOT}/tables/label_error.csv",
        tex=f"{ROOT}/tables/label_error.tex",
    log:
        f"{ROOT}/logs/tables/label_error.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/label_error.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(1000),
    params:
        rows=[dump(e) for e in EXPERIMENTS if e.labels in RECONSTRUCTED],
    script:
        "../scripts/label_error.py"


rule speed_vs_error:
    input:
        curves=expand(
            f"{ROOT}/scenes/{{scene}}/collision_curve.csv",
            scene=sorted({e.scene for e in EXPERIMENTS}),
        ),
        rendering=expand(
            f"{ROOT}/scenes/{{scene}}/render_speed.csv",
            scene=sorted({e.scene for e in EXPERIMENTS}),
        ),
        labels=rules.label_error.output.csv,
        trainings=expand(
            f"{ROOT}/tables/{{table}}.csv",
            table=[t for t in TABLE_NAMES if t == "table4_size"],
        ),
        histories=files_of_trainings("runs/{run}/history.csv"),
        effects=drawn_robustness(),
        measured=files_of_trainings("benchmarks/train/{run}.tsv"),
    output:
        csv=f"{ROOT}/tables/speed_vs_error.csv",
    log:
        f"{ROOT}/logs/tables/speed_vs_error.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/speed_vs_error.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(1000),
    params:
        scenes=sorted({e.scene for e in EXPERIMENTS}),
    script:
        "../scripts/speed_vs_error.py"


rule hard_cases:
    output:
        csv=f"{ROOT}/tables/hard_cases.csv",
    log:
        f"{ROOT}/logs/tables/hard_cases.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/hard_cases.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(2000),
    script:
        "../scripts/hard_cases.py"


rule document:
    input:
        tex=[
            *expand(
                f"{ROOT}/tables/{{table}}.tex",
                table=[*TABLE_NAMES, "references", "recall"],
            ),
            *robustness_tables("tex"),
        ],
    output:
        tex=f"{ROOT}/tables/all_tables.tex",
    log:
        f"{ROOT}/logs/tables/document.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/document.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(1000),
    script:
        "../scripts/document.py"


rule figures:
    input:
        tables=expand(
            f"{ROOT}/tables/{{table}}.csv",
            table=[t for t in TABLE_NAMES if t in DRAWN_TABLES],
        ),
        references=(
            [f"{ROOT}/tables/references.csv"]
            if set(TABLE_NAMES) & set(DRAWN_TABLES)
            else []
        ),
        robustness=drawn_robustness(),
        speed=rules.speed_vs_error.output.csv,
        labels=pose_labels(),
        assistance=assistance_files(),
        errors=errors_of(DESIGN.table_runs("table4_size")),
        collision=expand(
            f"{ROOT}/scenes/{{scene}}/collision.ply",
            scene=sorted({e.scene for e in EXPERIMENTS}),
        ),
        frames=packed_frames(["test"]),
    output:
        figures=report(
            directory(f"{ROOT}/figures"),
            patterns=["{figure}.png"],
            caption="../report/figure.rst",
            category="Figures",
            labels={"figure": "{figure}"},
        ),
    log:
        f"{ROOT}/logs/figures.log",
    benchmark:
        f"{ROOT}/benchmarks/figures.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(2000),
    params:
        design=dump(DESIGN),
    script:
        "../scripts/figures.py"


rule summary:
    input:
        metrics=all_metrics(),
        references=rules.references_table.output.csv,
        recall=rules.recall.output.csv,
        robustness=robustness_tables(),
        properties=rules.table1_meshes.input.properties,
    output:
        page=f"{ROOT}/summary.md",
        text=f"{ROOT}/summary.txt",
    log:
        f"{ROOT}/logs/summary.log",
    benchmark:
        f"{ROOT}/benchmarks/summary.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(1000),
    params:
        design=dump(DESIGN),
    script:
        "../scripts/summary.py"


rule claims:
    input:
        errors=errors_of(RUNS),
        histories=histories(),
        labels=true_labels(),
        assistance=assistance_files(),
        properties=rules.table1_meshes.input.properties,
        speed=expand(
            f"{ROOT}/scenes/{{scene}}/collection_speed.json",
            scene=sorted({e.scene for e in EXPERIMENTS}),
        ),
    output:
        csv=report(
            f"{ROOT}/claims.csv",
            caption="../report/claims.rst",
            category="Claims",
        ),
    log:
        f"{ROOT}/logs/claims.log",
    benchmark:
        f"{ROOT}/benchmarks/claims.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(1000),
    params:
        design=dump(DESIGN),
    script:
        "../scripts/claims.py"


RESULTS = [
    *expand(f"{ROOT}/tables/{{table}}.csv", table=TABLE_NAMES),
    rules.speed_vs_error.output.csv,
    rules.hard_cases.output.csv,
    rules.assistance.output.csv,
    rules.label_error.output.csv,
    rules.references_table.output.csv,
    rules.recall.output.csv,
    *robustness_tables(),
    rules.figures.output.figures,
    rules.summary.output.page,
    rules.claims.output.csv,
]


rule provenance:
    input:
        results=RESULTS,
        measured=lambda w: measurements([*files_of_evidence(), *passing_files()]),
    output:
        record=f"{ROOT}/provenance.json",
        jobs=f"{ROOT}/benchmarks.csv",
    log:
        f"{ROOT}/logs/provenance.log",
    benchmark:
        f"{ROOT}/benchmarks/provenance.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(1000),
    params:
        seed=CONFIG.seed,
        config_hash=config_hash(CONFIG),
    script:
        "../scripts/provenance.py"


rule report:
    input:
        provenance=rules.provenance.output.record,
        results=RESULTS,
        metrics=all_metrics(),
        meshes=expand(
            f"{ROOT}/scenes/{{scene}}/mesh.glb",
            scene=sorted({e.scene for e in EXPERIMENTS}),
        ),
        plans=expand(
            f"{ROOT}/plans/{{scene}}/{{split}}.csv",
            scene=sorted({e.scene for e in EXPERIMENTS}),
            split=SPLITS,
        ),
        labels=pose_labels(),
    output:
        page=f"{ROOT}/report.html",
    log:
        f"{ROOT}/logs/report.log",
    benchmark:
        f"{ROOT}/benchmarks/report.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(4000),
    params:
        design=dump(DESIGN),
    script:
        "../scripts/report.py"


rule report_document:
    input:
        tex=rules.document.input.tex,
        hard_cases=rules.hard_cases.output.csv,
        claims=rules.claims.output.csv,
        figures=rules.figures.output.figures,
    output:
        tex=f"{ROOT}/report.tex",
    log:
        f"{ROOT}/logs/report_document.log",
    benchmark:
        f"{ROOT}/benchmarks/report_document.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(1000),
    script:
        "../scripts/report_document.py"
