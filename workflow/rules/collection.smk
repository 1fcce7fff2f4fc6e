# Mesh in, data sets with exact poses out (section 3 of the paper).


rule scene:
    input:
        mesh=lambda w: CONFIG.scenes[w.scene].path or [],
    output:
        mesh=f"{ROOT}/scenes/{{scene}}/mesh.glb",
        collision=f"{ROOT}/scenes/{{scene}}/collision.ply",
        curve=f"{ROOT}/scenes/{{scene}}/collision_curve.csv",
        clutter=f"{ROOT}/scenes/{{scene}}/clutter.json",
        properties=f"{ROOT}/scenes/{{scene}}/properties.json",
    log:
        f"{ROOT}/logs/scene/{{scene}}.log",
    benchmark:
        f"{ROOT}/benchmarks/scene/{{scene}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(4000),
    params:
        name=lambda w: w.scene,
        scene=lambda w, input: dump(CONFIG.scenes[w.scene], exclude={"sizes"})
        | {"path": file_of(input.mesh)},
        collision_agreement=CONFIG.collection.collision_agreement,
        seed=CONFIG.seed,
        shade=CONFIG.render.shade,
    script:
        "../scripts/run_scene.py"


rule plan:
    input:
        collision=rules.scene.output.collision,
        repeat=CONFIG.collection.repeat or [],
    output:
        plan=f"{ROOT}/plans/{{scene}}/{{split}}.csv",
    log:
        f"{ROOT}/logs/plan/{{scene}}/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/plan/{{scene}}/{{split}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(2000),
    params:
        scene=lambda w: dump(CONFIG.scenes[w.scene], exclude={"sizes"}),
        collection=lambda w, input: dump(CONFIG.collection)
        | {"repeat": file_of(input.repeat)},
        n_frames=lambda w: CONFIG.n_largest(w.scene, w.split),
        seed=lambda w: seed_of(CONFIG.seed, "plan", w.scene, w.split),
    script:
        "../scripts/run_plan.py"


rule coverage:
    input:
        collision=rules.scene.output.collision,
        plan=rules.plan.output.plan,
    output:
        coverage=f"{ROOT}/plans/{{scene}}/{{split}}.coverage.json",
    log:
        f"{ROOT}/logs/coverage/{{scene}}/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/coverage/{{scene}}/{{split}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        scene=lambda w: dump(CONFIG.scenes[w.scene], exclude={"sizes"}),
        camera=dump(CONFIG.network_camera),
    script:
        "../scripts/run_coverage.py"


# What test frames show, at a few points of each: for the reprojection error of predicted poses.
rule cell_depth:
    input:
        collision=rules.scene.output.collision,
        plan=f"{ROOT}/plans/{{scene}}/test.csv",
    output:
        depth=f"{ROOT}/scenes/{{scene}}/test_depth.npy",
    log:
        f"{ROOT}/logs/cell_depth/{{scene}}.log",
    benchmark:
        f"{ROOT}/benchmarks/cell_depth/{{scene}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        camera=dump(CONFIG.network_camera),
    script:
        "../scripts/run_cell_depth.py"


ARCHIVE = SUFFIX if CONFIG.archive_sequences else ""
SEQUENCE = f"{ROOT}/datasets/{{scene}}/{{camera}}/{{sequence}}{ARCHIVE}"


# The mesh that frames of a camera are drawn of: what its resolution does not show is left out.
rule detail:
    input:
        mesh=rules.scene.output.mesh,
        plans=lambda w: FILES.plans(w.scene, w.camera, "csv"),
    output:
        mesh=f"{ROOT}/scenes/{{scene}}/detail_{{camera}}.glb",
        record=f"{ROOT}/scenes/{{scene}}/detail_{{camera}}.json",
    log:
        f"{ROOT}/logs/detail/{{scene}}/detail_{{camera}}.log",
    benchmark:
        f"{ROOT}/benchmarks/detail/{{scene}}/detail_{{camera}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(3000),
    params:
        camera=lambda w: dump(getattr(CONFIG, f"{w.camera}_camera")),
        render=dump(CONFIG.render),
    script:
        "../scripts/run_detail.py"


