# Tables, figures and the summary: they read result files and compute nothing upstream.


rule table1_meshes:
    input:
        properties=expand(
            f"{ROOT}/scenes/{{scene}}/properties.json",
            scene=sorted({e.scene for e in EXPERIMENTS}),
        ),
    output:
        csv=f"{ROOT}/tables/table1_meshes.csv",
        tex=f"{ROOT}/tables/table1_meshes.tex",
    log:
        f"{ROOT}/logs/tables/table1_meshes.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/table1_meshes.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        scenes=sorted({e.scene for e in EXPERIMENTS}),
    script:
        "../scripts/table1_meshes.py"


rule table:
    input:
        metrics=table_metrics,
    output:
        csv=f"{ROOT}/tables/{{table}}.csv",
        tex=f"{ROOT}/tables/{{table}}.tex",
    log:
        f"{ROOT}/logs/tables/{{table}}.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/{{table}}.tsv"
    wildcard_constraints:
        table="table[2-5]_[a-z_]+",
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        rows=lambda w: [dump(row) for row in rows_of(w.table)],
        repetitions=CONFIG.training.repetitions,
    script:
        "../scripts/table.py"


rule assistance:
    input:
        records=assistance_files(),
    output:
        csv=f"{ROOT}/tables/assistance.csv",
    log:
        f"{ROOT}/logs/tables/assistance.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/assistance.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    params:
        rows=[dump(e) for e in EXPERIMENTS if e.labels in RECONSTRUCTED],
    script:
        "../scripts/assistance.py"


rule speed_vs_error:
    input:
        curves=expand(
            f"{ROOT}/scenes/{{scene}}/collision_curve.csv",
            scene=sorted({e.scene for e in EXPERIMENTS}),
        ),
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
        mem_mb=1000,
    params:
        scenes=sorted({e.scene for e in EXPERIMENTS}),
    script:
        "../scripts/speed_vs_error.py"


rule document:
    input:
        tex=expand(f"{ROOT}/tables/{{table}}.tex", table=TABLE_NAMES),
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
        mem_mb=1000,
    script:
        "../scripts/document.py"


rule figures:
    input:
        tables=expand(f"{ROOT}/tables/{{table}}.csv", table=TABLE_NAMES),
        speed=rules.speed_vs_error.output.csv,
    output:
        figures=directory(f"{ROOT}/figures"),
    log:
        f"{ROOT}/logs/figures.log",
    benchmark:
        f"{ROOT}/benchmarks/figures.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=1000,
    script:
        "../scripts/figures.py"


rule summary:
    input:
        metrics=all_metrics(),
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
        mem_mb=1000,
    params:
        rows=[dump(e) for e in EXPERIMENTS],
        repetitions=CONFIG.training.repetitions,
    script:
        "../scripts/summary.py"
