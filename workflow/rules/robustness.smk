# The same test paths in other light, through another camera (docs/variation.md): localizers trained
# on ideal frames, and once more on frames with all effects mixed in.
VARIED = f"{ROOT}/robustness"


use rule render_packed as render_varied with:
    input:
        extras=lambda w: varied_extras([w.effects]),
        mesh=f"{ROOT}/scenes/{ROBUSTNESS.scene}/mesh.glb",
        plan=f"{ROOT}/plans/{ROBUSTNESS.scene}/{{split}}.csv",
        detail=lambda w: varied_detail(w.effects, "glb"),
    output:
        frames=temp(f"{VARIED}/shards/{{effects}}/{{split}}.npy"),
        record=temp(f"{VARIED}/shards/{{effects}}/{{split}}.json"),
    params:
        start=0,
        stop=lambda w: robust_frames(w.split),
        render=varied_render,


use rule pack as pack_varied with:
    input:
        plan=f"{ROOT}/plans/{ROBUSTNESS.scene}/{{split}}.csv",
        shards=[f"{VARIED}/shards/{{effects}}/{{split}}.npy"],
        records=[f"{VARIED}/shards/{{effects}}/{{split}}.json"],
        detail=lambda w: varied_detail(w.effects, "json"),
    output:
        frames=f"{VARIED}/frames/{{effects}}/{{split}}.npy",
        record=f"{VARIED}/frames/{{effects}}/{{split}}.json",
    params:
        render=varied_render,


use rule call as train_varied with:
    input:
        frames=f"{VARIED}/frames/mixed/train.npy",
        labels=f"{ROOT}/labels/{ROBUST_SET}/train.csv",
        test_frames=f"{VARIED}/frames/mixed/test.npy",
        test_labels=f"{ROOT}/labels/{ROBUST_SET}/test.csv",
        weights=lambda w: f"{ROOT}/pretrained/{backbone_of(w.model, CONFIG.network)}.pt",
        records=expand(f"{VARIED}/frames/mixed/{{split}}.json", split=SPLITS),
    output:
        model=f"{VARIED}/runs/{{model}}/model.pt",
        history=f"{VARIED}/runs/{{model}}/history.csv",
        record=f"{VARIED}/runs/{{model}}/training.json",
        predictions=f"{VARIED}/runs/{{model}}/predictions.csv",
    resources:
        mem_mb=lambda w, attempt: attempt
        * training_mb(
            sum(map(robust_frames, SPLITS)),
            CONFIG.network,
            CONFIG.training.batch_size,
        ),
    params:
        function="baselines.training.run:train_and_predict",
        run=lambda w: training_parameters(CONFIG, robust_run(w.model)),


# Vectors of the ideal and of the varied frames: what the map of each training set is searched by.
use rule call_3gb as varied_descriptors with:
    input:
        **{
            CLEAN: f"{ROOT}/frames/{ROBUSTNESS.scene}/test.npy",
            **{n: f"{VARIED}/frames/{n}/test.npy" for n in ROBUST_EFFECTS},
            "train": lambda w: (
                f"{VARIED}/frames/{MIXED}/train.npy"
                if w.trained_on == MIXED
                else f"{ROOT}/frames/{ROBUSTNESS.scene}/train.npy"
            ),
        },
    output:
        descriptors=f"{VARIED}/descriptors/{{trained_on}}.npz",
    wildcard_constraints:
        trained_on=f"{CLEAN}|{MIXED}",
    params:
        function="baselines.references.descriptors:write_descriptors",
        counts={
            **dict.fromkeys([CLEAN, *ROBUST_EFFECTS], robust_frames("test")),
            "train": robust_frames("train"),
        },
        learned_from=smallest_train(ROBUSTNESS.scene),
        seed=seed_of(CONFIG.seed, "descriptors", ROBUSTNESS.scene),


# A sample of the test frames, large enough for features, against the map of the ideal frames.
use rule call_3gb as varied_structure with:
    input:
        extras=lambda w: varied_extras([w.effects]),
        mesh=f"{ROOT}/scenes/{ROBUSTNESS.scene}/mesh.glb",
        plan=f"{ROOT}/plans/{ROBUSTNESS.scene}/test.csv",
        descriptors=f"{VARIED}/descriptors/clean.npz",
        features=f"{ROOT}/references/{ROBUSTNESS.scene}/{ROBUSTNESS.size}/features-train.npz",
        labels=f"{ROOT}/labels/{ROBUST_SET}/train.csv",
    output:
        predictions=f"{VARIED}/structure/{{effects}}.csv",
    params:
        function="baselines.references.robustness:write_varied",
        n_test=robust_frames("test"),
        sample=ROBUSTNESS.structure_frames,
        camera=dump(CONFIG.groundtruth_camera),
        render=varied_render,
        references=dump(CONFIG.references, exclude={"coordinate_samples"}),
        seed=seed_of(CONFIG.seed, "references", *ROBUST_SET.split("/")),


use rule call_3gb as effects_speed with:
    input:
        extras=varied_extras(VARIATIONS),
        mesh=f"{ROOT}/scenes/{ROBUSTNESS.scene}/mesh.glb",
        plan=f"{ROOT}/plans/{ROBUSTNESS.scene}/test.csv",
    output:
        csv=f"{ROOT}/scenes/{ROBUSTNESS.scene}/effects_speed.csv",
    params:
        function="reproduction.speed.collection:write_effects_speed",
        camera=dump(CONFIG.network_camera),
        render=dump(CONFIG.render),
        effects={name: dump(VARIATIONS[name]) for name in ROBUST_EFFECTS},


use rule call_2gb as robustness with:
    input:
        clean=[f"{ROOT}/runs/{robust_run(m).directory}/model.pt" for m in MODELS],
        mixed=expand(f"{VARIED}/runs/{{model}}/model.pt", model=MODELS),
        descriptors=expand(
            f"{VARIED}/descriptors/{{trained_on}}.npz", trained_on=[CLEAN, MIXED]
        ),
        structure=varied_structure(),
        test=f"{ROOT}/frames/{ROBUSTNESS.scene}/test.npy",
        varied=expand(f"{VARIED}/frames/{{effects}}/test.npy", effects=ROBUST_EFFECTS),
        labels=expand(f"{ROOT}/labels/{ROBUST_SET}/{{split}}.csv", split=SPLITS),
    output:
        **table_files("robustness"),
    params:
        function="reproduction.tables.robustness:write_robustness_table",
        effects=ROBUST_EFFECTS,
        device=CONFIG.training.device,