rule render:
    input:
        mesh=rules.scene.output.mesh,
        plan=lambda w: f"{ROOT}/plans/{w.scene}/{FILES.sequence(w.scene, w.camera, w.sequence).split}.csv",
        extras=lambda w: FILES.beside_mesh(w.scene, CONFIG.render.effects),
        detail=lambda w: FILES.detail(w.scene, w.camera, "glb") or [],
    output:
        frames=SEQUENCE if ARCHIVE else directory(SEQUENCE),
    log:
        f"{ROOT}/logs/render/{{scene}}/{{camera}}/{{sequence}}.log",
    benchmark:
        f"{ROOT}/benchmarks/render/{{scene}}/{{camera}}/{{sequence}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(3000),
        gpu_percent=rendering_percent(DRAWING_CARD_MB),
    params:
        camera=lambda w: dump(getattr(CONFIG, f"{w.camera}_camera")),
        start=lambda w: FILES.sequence(w.scene, w.camera, w.sequence).start,
        stop=lambda w: FILES.sequence(w.scene, w.camera, w.sequence).stop,
        with_depth=lambda w: w.camera == "estimation" or CONFIG.network_depth,
        with_normals=lambda w: w.camera == "network" and CONFIG.network_normals,
        with_masks=lambda w: w.camera == "network" and CONFIG.network_masks,
        render=dump(CONFIG.render),
    script:
        "../scripts/run_render.py"


# How much of its light comes from where: for light states, of stand-ins alone.
rule light_shares:
    output:
        shares=[
            file.as_posix()
            for file in light_share_files(Path(rules.scene.output.mesh)).values()
        ],
    log:
        f"{ROOT}/logs/light_shares/{{scene}}.log",
    benchmark:
        f"{ROOT}/benchmarks/light_shares/{{scene}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(4000),
    params:
        builder=lambda w: CONFIG.scenes[w.scene].builder,
        seed=lambda w: (
            CONFIG.seed
            if CONFIG.scenes[w.scene].seed is None
            else CONFIG.scenes[w.scene].seed
        ),
    script:
        "../scripts/run_light_shares.py"


# Built-in objects, where effects place some along every path.
rule cartons:
    input:
        mesh=rules.scene.output.mesh,
    output:
        cartons=FILES.cartons("{scene}"),
    log:
        f"{ROOT}/logs/cartons/{{scene}}.log",
    benchmark:
        f"{ROOT}/benchmarks/cartons/{{scene}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    script:
        "../scripts/run_cartons.py"


rule render_speed:
    input:
        mesh=rules.scene.output.mesh,
        plan=f"{ROOT}/plans/{{scene}}/test.csv",
        details=lambda w: FILES.details(w.scene, "glb"),
        records=lambda w: FILES.details(w.scene, "json"),
    output:
        speed=f"{ROOT}/scenes/{{scene}}/render_speed.csv",
    log:
        f"{ROOT}/logs/render_speed/{{scene}}.log",
    benchmark:
        f"{ROOT}/benchmarks/render_speed/{{scene}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(3000),
    params:
        cameras=lambda w: [
            dump(getattr(CONFIG, f"{name}_camera")) for name in FILES.cameras(w.scene)
        ],
        render_speed=dump(CONFIG.render_speed),
        render=dump(CONFIG.render),
    script:
        "../scripts/run_render_speed.py"


rule collection_speed:
    input:
        mesh=rules.scene.output.mesh,
        collision=rules.scene.output.collision,
        repeat=CONFIG.collection.repeat or [],
    output:
        speed=f"{ROOT}/scenes/{{scene}}/collection_speed.json",
    log:
        f"{ROOT}/logs/collection_speed/{{scene}}.log",
    benchmark:
        f"{ROOT}/benchmarks/collection_speed/{{scene}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(3000),
    params:
        scene=lambda w: dump(CONFIG.scenes[w.scene], exclude={"sizes"}),
        collection=lambda w, input: dump(CONFIG.collection)
        | {"repeat": file_of(input.repeat)},
        render=dump(CONFIG.render),
        seed=lambda w: seed_of(CONFIG.seed, "collection speed", w.scene),
    script:
        "../scripts/run_collection_speed.py"


