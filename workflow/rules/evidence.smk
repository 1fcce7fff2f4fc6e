# Tables, figures and the summary: they read result files and compute nothing upstream.

# Side tables that this profile has rows for; those that the document, the summary and figures show.
MADE = made_side_tables(FILES)
SUMMARISED = [name for name in MADE if SIDE_TABLES[name].in_summary]
DOCUMENTED = [name for name in MADE if SIDE_TABLES[name].in_document]
DOCUMENTED[1:1] = FILES.tables  # Table 1 stands before those of the design
DRAWN = {"label_ranking", "speed_vs_error"}.intersection(MADE)
if FILES.drawn_tables:
    DRAWN |= {"references", "robustness"}.intersection(MADE)


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


# Tables beside those of the design, each declared where it is made; another one needs no rule.
rule side_table:
    input:
        lambda w: needs_of(FILES, w.side),
    output:
        **table_files("{side}"),
    log:
        f"{ROOT}/logs/tables/{{side}}.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/{{side}}.tsv"
    wildcard_constraints:
        side="|".join(SIDE_TABLES),
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=lambda w, attempt: attempt * SIDE_TABLES[w.side].mem_mb,
    params:
        design=dump(DESIGN),
        settings=lambda w: {
            key: dump(getattr(CONFIG, key)) for key in SIDE_TABLES[w.side].settings
        },
        code=lambda w: code_of(w.side),  # read by nothing: a table whose code changed is made anew
    script:
        "../scripts/run_side_table.py"


rule document:
    input:
        tables=under("tables/{t}.tex", t=DOCUMENTED),
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
        sides=under("tables/{t}.csv", t=sorted(DRAWN)),
        effects_speed=FILES.effects_speed(),
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
        sides=under("tables/{t}.csv", t=SUMMARISED),
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
        assistance=under("labels/{set}/assistance.json", set=FILES.estimated_sets),
        speed=under("scenes/{scene}/collection_speed.json", scene=FILES.scenes),
    output:
        csv=f"{ROOT}/claims.csv",
        effects=f"{ROOT}/claim_effects.csv",
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
    script:
        "../scripts/run_claims.py"


# Files that the record has hashes of, and the report shows.
RESULTS = [
    *under("tables/{table}.csv", table=[*FILES.tables, *MADE]),
    rules.figures.output.dir,
    rules.summary.output.md,
    *rules.claims.output,
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
        side_tables=MADE,
    script:
        "../scripts/run_report.py"
