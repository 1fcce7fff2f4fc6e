# Tables, figures and the summary: they read result files and compute nothing upstream.


rule table1_meshes:
    input:
        properties=expand(
            f"{ROOT}/scenes/{{scene}}/properties.json", scene=sorted({e.scene for e in EXPERIMENTS})
        ),
    output:
        csv=f"{ROOT}/tables/table1_meshes.csv",
        tex=f"{ROOT}/tables/table1_meshes.tex",
    params:
        scenes=sorted({e.scene for e in EXPERIMENTS}),
        root=ROOT,
    log:
        f"{ROOT}/logs/tables/table1_meshes.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/table1_meshes.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    conda:
        "../envs/synfeal.yaml"
    script:
        "../scripts/table1_meshes.py"


rule table:
    input:
        metrics=table_metrics,
    output:
        csv=f"{ROOT}/tables/{{table}}.csv",
        tex=f"{ROOT}/tables/{{table}}.tex",
    wildcard_constraints:
        table="table[2-5]_[a-z_]+",
    params:
        rows=lambda w: [dump(row) for row in rows_of(w.table)],
        repetitions=CONFIG.training.repetitions,
        root=ROOT,
    log:
        f"{ROOT}/logs/tables/{{table}}.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/{{table}}.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    conda:
        "../envs/synfeal.yaml"
    script:
        "../scripts/table.py"
