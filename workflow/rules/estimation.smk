# Label sets other than the simulator's: reconstructed in batches with assistance, or with errors.

ESTIMATED = f"{ROOT}/labels/{{scene}}/{{size}}/{{reconstructed}}"
TRUE = f"{ROOT}/labels/{{scene}}/{{size}}/synfeal"
ERRONEOUS = f"{{scene}}/{{size}}/{INJECTED_PATTERN}/{{split}}"
STEM = f"{ROOT}/estimates/{{scene}}/{{size}}"
BATCH = "{split}/batch-{batch}"
BATCH_LOG = "{scene}/{size}/{split}/batch-{batch}"


rule erroneous_labels:
    input:
        truth=f"{TRUE}/{{split}}.csv",
        train=f"{TRUE}/train.csv",
    output:
        labels=f"{ROOT}/labels/{ERRONEOUS}.csv",
    log:
        f"{ROOT}/logs/labels/{ERRONEOUS}.log",
    benchmark:
        f"{ROOT}/benchmarks/labels/{ERRONEOUS}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        seed=lambda w: seed_of(
            CONFIG.seed, *seed_names(w.error_kind, w.split), w.scene, w.size
        ),
        dose=CONFIG.estimation.noise_dose,
    script:
        "../scripts/run_erroneous_labels.py"


rule sfm:
    input:
        sequences=lambda w: FILES.frames_of_batch(w.scene, w.size, w.split, w.batch),
        truth=f"{TRUE}/{{split}}.csv",
    output:
        trajectory=f"{STEM}/sfm/{BATCH}.csv",
        facts=f"{STEM}/sfm/{BATCH}.json",
    log:
        f"{ROOT}/logs/sfm/{{scene}}/{{size}}/{{split}}/batch-{{batch}}.log",
    benchmark:
        f"{ROOT}/benchmarks/sfm/{{scene}}/{{size}}/{{split}}/batch-{{batch}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(4000),
    params:
        start=lambda w: FILES.batch(w.scene, w.size, w.split, w.batch).start,
        stop=lambda w: FILES.batch(w.scene, w.size, w.split, w.batch).stop,
        camera=dump(CONFIG.estimation_camera),
        sfm=dump(CONFIG.estimation.sfm),
        seed=lambda w: seed_of(CONFIG.seed, "sfm", w.scene, w.size, w.split, w.batch),
    script:
        "../scripts/run_sfm.py"


rule rgbd:
    input:
        sequences=lambda w: FILES.frames_of_batch(w.scene, w.size, w.split, w.batch),
    output:
        graph=f"{STEM}/rgbd/{BATCH}.g2o",
        facts=f"{STEM}/rgbd/{BATCH}.json",
    log:
        f"{ROOT}/logs/rgbd/{{scene}}/{{size}}/{{split}}/batch-{{batch}}.log",
    benchmark:
        f"{ROOT}/benchmarks/rgbd/{{scene}}/{{size}}/{{split}}/batch-{{batch}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(4000),
    params:
        start=lambda w: FILES.batch(w.scene, w.size, w.split, w.batch).start,
        stop=lambda w: FILES.batch(w.scene, w.size, w.split, w.batch).stop,
        camera=dump(CONFIG.estimation_camera),
        rgbd=dump(CONFIG.estimation.rgbd),
        seed=lambda w: seed_of(CONFIG.seed, "depth-sensor", w.scene),
    script:
        "../scripts/run_rgbd.py"


rule estimate:
    input:
        sequences=lambda w: FILES.frames_of_batch(w.scene, w.size, w.split, w.batch),
    output:
        trajectory=f"{STEM}/{{frame_method}}/{BATCH}.csv",
        facts=f"{STEM}/{{frame_method}}/{BATCH}.json",
    log:
        f"{ROOT}/logs/{{frame_method}}/{BATCH_LOG}.log",
    benchmark:
        f"{ROOT}/benchmarks/{{frame_method}}/{BATCH_LOG}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(4000),
    params:
        start=lambda w: FILES.batch(w.scene, w.size, w.split, w.batch).start,
        stop=lambda w: FILES.batch(w.scene, w.size, w.split, w.batch).stop,
        camera=dump(CONFIG.estimation_camera),
        estimation=lambda w: dump(
            CONFIG.estimation, include={METHODS[w.frame_method].settings}
        ),
        seed=lambda w: seed_of(CONFIG.seed, "depth-sensor", w.scene),
    script:
        "../scripts/run_estimate.py"


rule posegraph:
    input:
        graph=f"{STEM}/rgbd/{BATCH}.g2o",
    output:
        trajectory=f"{STEM}/{{graph_method}}/{BATCH}.csv",
        facts=f"{STEM}/{{graph_method}}/{BATCH}.json",
    log:
        f"{ROOT}/logs/{{graph_method}}/{BATCH_LOG}.log",
    benchmark:
        f"{ROOT}/benchmarks/{{graph_method}}/{BATCH_LOG}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(2000),
    params:
        posegraph=dump(CONFIG.estimation.posegraph),
    script:
        "../scripts/run_posegraph.py"


rule chain:
    input:
        train_batches=lambda w: FILES.batch_files(
            w.scene, w.size, w.reconstructed, "train"
        ),
        test_batches=lambda w: FILES.batch_files(
            w.scene, w.size, w.reconstructed, "test"
        ),
        train_truth=f"{TRUE}/train.csv",
        test_truth=f"{TRUE}/test.csv",
    output:
        train=f"{ESTIMATED}/train.csv",
        test=f"{ESTIMATED}/test.csv",
        train_unassisted=f"{ESTIMATED}/train-unassisted.csv",
        test_unassisted=f"{ESTIMATED}/test-unassisted.csv",
        assistance=f"{ESTIMATED}/assistance.json",
        record=f"{ESTIMATED}/estimation.json",
    log:
        f"{ROOT}/logs/chain/{{scene}}/{{size}}/{{reconstructed}}.log",
    benchmark:
        f"{ROOT}/benchmarks/chain/{{scene}}/{{size}}/{{reconstructed}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        estimation=dump(
            CONFIG.estimation,
            include={"batch_frames", "assist_position_m", "assist_orientation_deg"},
        ),
        truth_used=lambda w: truth_used(CONFIG.estimation, w.reconstructed).value,
        parameters=lambda w: estimation_parameters(CONFIG, w.reconstructed),
    script:
        "../scripts/run_chain.py"
