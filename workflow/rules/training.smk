# One training per cell of the tables, predicted and scored at its end.
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


# Errors, and what is printed of them. Where runs were restored (synfeal restore), a rule of its own
# scores; else the job that makes the predictions does, which saves it starting a process.
SCORES = {
    "errors": f"{RUN}/errors.csv",
    "common_errors": f"{RUN}/common_errors.csv",
    "metrics": f"{RUN}/metrics.json",
}


use rule call as train with:
    input:
        **unless_restored(
            [f"{RUN}/predictions.csv"],
            frames=f"{ROOT}/frames/{{scene}}/train.npy",
            labels=f"{ROOT}/labels/{{scene}}/{{size}}/{{labels}}/train.csv",
            test_frames=f"{ROOT}/frames/{{scene}}/test.npy",
            test_labels=f"{ROOT}/labels/{{scene}}/{{size}}/{{labels}}/test.csv",
            truth=f"{ROOT}/labels/{{scene}}/{{size}}/synfeal/test.csv",
            depth=f"{ROOT}/scenes/{{scene}}/test_depth.npy",
            weights=backbone_weights,
            common=lambda w: common_test_set(w.scene)[0],
            # The camera of packed frames, and their hash, are in the records beside them.
            records=lambda w: under(
                "frames/{scene}/{split}.json", scene=w.scene, split=SPLITS
            ),
        ),
    output:
        **({} if RESTORED else SCORES),
        model=f"{RUN}/model.pt",
        history=f"{RUN}/history.csv",
        record=f"{RUN}/training.json",
        predictions=f"{RUN}/predictions.csv",
        common=f"{RUN}/common_predictions.csv",
    resources:
        mem_mb=train_mem_mb,
    params:
        function="baselines.training.experiment:train_and_score",
        run=lambda w: training_parameters(CONFIG, Run(**w)),
        every=lambda w: common_test_set(w.scene)[1],
        camera=dump(CONFIG.network_camera),


if RESTORED:

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
            **SCORES,
        params:
            function="baselines.training.score:write_scores",
            camera=dump(CONFIG.network_camera),
