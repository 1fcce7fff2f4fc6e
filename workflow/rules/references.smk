# What localizers are compared with. Descriptors, features and matches depend on images alone: they
# are found once per scene or data set and serve all of its label sets.
FOUND = f"{ROOT}/references/{{scene}}/{{size}}"
REFERENCE = f"{FOUND}/{{labels}}"
REFERENCE_LOG = "{scene}/{size}/{labels}"
STRUCTURE = {n: f"{FOUND}/{n}.npz" for n in ("correspondences", "tracks")}


use rule call_3gb as descriptors with:
    input:
        train=f"{ROOT}/frames/{{scene}}/train.npy",
        test=f"{ROOT}/frames/{{scene}}/test.npy",
    output:
        descriptors=f"{ROOT}/references/{{scene}}/descriptors.npz",
    params:
        function="baselines.references.descriptors:write_descriptors",
        learned_from=lambda w: smallest_train(w.scene),
        seed=lambda w: seed_of(CONFIG.seed, "descriptors", w.scene),


use rule call_3gb as features with:
    input:
        sequences=lambda w: sequence_dirs(
            w.scene,
            "groundtruth",
            w.split,
            CONFIG.n_frames(w.scene, w.size, w.split),
        ),
    output:
        features=temp(f"{FOUND}/features-{{split}}.npz"),
    log:
        f"{ROOT}/logs/features/{{scene}}/{{size}}/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/features/{{scene}}/{{size}}/{{split}}.tsv"
    params:
        function="baselines.references.features:write_features",
        n_frames=lambda w: CONFIG.n_frames(w.scene, w.size, w.split),
        camera=dump(CONFIG.groundtruth_camera),
        references=dump(CONFIG.references, exclude={"coordinate_samples"}),


use rule call_3gb as correspondences with:
    input:
        descriptors=rules.descriptors.output.descriptors,
        train=f"{FOUND}/features-train.npz",
        test=f"{FOUND}/features-test.npz",
    output:
        matches=f"{FOUND}/correspondences.npz",
    params:
        function="baselines.references.correspondences:write_matches",
        retrieved=CONFIG.references.retrieved,


use rule call_3gb as tracks with:
    input:
        descriptors=rules.descriptors.output.descriptors,
        train=f"{FOUND}/features-train.npz",
    output:
        tracks=f"{FOUND}/tracks.npz",
    params:
        function="baselines.references.correspondences:write_tracks",


use rule call_2gb as image_references with:
    input:
        **evidence_for(
            in_group("images"),
            descriptors=f"{ROOT}/references/{{scene}}/descriptors.npz",
        ),
    output:
        references=reference_files(REFERENCE, in_group("images")),
    params:
        function="baselines.references.run:answer_group",
        group="images",
        camera=dump(CONFIG.network_camera),
        seed=lambda w: seed_of(CONFIG.seed, "references", w.scene, w.size, w.labels),


use rule image_references as structure_references with:
    input:
        **evidence_for(in_group("structure"), **STRUCTURE),
    output:
        references=reference_files(REFERENCE, in_group("structure")),
    resources:
        mem_mb=grown(3000),
    params:
        group="structure",
        camera=dump(CONFIG.groundtruth_camera),


# In jobs of their own, as these take longer and are asked of fewer label sets.
use rule structure_references as adjusted_references with:
    input:
        **evidence_for(in_group("adjusted"), **STRUCTURE),
    output:
        references=reference_files(REFERENCE, in_group("adjusted")),
    params:
        group="adjusted",


use rule call_2gb as views with:
    input:
        sequences=rules.features.input.sequences,
    output:
        views=temp(f"{FOUND}/views-{{split}}.npz"),
    log:
        f"{ROOT}/logs/views/{{scene}}/{{size}}/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/views/{{scene}}/{{size}}/{{split}}.tsv"
    params:
        function="baselines.references.features:write_views",
        n_frames=lambda w: CONFIG.n_frames(w.scene, w.size, w.split),
        camera=dump(CONFIG.groundtruth_camera),
        side=(CONFIG.network_camera.width, CONFIG.network_camera.height),


use rule structure_references as coordinate_references with:
    input:
        **evidence_for(
            in_group("coordinates"),
            train_views=f"{FOUND}/views-train.npz",
            test_views=f"{FOUND}/views-test.npz",
        ),
    output:
        references=reference_files(REFERENCE, in_group("coordinates")),
    params:
        group="coordinates",
        samples_seen=CONFIG.references.coordinate_samples,
        # One seed for all label sets: what is drawn does not depend on them.
        seed=lambda w: seed_of(CONFIG.seed, "scene coordinates", w.scene, w.size),


use rule call_4gb as external_reference with:
    input:
        **evidence_for(
            ["{external}"],
            poses=external_poses,
            train_frames=f"{ROOT}/frames/{{scene}}/train.npy",
            test_frames=f"{ROOT}/frames/{{scene}}/test.npy",
        ),
    output:
        references=reference_files(REFERENCE, ["{external}"]),
    params:
        function="baselines.references.run:answer_externally",
        method=lambda w: dump(EXTERNAL[w.external], exclude={"title", "labels"}),
        named=placeholders,


use rule call as references_table with:
    input:
        metrics=reference_sets("metrics.json"),
        facts=reference_sets("facts.json"),
        localizers=METRICS,
    output:
        **table_files("references"),
    params:
        function="reproduction.tables.references:write_references_table",
        design=dump(DESIGN),
        references=dump(CONFIG.references),
