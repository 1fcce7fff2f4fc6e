# Mesh in, data sets with exact poses out (section 3 of the paper).


# A job that calls one function, `params.function`, with the rule's files, parameters and wildcards
# (reproduction.runs.job.call); rules that add nothing else are `use rule call as ... with`.
rule call:
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(1000),
    script:
        "../scripts/call.py"


use rule call as call_2gb with:
    resources:
        mem_mb=grown(2000),


use rule call as call_3gb with:
    resources:
        mem_mb=grown(3000),


use rule call as call_4gb with:
    resources:
        mem_mb=grown(4000),


use rule call_4gb as scene with:
    input:
        mesh=lambda w: CONFIG.scenes[w.scene].path or [],
    output:
        mesh=f"{ROOT}/scenes/{{scene}}/mesh.glb",
        collision=f"{ROOT}/scenes/{{scene}}/collision.ply",
        curve=f"{ROOT}/scenes/{{scene}}/collision_curve.csv",
        clutter=f"{ROOT}/scenes/{{scene}}/clutter.json",
        properties=f"{ROOT}/scenes/{{scene}}/properties.json",
    params:
        function="synfeal.collection.prepare:prepare_scene",
        name=lambda w: w.scene,
        scene=lambda w, input: dump(CONFIG.scenes[w.scene], exclude={"sizes"})
        | {"path": file_of(input.mesh)},
        collision_agreement=CONFIG.collection.collision_agreement,
        seed=CONFIG.seed,


use rule call_2gb as plan with:
    input:
        collision=rules.scene.output.collision,
        repeat=CONFIG.collection.repeat or [],
    output:
        plan=f"{ROOT}/plans/{{scene}}/{{split}}.csv",
    params:
        function="synfeal.planning.plan:write_plan",
        scene=lambda w: dump(CONFIG.scenes[w.scene], exclude={"sizes"}),
        collection=lambda w, input: dump(CONFIG.collection)
        | {"repeat": file_of(input.repeat)},
        n_frames=lambda w: CONFIG.n_largest(w.scene, w.split),
        seed=lambda w: seed_of(CONFIG.seed, "plan", w.scene, w.split),


use rule call as coverage with:
    input:
        collision=rules.scene.output.collision,
        plan=rules.plan.output.plan,
    output:
        coverage=f"{ROOT}/plans/{{scene}}/{{split}}.coverage.json",
    params:
        function="synfeal.planning.coverage:write_coverage",
        scene=lambda w: dump(CONFIG.scenes[w.scene], exclude={"sizes"}),
        camera=dump(CONFIG.network_camera),


# What test frames show, at a few points of each: for the reprojection error of predicted poses.
use rule call as cell_depth with:
    input:
        collision=rules.scene.output.collision,
        plan=f"{ROOT}/plans/{{scene}}/test.csv",
    output:
        depth=f"{ROOT}/scenes/{{scene}}/test_depth.npy",
    params:
        function="synfeal.evaluation.reprojection:write_scene_depth",
        camera=dump(CONFIG.network_camera),


SEQUENCE = f"{ROOT}/datasets/{{scene}}/{{camera}}/{{sequence}}{ARCHIVE}"


# The mesh that frames of a camera are drawn of: what its resolution does not show is left out.
use rule call_3gb as detail with:
    input:
        mesh=rules.scene.output.mesh,
        plans=lambda w: plans_with_frames(w.scene, w.camera, "csv"),
    output:
        mesh=f"{ROOT}/scenes/{{scene}}/detail_{{camera}}.glb",
        record=f"{ROOT}/scenes/{{scene}}/detail_{{camera}}.json",
    params:
        function="synfeal.collection.detail:write_detail",
        camera=lambda w: dump(getattr(CONFIG, f"{w.camera}_camera")),
        render=dump(CONFIG.render),


use rule call_3gb as render with:
    input:
        mesh=rules.scene.output.mesh,
        plan=lambda w: f"{ROOT}/plans/{w.scene}/{sequence_named(w).split}.csv",
        extras=lambda w: beside_mesh(w.scene, CONFIG.render.effects),
        detail=lambda w: detail_of(w.scene, w.camera, "glb"),
    output:
        frames=SEQUENCE if ARCHIVE else directory(SEQUENCE),
    params:
        function="synfeal.dataset.render_sequence:render_sequence",
        camera=lambda w: dump(getattr(CONFIG, f"{w.camera}_camera")),
        start=lambda w: sequence_named(w).start,
        stop=lambda w: sequence_named(w).stop,
        with_depth=lambda w: w.camera == "groundtruth" or CONFIG.network_depth,
        render=dump(CONFIG.render),


# How much of its light comes from where: for light states, of stand-ins alone.
use rule call_4gb as light_shares with:
    output:
        shares=expand(
            f"{ROOT}/scenes/{{{{scene}}}}/light_{{group}}.glb", group=LIGHT_GROUPS
        ),
    params:
        function="reproduction.rooms:save_light_shares",
        builder=lambda w: CONFIG.scenes[w.scene].builder,
        seed=lambda w: (
            CONFIG.seed
            if CONFIG.scenes[w.scene].seed is None
            else CONFIG.scenes[w.scene].seed
        ),


