# Label sets other than the simulator's: reconstructed in batches with assistance, or with errors.

ESTIMATED = f"{ROOT}/labels/{{scene}}/{{size}}/{{reconstructed}}"
CHAINED = f"{ESTIMATED}/assistance.json"
TRUE = f"{ROOT}/labels/{{scene}}/{{size}}/synfeal"
ERRONEOUS = "{scene}/{size}/{error_kind}-p{noise_m}-r{noise_deg}/{split}"
STEM = f"{ROOT}/groundtruth/{{scene}}/{{size}}"
BATCH = "{split}/batch-{batch}"
BATCH_LOG = "{scene}/{size}/{split}/batch-{batch}"


use rule call as erroneous_labels with:
    input:
        truth=f"{TRUE}/{{split}}.csv",
        train=f"{TRUE}/train.csv",
    output:
        labels=f"{ROOT}/labels/{ERRONEOUS}.csv",
    log:
        f"{ROOT}/logs/labels/{ERRONEOUS}.log",
    benchmark:
        f"{ROOT}/benchmarks/labels/{ERRONEOUS}.tsv"
    params:
        function="baselines.labels.injected:write_erroneous_labels",
        seed=lambda w: seed_of(
            CONFIG.seed, *seed_names(w.error_kind, w.split), w.scene, w.size
        ),


use rule call_4gb as sfm with:
    input:
        **unless_restored(
            [f"{STEM}/sfm/{BATCH}.json"],
            sequences=batch_sequences,
            truth=f"{TRUE}/{{split}}.csv",
        ),
    output:
        trajectory=f"{STEM}/sfm/{BATCH}.csv",
        facts=f"{STEM}/sfm/{BATCH}.json",
    params:
        function="baselines.labels.sfm.batch:write_sfm",
        start=lambda w: batch_of(w).start,
        stop=lambda w: batch_of(w).stop,
        camera=dump(CONFIG.groundtruth_camera),
        sfm=dump(CONFIG.groundtruth.sfm),
        seed=lambda w: seed_of(CONFIG.seed, "sfm", w.scene, w.size, w.split, w.batch),


use rule call_4gb as rgbd with:
    input:
        **unless_restored([f"{STEM}/rgbd/{BATCH}.json"], sequences=batch_sequences),
    output:
        graph=f"{STEM}/rgbd/{BATCH}.g2o",
        facts=f"{STEM}/rgbd/{BATCH}.json",
    params:
        function="baselines.labels.rgbd.graph:write_rgbd",
        start=lambda w: batch_of(w).start,
        stop=lambda w: batch_of(w).stop,
        camera=dump(CONFIG.groundtruth_camera),
        rgbd=dump(CONFIG.groundtruth.rgbd),
        seed=lambda w: seed_of(CONFIG.seed, "depth-sensor", w.scene),


use rule call_4gb as estimate with:
    input:
        **unless_restored(
            [f"{STEM}/{{frame_method}}/{BATCH}.json"], sequences=batch_sequences
        ),
    output:
        trajectory=f"{STEM}/{{frame_method}}/{BATCH}.csv",
        facts=f"{STEM}/{{frame_method}}/{BATCH}.json",
    log:
        f"{ROOT}/logs/{{frame_method}}/{BATCH_LOG}.log",
    benchmark:
        f"{ROOT}/benchmarks/{{frame_method}}/{BATCH_LOG}.tsv"
    params:
        function="baselines.labels.methods:write_estimate",
        start=lambda w: batch_of(w).start,
        stop=lambda w: batch_of(w).stop,
        camera=dump(CONFIG.groundtruth_camera),
        groundtruth=lambda w: dump(
            CONFIG.groundtruth, include={METHODS[w.frame_method].settings}
        ),
        seed=lambda w: seed_of(CONFIG.seed, "depth-sensor", w.scene),


use rule call_2gb as posegraph with:
    input:
        **unless_restored(
            [f"{STEM}/{{graph_method}}/{BATCH}.json"], graph=f"{STEM}/rgbd/{BATCH}.g2o"
        ),
    output:
        trajectory=f"{STEM}/{{graph_method}}/{BATCH}.csv",
        facts=f"{STEM}/{{graph_method}}/{BATCH}.json",
    log:
        f"{ROOT}/logs/{{graph_method}}/{BATCH_LOG}.log",
    benchmark:
        f"{ROOT}/benchmarks/{{graph_method}}/{BATCH_LOG}.tsv"
    params:
        function="baselines.labels.methods:write_solved",
        posegraph=dump(CONFIG.groundtruth.posegraph),


use rule call as chain with:
    input:
        **unless_restored(
            [CHAINED],
            train_batches=lambda w: batch_files(w, "train"),
            test_batches=lambda w: batch_files(w, "test"),
            train_truth=f"{TRUE}/train.csv",
            test_truth=f"{TRUE}/test.csv",
        ),
    output:
        train=f"{ESTIMATED}/train.csv",
        test=f"{ESTIMATED}/test.csv",
        train_unassisted=f"{ESTIMATED}/train-unassisted.csv",
        test_unassisted=f"{ESTIMATED}/test-unassisted.csv",
        assistance=CHAINED,
        record=f"{ESTIMATED}/estimation.json",
    params:
        function="baselines.labels.chain:write_label_set",
        groundtruth=dump(
            CONFIG.groundtruth,
            include={"batch_frames", "assist_position_m", "assist_orientation_deg"},
        ),
        truth_used=lambda w: truth_used(CONFIG.groundtruth, w.reconstructed).value,
        estimation=lambda w: estimation_parameters(CONFIG, w.reconstructed),
