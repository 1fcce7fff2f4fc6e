# Mesh in, data sets with exact poses out (section 3 of the paper).


rule scene:
    input:
        lambda w: CONFIG.scenes[w.scene].path or [],
    output:
        mesh=f"{ROOT}/scenes/{{scene}}/mesh.glb",
        collision=f"{ROOT}/scenes/{{scene}}/collision.ply",
        properties=f"{ROOT}/scenes/{{scene}}/properties.json",
    params:
        scene=lambda w: dump(CONFIG.scenes[w.scene], exclude={"sizes"}),
        collision_faces=CONFIG.collection.collision_faces,
        seed=CONFIG.seed,
    log:
        f"{ROOT}/logs/scene/{{scene}}.log",
    benchmark:
        f"{ROOT}/benchmarks/scene/{{scene}}.tsv"
    threads: 1
    resources:
        mem_mb=4000,
    conda:
        "../envs/synfeal.yaml"
    script:
        "../scripts/scene.py"


rule plan:
    input:
        collision=rules.scene.output.collision,
    output:
        plan=f"{ROOT}/plans/{{scene}}/{{split}}.csv",
    params:
        scene=lambda w: dump(CONFIG.scenes[w.scene], exclude={"sizes"}),
        collection=dump(CONFIG.collection),
        n_frames=lambda w: CONFIG.n_largest(w.scene, w.split),
        seed=lambda w: seed_of(CONFIG.seed, "plan", w.scene, w.split),
    log:
        f"{ROOT}/logs/plan/{{scene}}/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/plan/{{scene}}/{{split}}.tsv"
    threads: 1
    resources:
        mem_mb=2000,
    conda:
        "../envs/synfeal.yaml"
    script:
        "../scripts/plan.py"


rule render:
    input:
        mesh=rules.scene.output.mesh,
        plan=lambda w: f"{ROOT}/plans/{w.scene}/{sequence_named(w).split}.csv",
    output:
        frames=directory(f"{ROOT}/datasets/{{scene}}/{{camera}}/{{sequence}}"),
    params:
        camera=lambda w: dump(getattr(CONFIG, f"{w.camera}_camera")),
        start=lambda w: sequence_named(w).start,
        stop=lambda w: sequence_named(w).stop,
        with_depth=lambda w: w.camera == "groundtruth",
    log:
        f"{ROOT}/logs/render/{{scene}}/{{camera}}/{{sequence}}.log",
    benchmark:
        f"{ROOT}/benchmarks/render/{{scene}}/{{camera}}/{{sequence}}.tsv"
    threads: 1
    resources:
        mem_mb=3000,
    conda:
        "../envs/synfeal.yaml"
    script:
        "../scripts/render.py"


rule dataset:
    input:
        sequences=lambda w: sequence_dirs(w.scene, w.camera),
    output:
        manifest=f"{ROOT}/datasets/{{scene}}/{{camera}}/manifest.json",
        train=f"{ROOT}/datasets/{{scene}}/{{camera}}/TrainSplit.txt",
        test=f"{ROOT}/datasets/{{scene}}/{{camera}}/TestSplit.txt",
    params:
        camera=lambda w: dump(getattr(CONFIG, f"{w.camera}_camera")),
        counts=lambda w: [n_frames(w.scene, w.camera, split) for split in SPLITS],
        shard_frames=CONFIG.shard_frames,
        seed=CONFIG.seed,
    log:
        f"{ROOT}/logs/dataset/{{scene}}/{{camera}}.log",
    benchmark:
        f"{ROOT}/benchmarks/dataset/{{scene}}/{{camera}}.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    conda:
        "../envs/synfeal.yaml"
    script:
        "../scripts/dataset.py"


rule pack:
    input:
        sequences=lambda w: sequence_dirs(w.scene, "network", w.split),
    output:
        frames=f"{ROOT}/frames/{{scene}}/{{split}}.npy",
    params:
        input_px=CONFIG.network.input_px,
    log:
        f"{ROOT}/logs/pack/{{scene}}/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/pack/{{scene}}/{{split}}.tsv"
    threads: 1
    resources:
        mem_mb=2000,
    conda:
        "../envs/synfeal.yaml"
    script:
        "../scripts/pack.py"


rule true_labels:
    input:
        plan=f"{ROOT}/plans/{{scene}}/{{split}}.csv",
    output:
        labels=f"{ROOT}/labels/{{scene}}/{{size}}/synfeal/{{split}}.csv",
    params:
        n_frames=lambda w: CONFIG.n_frames(w.scene, w.size, w.split),
    log:
        f"{ROOT}/logs/labels/{{scene}}/{{size}}/synfeal/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/labels/{{scene}}/{{size}}/synfeal/{{split}}.tsv"
    threads: 1
    resources:
        mem_mb=1000,
    conda:
        "../envs/synfeal.yaml"
    script:
        "../scripts/true_labels.py"