# Built-in objects, where effects place some along every path.
use rule call as cartons with:
    input:
        mesh=rules.scene.output.mesh,
    output:
        cartons=cartons_of("{scene}"),
    params:
        function="synfeal.collection.prepare:save_cartons",


use rule call_3gb as render_speed with:
    input:
        mesh=rules.scene.output.mesh,
        plan=f"{ROOT}/plans/{{scene}}/test.csv",
    output:
        speed=f"{ROOT}/scenes/{{scene}}/render_speed.csv",
    params:
        function="reproduction.speed.rendering:write_render_speed",
        network_camera=dump(CONFIG.network_camera),
        groundtruth_camera=dump(CONFIG.groundtruth_camera),
        render_speed=dump(CONFIG.render_speed),
        render=dump(CONFIG.render),


use rule call_3gb as collection_speed with:
    input:
        mesh=rules.scene.output.mesh,
        collision=rules.scene.output.collision,
        repeat=CONFIG.collection.repeat or [],
    output:
        speed=f"{ROOT}/scenes/{{scene}}/collection_speed.json",
    params:
        function="reproduction.speed.collection:write_collection_speed",
        scene=lambda w: dump(CONFIG.scenes[w.scene], exclude={"sizes"}),
        collection=lambda w, input: dump(CONFIG.collection)
        | {"repeat": file_of(input.repeat)},
        render=dump(CONFIG.render),
        seed=lambda w: seed_of(CONFIG.seed, "collection speed", w.scene),


# What the localizers see goes from the renderer straight into an array, not through image files.
use rule call_3gb as render_packed with:
    input:
        mesh=rules.scene.output.mesh,
        plan=lambda w: f"{ROOT}/plans/{w.scene}/{sequence_named(w, 'network').split}.csv",
        extras=lambda w: beside_mesh(w.scene, CONFIG.render.effects),
        detail=lambda w: detail_of(w.scene, "network", "glb"),
    output:
        frames=temp(f"{ROOT}/frames/{{scene}}/shards/{{sequence}}.npy"),
        record=temp(f"{ROOT}/frames/{{scene}}/shards/{{sequence}}.json"),
    params:
        function="synfeal.dataset.render_sequence:render_packed",
        camera=dump(CONFIG.network_camera),
        start=lambda w: sequence_named(w, "network").start,
        stop=lambda w: sequence_named(w, "network").stop,
        input_px=CONFIG.network.input_px,
        view=CONFIG.network.view,
        render=dump(CONFIG.render),


use rule call_2gb as pack with:
    input:
        plan=rules.plan.output.plan,
        shards=lambda w: packed_shards(w.scene, w.split, "npy"),
        records=lambda w: packed_shards(w.scene, w.split, "json"),
        detail=lambda w: detail_of(w.scene, "network", "json"),
    output:
        frames=f"{ROOT}/frames/{{scene}}/{{split}}.npy",
        record=f"{ROOT}/frames/{{scene}}/{{split}}.json",
    params:
        function="synfeal.dataset.packed:write_packed",
        camera=dump(CONFIG.network_camera),
        render=dump(CONFIG.render),
        view=CONFIG.network.view,


use rule call as dataset with:
    input:
        mesh=rules.scene.output.mesh,
        sequences=lambda w: sequence_dirs(w.scene, w.camera),
        plans=lambda w: plans_with_frames(w.scene, w.camera, "csv"),
        coverage=lambda w: plans_with_frames(w.scene, w.camera, "coverage.json"),
        extras=lambda w: beside_mesh(w.scene, CONFIG.render.effects),
        clutter=lambda w: (
            [f"{ROOT}/scenes/{w.scene}/clutter.json"]
            if CONFIG.scenes[w.scene].clutter
            else []
        ),
        detail=lambda w: detail_of(w.scene, w.camera, "json"),
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
    params:
        function="synfeal.dataset.finish:finish_dataset",
        camera=lambda w: dump(getattr(CONFIG, f"{w.camera}_camera")),
        counts=lambda w: {s: n_frames(w.scene, w.camera, s) for s in SPLITS},
        shard_frames=CONFIG.shard_frames,
        origin=lambda w: origin_of(CONFIG, w.scene),


use rule call as true_labels with:
    input:
        plan=f"{ROOT}/plans/{{scene}}/{{split}}.csv",
    output:
        labels=f"{ROOT}/labels/{{scene}}/{{size}}/synfeal/{{split}}.csv",
    log:
        f"{ROOT}/logs/labels/{{scene}}/{{size}}/synfeal/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/labels/{{scene}}/{{size}}/synfeal/{{split}}.tsv"
    params:
        function="synfeal.dataset.pose_table:write_first_frames",
        n_frames=lambda w: CONFIG.n_frames(w.scene, w.size, w.split),
