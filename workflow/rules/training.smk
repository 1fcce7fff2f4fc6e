# One training per cell of the tables; predictions once, scores in a second, cheap pass.
RUN = f"{ROOT}/runs/{{scene}}/{{size}}/{{labels}}/{{init}}/{{model}}/seed{{repetition}}"
RUN_LOG = "{scene}/{size}/{labels}/{init}/{model}/seed{repetition}"


use rule call as pretrain with:
    input:
        frames=[f"{ROOT}/frames/{room}/train.npy" for room in CONFIG.rooms],
        labels=[f"{ROOT}/plans/{room}/train.csv" for room in CONFIG.rooms],
        # The camera of packed frames, and their hash, are in the records beside them.
        records=[f"{ROOT}/frames/{room}/train.json" for room in CONFIG.rooms],
    output:
        weights=f"{ROOT}/pretrained/{{backbone}}.pt",
    resources:
        mem_mb=grown(
            training_mb(
                CONFIG.pretraining.frames * len(CONFIG.rooms),
                CONFIG.network,
                CONFIG.pretraining.batch_size,
            )
        ),
    params:
        function="baselines.training.pretrain:pretrain_backbone",
        pretraining=dump(CONFIG.pretraining),
        network=dump(CONFIG.network),
        seed=lambda w: seed_of(CONFIG.seed, "pretrain", w.backbone),


use rule call as train with:
    input:
        **unless_restored(
            [f"{RUN}/predictions.csv"],
            frames=f"{ROOT}/frames/{{scene}}/train.npy",
            labels=f"{ROOT}/labels/{{scene}}/{{size}}/{{labels}}/train.csv",
            test_frames=f"{ROOT}/frames/{{scene}}/test.npy",
            test_labels=f"{ROOT}/labels/{{scene}}/{{size}}/{{labels}}/test.csv",
            weights=backbone_weights,
            common=lambda w: common_test_set(w.scene)[0],
            # The camera of packed frames, and their hash, are in the records beside them.
            records=lambda w: under(
                "frames/{scene}/{split}.json", scene=w.scene, split=SPLITS
            ),
        ),
    output:
        model=f"{RUN}/model.pt",
        history=f"{RUN}/history.csv",
        record=f"{RUN}/training.json",
        predictions=f"{RUN}/predictions.csv",
        common=f"{RUN}/common_predictions.csv",
    resources:
        mem_mb=train_mem_mb,
    params:
        function="baselines.training.run:train_and_predict",
        run=lambda w: training_parameters(CONFIG, Run(**w)),
        every=lambda w: common_test_set(w.scene)[1],


use rule call as score with:
    input:
        predictions=f"{RUN}/predictions.csv",
        history=f"{RUN}/history.csv",
        record=f"{RUN}/training.json",
        labels=f"{ROOT}/labels/{{scene}}/{{size}}/{{labels}}/test.csv",
        truth=f"{ROOT}/labels/{{scene}}/{{size}}/synfeal/test.csv",
        train_labels=f"{ROOT}/labels/{{scene}}/{{size}}/{{labels}}/train.csv",
        depth=f"{ROOT}/scenes/{{scene}}/test_depth.npy",
        common=f"{RUN}/common_predictions.csv",
        common_truth=lambda w: common_test_set(w.scene)[0],
    output:
        errors=f"{RUN}/errors.csv",
        common=f"{RUN}/common_errors.csv",
        metrics=f"{RUN}/metrics.json",
    params:
        function="baselines.training.score:write_scores",
        camera=dump(CONFIG.network_camera),
