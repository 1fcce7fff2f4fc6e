# What localizers are compared with. Descriptors, features and matches depend on images alone: they
# are found once per scene or data set and serve all of its label sets.
FOUND = f"{ROOT}/references/{{scene}}/{{size}}"
REFERENCE = f"{FOUND}/{{labels}}"
# What every method is given: labels and true poses of both splits.
POSES = {
    "train": f"{ROOT}/labels/{{scene}}/{{size}}/{{labels}}/train.csv",
    "train_truth": f"{ROOT}/labels/{{scene}}/{{size}}/synfeal/train.csv",
    "test": f"{ROOT}/labels/{{scene}}/{{size}}/{{labels}}/test.csv",
    "test_truth": f"{ROOT}/labels/{{scene}}/{{size}}/synfeal/test.csv",
}


rule descriptors:
    input:
        train=f"{ROOT}/frames/{{scene}}/train.npy",
        test=f"{ROOT}/frames/{{scene}}/test.npy",
    output:
        descriptors=f"{ROOT}/references/{{scene}}/descriptors.npz",
        # Processor seconds per test frame, here and below: they are part of an answer.
        costs=f"{ROOT}/references/{{scene}}/descriptors-costs.json",
    log:
        f"{ROOT}/logs/descriptors/{{scene}}.log",
    benchmark:
        f"{ROOT}/benchmarks/descriptors/{{scene}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(3000),
    params:
        learned_from=lambda w: FILES.smallest_train(w.scene),
        seed=lambda w: seed_of(CONFIG.seed, "descriptors", w.scene),
    script:
        "../scripts/run_descriptors.py"


rule features:
    input:
        sequences=lambda w: FILES.sequence_dirs(
            w.scene,
            "estimation",
            w.split,
            CONFIG.n_frames(w.scene, w.size, w.split),
        ),
    output:
        features=temp(f"{FOUND}/features-{{split}}.npz"),
        costs=f"{FOUND}/features-{{split}}-costs.json",
    log:
        f"{ROOT}/logs/features/{{scene}}/{{size}}/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/features/{{scene}}/{{size}}/{{split}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(3000),
    params:
        n_frames=lambda w: CONFIG.n_frames(w.scene, w.size, w.split),
        camera=dump(CONFIG.estimation_camera),
        references=dump(CONFIG.references, include={"max_features", "contrast"}),
    script:
        "../scripts/run_features.py"


rule correspondences:
    input:
        descriptors=rules.descriptors.output.descriptors,
        train=f"{FOUND}/features-train.npz",
        test=f"{FOUND}/features-test.npz",
    output:
        matches=f"{FOUND}/correspondences.npz",
        costs=f"{FOUND}/correspondences-costs.json",
    log:
        f"{ROOT}/logs/correspondences/{{scene}}/{{size}}.log",
    benchmark:
        f"{ROOT}/benchmarks/correspondences/{{scene}}/{{size}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(3000),
    params:
        retrieved=CONFIG.references.retrieved,
    script:
        "../scripts/run_correspondences.py"


rule tracks:
    input:
        descriptors=rules.descriptors.output.descriptors,
        train=f"{FOUND}/features-train.npz",
    output:
        tracks=f"{FOUND}/tracks.npz",
    log:
        f"{ROOT}/logs/tracks/{{scene}}/{{size}}.log",
    benchmark:
        f"{ROOT}/benchmarks/tracks/{{scene}}/{{size}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(3000),
    script:
        "../scripts/run_tracks.py"


rule image_references:
    input:
        **POSES,
        descriptors=rules.descriptors.output.descriptors,
        descriptor_costs=rules.descriptors.output.costs,
    output:
        references=FILES.reference_files(REFERENCE, in_group("images")),
    log:
        f"{ROOT}/logs/image_references/{{scene}}/{{size}}/{{labels}}.log",
    benchmark:
        f"{ROOT}/benchmarks/image_references/{{scene}}/{{size}}/{{labels}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(2000),
    params:
        group="images",
        camera=dump(CONFIG.network_camera),
        seed=lambda w: seed_of(CONFIG.seed, "references", w.scene, w.size, w.labels),
    script:
        "../scripts/run_references.py"


