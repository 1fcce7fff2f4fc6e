# Label sets other than the simulator's: reconstructed in batches with assistance, or with errors.

CHAINED = f"{ROOT}/labels/{{scene}}/{{size}}/{{reconstructed}}/assistance.json"


use rule call as erroneous_labels with:
    input:
        truth=f"{ROOT}/labels/{{scene}}/{{size}}/synfeal/{{split}}.csv",
        train=f"{ROOT}/labels/{{scene}}/{{size}}/synfeal/train.csv",
    output:
        labels=f"{ROOT}/labels/{{scene}}/{{size}}/{{error_kind}}-p{{noise_m}}-r{{noise_deg}}/{{split}}.csv",
    log:
        f"{ROOT}/logs/labels/{{scene}}/{{size}}/{{error_kind}}-p{{noise_m}}-r{{noise_deg}}/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/labels/{{scene}}/{{size}}/{{error_kind}}-p{{noise_m}}-r{{noise_deg}}/{{split}}.tsv"
    params:
        function="synfeal.labels.errors:write_erroneous_labels",
        seed=lambda w: seed_of(
            CONFIG.seed, *seed_names(w.error_kind, w.split), w.scene, w.size
        ),


rule sfm:
    input:
        sequences=unless_restored(
            f"{ROOT}/groundtruth/{{scene}}/{{size}}/sfm/{{split}}/batch-{{batch}}.json",
            batch_sequences,
        ),
        truth=unless_restored(
            f"{ROOT}/groundtruth/{{scene}}/{{size}}/sfm/{{split}}/batch-{{batch}}.json",
            f"{ROOT}/labels/{{scene}}/{{size}}/synfeal/{{split}}.csv",
        ),
    output:
        trajectory=f"{ROOT}/groundtruth/{{scene}}/{{size}}/sfm/{{split}}/batch-{{batch}}.csv",
        facts=f"{ROOT}/groundtruth/{{scene}}/{{size}}/sfm/{{split}}/batch-{{batch}}.json",
    log:
        f"{ROOT}/logs/sfm/{{scene}}/{{size}}/{{split}}/batch-{{batch}}.log",
    benchmark:
        f"{ROOT}/benchmarks/sfm/{{scene}}/{{size}}/{{split}}/batch-{{batch}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(4000),
    params:
        start=lambda w: batch_of(w).start,
        stop=lambda w: batch_of(w).stop,
        camera=dump(CONFIG.groundtruth_camera),
        sfm=dump(CONFIG.groundtruth.sfm),
        seed=lambda w: seed_of(CONFIG.seed, "sfm", w.scene, w.size, w.split, w.batch),
    script:
        "../scripts/sfm.py"


rule rgbd:
    input:
        sequences=unless_restored(
            f"{ROOT}/groundtruth/{{scene}}/{{size}}/rgbd/{{split}}/batch-{{batch}}.json",
            batch_sequences,
        ),
    output:
        graph=f"{ROOT}/groundtruth/{{scene}}/{{size}}/rgbd/{{split}}/batch-{{batch}}.g2o",
        facts=f"{ROOT}/groundtruth/{{scene}}/{{size}}/rgbd/{{split}}/batch-{{batch}}.json",
    log:
        f"{ROOT}/logs/rgbd/{{scene}}/{{size}}/{{split}}/batch-{{batch}}.log",
    benchmark:
        f"{ROOT}/benchmarks/rgbd/{{scene}}/{{size}}/{{split}}/batch-{{batch}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(4000),
    params:
        start=lambda w: batch_of(w).start,
        stop=lambda w: batch_of(w).stop,
        camera=dump(CONFIG.groundtruth_camera),
        rgbd=dump(CONFIG.groundtruth.rgbd),
        seed=lambda w: seed_of(CONFIG.seed, "depth-sensor", w.scene),
    script:
        "../scripts/rgbd.py"