# What the localizers see goes from the renderer straight into an array, not through image files.
rule render_packed:
    input:
        mesh=rules.scene.output.mesh,
        plan=lambda w: f"{ROOT}/plans/{w.scene}/{FILES.sequence(w.scene, 'network', w.sequence).split}.csv",
        extras=lambda w: FILES.beside_mesh(w.scene, CONFIG.render.effects),
        detail=lambda w: FILES.detail(w.scene, "network", "glb") or [],
    output:
        frames=temp(f"{ROOT}/frames/{{scene}}/shards/{{sequence}}.npy"),
        record=temp(f"{ROOT}/frames/{{scene}}/shards/{{sequence}}.json"),
    log:
        f"{ROOT}/logs/render_packed/{{scene}}/{{sequence}}.log",
    benchmark:
        f"{ROOT}/benchmarks/render_packed/{{scene}}/{{sequence}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(3000),
        gpu_percent=rendering_percent(DRAWING_CARD_MB),
    params:
        camera=dump(CONFIG.network_camera),
        start=lambda w: FILES.sequence(w.scene, "network", w.sequence).start,
        stop=lambda w: FILES.sequence(w.scene, "network", w.sequence).stop,
        input_px=CONFIG.network.input_px,
        view=CONFIG.network.view,
        render=dump(CONFIG.render),
    script:
        "../scripts/run_render_packed.py"


rule pack:
    input:
        plan=rules.plan.output.plan,
        shards=lambda w: FILES.packed_shards(w.scene, w.split, "npy"),
        records=lambda w: FILES.packed_shards(w.scene, w.split, "json"),
        detail=lambda w: FILES.detail(w.scene, "network", "json") or [],
    output:
        frames=f"{ROOT}/frames/{{scene}}/{{split}}.npy",
        record=f"{ROOT}/frames/{{scene}}/{{split}}.json",
    log:
        f"{ROOT}/logs/pack/{{scene}}/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/pack/{{scene}}/{{split}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(2000),
    params:
        camera=dump(CONFIG.network_camera),
        render=dump(CONFIG.render),
        view=CONFIG.network.view,
    script:
        "../scripts/run_pack.py"


rule dataset:
    input:
        mesh=rules.scene.output.mesh,
        sequences=lambda w: FILES.sequence_dirs(w.scene, w.camera),
        plans=lambda w: FILES.plans(w.scene, w.camera, "csv"),
        coverage=lambda w: FILES.plans(w.scene, w.camera, "coverage.json"),
        extras=lambda w: FILES.beside_mesh(w.scene, CONFIG.render.effects),
        clutter=lambda w: (
            [f"{ROOT}/scenes/{w.scene}/clutter.json"]
            if CONFIG.scenes[w.scene].clutter
            else []
        ),
        detail=lambda w: FILES.detail(w.scene, w.camera, "json") or [],
    output:
        manifest=f"{ROOT}/datasets/{{scene}}/{{camera}}/manifest.json",
        train=f"{ROOT}/datasets/{{scene}}/{{camera}}/TrainSplit.txt",
        test=f"{ROOT}/datasets/{{scene}}/{{camera}}/TestSplit.txt",
        preview=f"{ROOT}/datasets/{{scene}}/{{camera}}/preview.png",
        poses=[
            f"{ROOT}/datasets/{{scene}}/{{camera}}/{split}.csv"
            for split in SPLITS
            if all(CONFIG.n_largest(scene, split) for scene in CONFIG.scenes)
        ],
    log:
        f"{ROOT}/logs/dataset/{{scene}}/{{camera}}.log",
    benchmark:
        f"{ROOT}/benchmarks/dataset/{{scene}}/{{camera}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        camera=lambda w: dump(getattr(CONFIG, f"{w.camera}_camera")),
        counts=lambda w: {s: FILES.n_frames(w.scene, w.camera, s) for s in SPLITS},
        shard_frames=CONFIG.shard_frames,
        origin=lambda w: CONFIG.origin_of(w.scene),
    script:
        "../scripts/run_dataset.py"


rule true_labels:
    input:
        plan=f"{ROOT}/plans/{{scene}}/{{split}}.csv",
    output:
        labels=f"{ROOT}/labels/{{scene}}/{{size}}/synfeal/{{split}}.csv",
    log:
        f"{ROOT}/logs/labels/{{scene}}/{{size}}/synfeal/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/labels/{{scene}}/{{size}}/synfeal/{{split}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    params:
        n_frames=lambda w: CONFIG.n_frames(w.scene, w.size, w.split),
    script:
        "../scripts/run_true_labels.py"
