# The same test paths in other light, through another camera (docs/variation.md): localizers trained
# on ideal frames, and once more on frames with all effects mixed in.
VARIED = f"{ROOT}/robustness"


# How much of its light comes from where: for light states, of stand-ins alone.
rule light_shares:
    output:
        shares=expand(
            f"{ROOT}/scenes/{{{{scene}}}}/light_{{group}}.glb", group=LIGHT_GROUPS
        ),
    log:
        f"{ROOT}/logs/light_shares/{{scene}}.log",
    benchmark:
        f"{ROOT}/benchmarks/light_shares/{{scene}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(4000),
    params:
        builder=lambda w: CONFIG.scenes[w.scene].builder,
        seed=lambda w: scene_seed(w.scene),
    script:
        "../scripts/light_shares.py"


rule render_varied:
    input:
        light=lambda w: shares_for(ROBUSTNESS.scene, varied_effects(w)),
        mesh=f"{ROOT}/scenes/{ROBUSTNESS.scene}/mesh.glb",
        plan=f"{ROOT}/plans/{ROBUSTNESS.scene}/{{split}}.csv",
    output:
        frames=temp(f"{VARIED}/shards/{{effects}}/{{split}}.npy"),
        record=temp(f"{VARIED}/shards/{{effects}}/{{split}}.json"),
    log:
        f"{ROOT}/logs/render_varied/{{effects}}/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/render_varied/{{effects}}/{{split}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(3000),
    params:
        camera=dump(CONFIG.network_camera),
        start=0,
        stop=lambda w: CONFIG.n_frames(ROBUSTNESS.scene, ROBUSTNESS.size, w.split),
        input_px=CONFIG.network.input_px,
        view=CONFIG.network.view,
        render=varied_render,
    script:
        "../scripts/render_packed.py"


rule pack_varied:
    input:
        plan=f"{ROOT}/plans/{ROBUSTNESS.scene}/{{split}}.csv",
        shards=[f"{VARIED}/shards/{{effects}}/{{split}}.npy"],
        records=[f"{VARIED}/shards/{{effects}}/{{split}}.json"],
    output:
        frames=f"{VARIED}/frames/{{effects}}/{{split}}.npy",
        record=f"{VARIED}/frames/{{effects}}/{{split}}.json",
    log:
        f"{ROOT}/logs/pack_varied/{{effects}}/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/pack_varied/{{effects}}/{{split}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(2000),
    params:
        camera=dump(CONFIG.network_camera),
        render=varied_render,
        view=CONFIG.network.view,
    script:
        "../scripts/pack.py"


rule train_varied:
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
    log:
        f"{ROOT}/logs/train_varied/{{model}}.log",
    benchmark:
        f"{ROOT}/benchmarks/train_varied/{{model}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=lambda w, attempt: attempt
        * training_mb(
            sum(
                CONFIG.n_frames(ROBUSTNESS.scene, ROBUSTNESS.size, split)
                for split in SPLITS
            ),
            CONFIG.network,
            CONFIG.training.batch_size,
        ),
    params:
        run=lambda w: training_parameters(CONFIG, robust_run(w.model)),
    script:
        "../scripts/train.py"


rule robustness:
    input:
        clean=[f"{ROOT}/runs/{robust_run(m).directory}/model.pt" for m in MODELS],
        mixed=expand(f"{VARIED}/runs/{{model}}/model.pt", model=MODELS),
        train=f"{ROOT}/frames/{ROBUSTNESS.scene}/train.npy",
        mixed_train=f"{VARIED}/frames/mixed/train.npy",
        test=f"{ROOT}/frames/{ROBUSTNESS.scene}/test.npy",
        varied=expand(f"{VARIED}/frames/{{effects}}/test.npy", effects=ROBUST_EFFECTS),
        labels=expand(f"{ROOT}/labels/{ROBUST_SET}/{{split}}.csv", split=SPLITS),
    output:
        csv=report(
            f"{ROOT}/tables/robustness.csv",
            caption="../report/table.rst",
            category="Tables",
        ),
        tex=f"{ROOT}/tables/robustness.tex",
    log:
        f"{ROOT}/logs/tables/robustness.log",
    benchmark:
        f"{ROOT}/benchmarks/tables/robustness.tsv"
    conda:
        "../envs/synfeal.yaml"
    threads: 1
    resources:
        mem_mb=grown(2000),
    params:
        effects=ROBUST_EFFECTS,
        device=CONFIG.training.device,
    script:
        "../scripts/robustness.py"