rule estimate:
    input:
        sequences=unless_restored(
            f"{ROOT}/groundtruth/{{scene}}/{{size}}/{{frame_method}}/{{split}}/batch-{{batch}}.json",
            batch_sequences,
        ),
    output:
        trajectory=f"{ROOT}/groundtruth/{{scene}}/{{size}}/{{frame_method}}/{{split}}/batch-{{batch}}.csv",
        facts=f"{ROOT}/groundtruth/{{scene}}/{{size}}/{{frame_method}}/{{split}}/batch-{{batch}}.json",
    log:
        f"{ROOT}/logs/{{frame_method}}/{{scene}}/{{size}}/{{split}}/batch-{{batch}}.log",
    benchmark:
        f"{ROOT}/benchmarks/{{frame_method}}/{{scene}}/{{size}}/{{split}}/batch-{{batch}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(4000),
    params:
        start=lambda w: batch_of(w).start,
        stop=lambda w: batch_of(w).stop,
        camera=dump(CONFIG.groundtruth_camera),
        groundtruth=lambda w: dump(
            CONFIG.groundtruth, include={METHODS[w.frame_method].settings}
        ),
        seed=lambda w: seed_of(CONFIG.seed, "depth-sensor", w.scene),
    script:
        "../scripts/estimate.py"


rule posegraph:
    input:
        graph=unless_restored(
            f"{ROOT}/groundtruth/{{scene}}/{{size}}/{{graph_method}}/{{split}}/batch-{{batch}}.json",
            f"{ROOT}/groundtruth/{{scene}}/{{size}}/rgbd/{{split}}/batch-{{batch}}.g2o",
        ),
    output:
        trajectory=f"{ROOT}/groundtruth/{{scene}}/{{size}}/{{graph_method}}/{{split}}/batch-{{batch}}.csv",
        facts=f"{ROOT}/groundtruth/{{scene}}/{{size}}/{{graph_method}}/{{split}}/batch-{{batch}}.json",
    log:
        f"{ROOT}/logs/{{graph_method}}/{{scene}}/{{size}}/{{split}}/batch-{{batch}}.log",
    benchmark:
        f"{ROOT}/benchmarks/{{graph_method}}/{{scene}}/{{size}}/{{split}}/batch-{{batch}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(2000),
    params:
        posegraph=dump(CONFIG.groundtruth.posegraph),
    script:
        "../scripts/posegraph.py"


rule chain:
    input:
        train_batches=unless_restored(CHAINED, lambda w: batch_files(w, "train")),
        test_batches=unless_restored(CHAINED, lambda w: batch_files(w, "test")),
        train_truth=unless_restored(
            CHAINED, f"{ROOT}/labels/{{scene}}/{{size}}/synfeal/train.csv"
        ),
        test_truth=unless_restored(
            CHAINED, f"{ROOT}/labels/{{scene}}/{{size}}/synfeal/test.csv"
        ),
    output:
        train=f"{ROOT}/labels/{{scene}}/{{size}}/{{reconstructed}}/train.csv",
        test=f"{ROOT}/labels/{{scene}}/{{size}}/{{reconstructed}}/test.csv",
        train_unassisted=f"{ROOT}/labels/{{scene}}/{{size}}/{{reconstructed}}/train-unassisted.csv",
        test_unassisted=f"{ROOT}/labels/{{scene}}/{{size}}/{{reconstructed}}/test-unassisted.csv",
        assistance=CHAINED,
        record=f"{ROOT}/labels/{{scene}}/{{size}}/{{reconstructed}}/estimation.json",
    log:
        f"{ROOT}/logs/chain/{{scene}}/{{size}}/{{reconstructed}}.log",
    benchmark:
        f"{ROOT}/benchmarks/chain/{{scene}}/{{size}}/{{reconstructed}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        groundtruth=dump(
            CONFIG.groundtruth,
            include={"batch_frames", "assist_position_m", "assist_orientation_deg"},
        ),
        estimation=lambda w: estimation_parameters(CONFIG, w.reconstructed),
    script:
        "../scripts/chain.py"
