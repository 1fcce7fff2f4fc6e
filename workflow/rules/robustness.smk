# The same test paths in other light, through another camera (docs/variation.md): localizers trained
# on ideal frames, and once more on frames with all effects mixed in.
VARIED = f"{ROOT}/robustness"
ROBUST_SCENE = CONFIG.robustness.scene


use rule render_packed as render_varied with:
    input:
        extras=lambda w: FILES.varied_extras([w.effects]),
        mesh=f"{ROOT}/scenes/{ROBUST_SCENE}/mesh.glb",
        plan=f"{ROOT}/plans/{ROBUST_SCENE}/{{split}}.csv",
        detail=lambda w: FILES.varied_detail(w.effects, "glb") or [],
    output:
        frames=temp(f"{VARIED}/shards/{{effects}}/{{split}}.npy"),
        record=temp(f"{VARIED}/shards/{{effects}}/{{split}}.json"),
    log:
        f"{ROOT}/logs/render_varied/{{effects}}/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/render_varied/{{effects}}/{{split}}.tsv"
    params:
        start=0,
        stop=lambda w: FILES.robust_frames(w.split),
        render=lambda w: dump(FILES.varied_render(w.effects)),


use rule pack as pack_varied with:
    input:
        plan=f"{ROOT}/plans/{ROBUST_SCENE}/{{split}}.csv",
        shards=[f"{VARIED}/shards/{{effects}}/{{split}}.npy"],
        records=[f"{VARIED}/shards/{{effects}}/{{split}}.json"],
        detail=lambda w: FILES.varied_detail(w.effects, "json") or [],
    output:
        frames=f"{VARIED}/frames/{{effects}}/{{split}}.npy",
        record=f"{VARIED}/frames/{{effects}}/{{split}}.json",
    log:
        f"{ROOT}/logs/pack_varied/{{effects}}/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/pack_varied/{{effects}}/{{split}}.tsv"
    params:
        render=lambda w: dump(FILES.varied_render(w.effects)),


rule train_varied:
    input:
        frames=f"{VARIED}/frames/mixed/train.npy",
        labels=f"{ROOT}/labels/{FILES.robust_set}/train.csv",
        test_frames=f"{VARIED}/frames/mixed/test.npy",
        test_labels=f"{ROOT}/labels/{FILES.robust_set}/test.csv",
        weights=lambda w: FILES.weights(w.model, "pretrained") or [],
        records=expand(f"{VARIED}/frames/mixed/{{split}}.json", split=SPLITS),
    output:
        model=f"{VARIED}/runs/{{model}}/model.pt",
        history=f"{VARIED}/runs/{{model}}/history.csv",
        record=f"{VARIED}/runs/{{model}}/training.json",
        predictions=f"{VARIED}/runs/{{model}}/predictions.csv",
    log:
        f"{ROOT}/logs/train_varied/{{model}}.log",
    benchmark:
        f"{ROOT}/benchmarks/train_varied/{{model}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=lambda w, attempt: attempt
        * training_mb(
            FILES.n_of_size(ROBUST_SCENE, CONFIG.robustness.size),
            CONFIG.network,
            CONFIG.training.batch_size,
        ),
        gpu_percent=lambda w: training_percent(
            FILES.n_of_size(ROBUST_SCENE, CONFIG.robustness.size),
            CONFIG.network,
            CONFIG.training.batch_size,
            TRAINING_CARD_MB,
        ),
    params:
        run=lambda w: training_parameters(CONFIG, FILES.robust_run(w.model)),
    script:
        "../scripts/run_train_varied.py"