# What a test frame takes before structure answers for it.
STRUCTURE_COSTS = {
    "descriptor_costs": rules.descriptors.output.costs,
    "feature_costs": f"{FOUND}/features-test-costs.json",
    "match_costs": rules.correspondences.output.costs,
}


use rule image_references as structure_references with:
    input:
        **POSES,
        **STRUCTURE_COSTS,
        correspondences=rules.correspondences.output.matches,
        tracks=rules.tracks.output.tracks,
    output:
        references=FILES.reference_files(REFERENCE, in_group("structure")),
    log:
        f"{ROOT}/logs/structure_references/{{scene}}/{{size}}/{{labels}}.log",
    benchmark:
        f"{ROOT}/benchmarks/structure_references/{{scene}}/{{size}}/{{labels}}.tsv"
    resources:
        mem_mb=grown(3000),
    params:
        group="structure",
        camera=dump(CONFIG.estimation_camera),


# In jobs of their own, as these take longer and are asked of fewer label sets.
use rule structure_references as adjusted_references with:
    input:
        **POSES,
        **STRUCTURE_COSTS,
        correspondences=rules.correspondences.output.matches,
        tracks=rules.tracks.output.tracks,
    output:
        references=FILES.reference_files(REFERENCE, in_group("adjusted")),
    log:
        f"{ROOT}/logs/adjusted_references/{{scene}}/{{size}}/{{labels}}.log",
    benchmark:
        f"{ROOT}/benchmarks/adjusted_references/{{scene}}/{{size}}/{{labels}}.tsv"
    params:
        group="adjusted",


rule views:
    input:
        sequences=rules.features.input.sequences,
    output:
        views=temp(f"{FOUND}/views-{{split}}.npz"),
        costs=f"{FOUND}/views-{{split}}-costs.json",
    log:
        f"{ROOT}/logs/views/{{scene}}/{{size}}/{{split}}.log",
    benchmark:
        f"{ROOT}/benchmarks/views/{{scene}}/{{size}}/{{split}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(2000),
    params:
        n_frames=lambda w: CONFIG.n_frames(w.scene, w.size, w.split),
        camera=dump(CONFIG.estimation_camera),
        side=(CONFIG.network_camera.width, CONFIG.network_camera.height),
    script:
        "../scripts/run_views.py"


use rule structure_references as coordinate_references with:
    input:
        **POSES,
        train_views=f"{FOUND}/views-train.npz",
        test_views=f"{FOUND}/views-test.npz",
        view_costs=f"{FOUND}/views-test-costs.json",
    output:
        references=FILES.reference_files(REFERENCE, in_group("coordinates")),
    log:
        f"{ROOT}/logs/coordinate_references/{{scene}}/{{size}}/{{labels}}.log",
    benchmark:
        f"{ROOT}/benchmarks/coordinate_references/{{scene}}/{{size}}/{{labels}}.tsv"
    params:
        group="coordinates",
        samples_seen=lambda w: CONFIG.coordinate_samples(w.size),
        # One seed for all label sets: what is drawn does not depend on them.
        seed=lambda w: seed_of(CONFIG.seed, "scene coordinates", w.scene, w.size),


rule external_reference:
    input:
        **POSES,
        poses=lambda w: FILES.external_poses(w.external, w) or [],
        train_frames=f"{ROOT}/frames/{{scene}}/train.npy",
        test_frames=f"{ROOT}/frames/{{scene}}/test.npy",
    output:
        references=FILES.reference_files(REFERENCE, ["{external}"]),
    log:
        f"{ROOT}/logs/external_reference/{{scene}}/{{size}}/{{labels}}/{{external}}.log",
    benchmark:
        f"{ROOT}/benchmarks/external_reference/{{scene}}/{{size}}/{{labels}}/{{external}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    resources:
        mem_mb=grown(4000),
    params:
        method=lambda w: dump(
            CONFIG.references.external[w.external], exclude={"title", "labels"}
        ),
        named=lambda w: {name: w[name] for name in ("scene", "size", "labels")},
    script:
        "../scripts/run_external_reference.py"
