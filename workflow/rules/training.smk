# One training per cell of the tables, predicted and scored at its end.
RUN = f"{ROOT}/runs/{{scene}}/{{size}}/{{labels}}/{{init}}/{{model}}/seed{{repetition}}"


rule pretrain:
    input:
        frames=[f"{ROOT}/frames/{room}/train.npy" for room in CONFIG.rooms],
        labels=[f"{ROOT}/plans/{room}/train.csv" for room in CONFIG.rooms],
        # The camera of packed frames, and their hash, are in the records beside them.
        records=[f"{ROOT}/frames/{room}/train.json" for room in CONFIG.rooms],
    output:
        weights=f"{ROOT}/pretrained/{{backbone}}.pt",
    log:
        f"{ROOT}/logs/pretrain/{{backbone}}.log",
    benchmark:
        f"{ROOT}/benchmarks/pretrain/{{backbone}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(
            training_mb(
                CONFIG.pretraining.frames * len(CONFIG.rooms),
                CONFIG.network,
                CONFIG.pretraining.batch_size,
            )
        ),
        gpu_percent=training_percent(
            CONFIG.pretraining.frames * len(CONFIG.rooms),
            CONFIG.network,
            CONFIG.pretraining.batch_size,
            TRAINING_CARD_MB,
        ),
    params:
        pretraining=dump(CONFIG.pretraining),
        network=dump(CONFIG.network),
        seed=lambda w: seed_of(CONFIG.seed, "pretrain", w.backbone),
    script:
        "../scripts/run_pretrain.py"


# Scored where it is trained, which saves starting a process.
rule train:
    input:
        frames=f"{ROOT}/frames/{{scene}}/train.npy",
        labels=f"{ROOT}/labels/{{scene}}/{{size}}/{{labels}}/train.csv",
        test_frames=f"{ROOT}/frames/{{scene}}/test.npy",
        test_labels=f"{ROOT}/labels/{{scene}}/{{size}}/{{labels}}/test.csv",
        truth=f"{ROOT}/labels/{{scene}}/{{size}}/synfeal/test.csv",
        depth=f"{ROOT}/scenes/{{scene}}/test_depth.npy",
        weights=lambda w: FILES.weights(w.model, w.init) or [],
        common=lambda w: FILES.common_test_set(w.scene)[0],
        # The camera of packed frames, and their hash, are in the records beside them.
        records=expand(f"{ROOT}/frames/{{{{scene}}}}/{{split}}.json", split=SPLITS),
    output:
        errors=f"{RUN}/errors.csv",
        common_errors=f"{RUN}/common_errors.csv",
        metrics=f"{RUN}/metrics.json",
        model=f"{RUN}/model.pt",
        history=f"{RUN}/history.csv",
        record=f"{RUN}/training.json",
        predictions=f"{RUN}/predictions.csv",
        common=f"{RUN}/common_predictions.csv",
    log:
        f"{ROOT}/logs/train/{{scene}}/{{size}}/{{labels}}/{{init}}/{{model}}/seed{{repetition}}.log",
    benchmark:
        f"{ROOT}/benchmarks/train/{{scene}}/{{size}}/{{labels}}/{{init}}/{{model}}/seed{{repetition}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=lambda w, attempt: attempt
        * training_mb(
            FILES.n_of_size(w.scene, w.size),
            CONFIG.network,
            CONFIG.training.batch_size,
        ),
        gpu_percent=lambda w: training_percent(
            FILES.n_of_size(w.scene, w.size),
            CONFIG.network,
            CONFIG.training.batch_size,
            TRAINING_CARD_MB,
        ),
    params:
        run=lambda w: training_parameters(CONFIG, Run(**w)),
        every=lambda w: FILES.common_test_set(w.scene)[1],
        camera=dump(CONFIG.network_camera),
    script:
        "../scripts/run_train.py"