# Vectors of the ideal and of the varied frames: what the map of each training set is searched by.
rule varied_descriptors:
    input:
        **{
            CLEAN: f"{ROOT}/frames/{ROBUST_SCENE}/test.npy",
            **{n: f"{VARIED}/frames/{n}/test.npy" for n in FILES.tested_effects},
            "train": lambda w: (
                f"{VARIED}/frames/{MIXED}/train.npy"
                if w.trained_on == MIXED
                else f"{ROOT}/frames/{ROBUST_SCENE}/train.npy"
            ),
        },
    output:
        descriptors=f"{VARIED}/descriptors/{{trained_on}}.npz",
    log:
        f"{ROOT}/logs/varied_descriptors/{{trained_on}}.log",
    benchmark:
        f"{ROOT}/benchmarks/varied_descriptors/{{trained_on}}.tsv"
    wildcard_constraints:
        trained_on=f"{CLEAN}|{MIXED}",
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(3000),
    params:
        counts={
            **dict.fromkeys(
                [CLEAN, *FILES.tested_effects], FILES.robust_frames("test")
            ),
            "train": FILES.robust_frames("train"),
        },
        learned_from=FILES.smallest_train(ROBUST_SCENE),
        seed=seed_of(CONFIG.seed, "descriptors", ROBUST_SCENE),
    script:
        "../scripts/run_varied_descriptors.py"


# A sample of the test frames, large enough for features, against the map of the ideal frames.
rule varied_structure:
    input:
        extras=lambda w: FILES.varied_extras([w.effects]),
        mesh=f"{ROOT}/scenes/{ROBUST_SCENE}/mesh.glb",
        plan=f"{ROOT}/plans/{ROBUST_SCENE}/test.csv",
        descriptors=f"{VARIED}/descriptors/clean.npz",
        features=f"{ROOT}/references/{ROBUST_SCENE}/{CONFIG.robustness.size}/features-train.npz",
        labels=f"{ROOT}/labels/{FILES.robust_set}/train.csv",
    output:
        predictions=f"{VARIED}/structure/{{effects}}.csv",
    log:
        f"{ROOT}/logs/varied_structure/{{effects}}.log",
    benchmark:
        f"{ROOT}/benchmarks/varied_structure/{{effects}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(3000),
    params:
        n_test=FILES.robust_frames("test"),
        sample=CONFIG.robustness.structure_frames,
        camera=dump(CONFIG.estimation_camera),
        render=lambda w: dump(FILES.varied_render(w.effects)),
        references=dump(
            CONFIG.references, include={"max_features", "contrast", "retrieved"}
        ),
        seed=seed_of(CONFIG.seed, "references", *FILES.robust_set.split("/")),
    script:
        "../scripts/run_varied_structure.py"


rule effects_speed:
    input:
        extras=FILES.varied_extras(FILES.variations),
        mesh=f"{ROOT}/scenes/{ROBUST_SCENE}/mesh.glb",
        plan=f"{ROOT}/plans/{ROBUST_SCENE}/test.csv",
    output:
        csv=f"{ROOT}/scenes/{ROBUST_SCENE}/effects_speed.csv",
    log:
        f"{ROOT}/logs/effects_speed.log",
    benchmark:
        f"{ROOT}/benchmarks/effects_speed.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(3000),
    params:
        camera=dump(CONFIG.network_camera),
        render=dump(CONFIG.render),
        effects={name: dump(FILES.variations[name]) for name in FILES.tested_effects},
    script:
        "../scripts/run_effects_speed.py"


rule robustness:
    input:
        clean=[f"{ROOT}/runs/{FILES.robust_run(m).directory}/model.pt" for m in MODELS],
        mixed=expand(f"{VARIED}/runs/{{model}}/model.pt", model=MODELS),
        descriptors=expand(
            f"{VARIED}/descriptors/{{trained_on}}.npz", trained_on=[CLEAN, MIXED]
        ),
        structure=FILES.varied_structure(),
        test=f"{ROOT}/frames/{ROBUST_SCENE}/test.npy",
        varied=expand(
            f"{VARIED}/frames/{{effects}}/test.npy", effects=FILES.tested_effects
        ),
        labels=expand(f"{ROOT}/labels/{FILES.robust_set}/{{split}}.csv", split=SPLITS),
    output:
        csv=f"{VARIED}/{ROBUST_SCENE}.csv",
    log:
        f"{ROOT}/logs/robustness.log",
    benchmark:
        f"{ROOT}/benchmarks/robustness.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(2000),
    params:
        effects=FILES.tested_effects,
        device=CONFIG.training.device,
    script:
        "../scripts/run_robustness.py"
