# A scan of photographs, frames rendered of it, localizers and maps of both, tested on photographs
# that were not scanned. Rules are the commands of docs/real.md, so each can be typed.
import sys
from pathlib import Path

from reproduction.real.config import parse_real_config
from reproduction.real.design import BOTH, PHOTOGRAPHS, RENDERED, design_of
from synfeal.errors import InputError

try:
    REAL = parse_real_config(config)
    DESIGN = design_of(REAL)
except InputError as error:
    sys.exit(f"error: {error}")

ROOT = REAL.results.as_posix()
SETTINGS = REAL.model_dump(mode="json")
PARTS = {part.name: part for part in (*DESIGN.parts, *DESIGN.fewer)}
RUN = "{part}/runs/{row}/{localizer}/seed{seed}"
SCAN = f"{ROOT}/{{part}}/scan.json"


wildcard_constraints:
    part="|".join(PARTS),
    whole="|".join(part.name for part in DESIGN.parts),
    fewer="|".join(part.name for part in DESIGN.fewer) or "none",
    row=r"[a-z]+(-\d+)?",
    localizer=r"\w+",
    seed=r"\d+",
    of="rendered|photographs",  # of maps; `refined` are poses alone


def frames_of(wildcards):
    """Frames that are rendered of a scan."""
    part = PARTS[wildcards.part]
    return REAL.curve_photographs_frames if part.photographs else REAL.frames


def shown(part, row):
    """Data sets that a run is shown, and the file of each that is made last."""
    row, _, frames = row.partition("-")
    folder = f"{ROOT}/{part}"
    rendered = f"{folder}/rendered-{frames}" if frames else f"{folder}/rendered"
    photographs = (f"{folder}/train", f"{folder}/train")
    frames = (rendered, rendered if frames else f"{rendered}/manifest.json")
    return {PHOTOGRAPHS: [photographs], BOTH: [frames, photographs]}.get(row, [frames])


def poses_behind_tables():
    """Poses of every run, map and reference."""
    folders = [thing.directory for thing in (*DESIGN.every_run, *DESIGN.maps)]
    references = [
        f"{part.name}/references/{name}"
        for part in DESIGN.parts
        for name in ("retrieval", "nearest", "mean")
    ]
    return [
        *(f"{ROOT}/{folder}/poses.csv" for folder in folders),
        *(f"{ROOT}/{name}.csv" for name in references),
    ]


# Which photographs are scanned and which are localized: folders of links.
rule part:
    output:
        train=directory(f"{ROOT}/{{part}}/train"),
        test=directory(f"{ROOT}/{{part}}/test"),
        given=f"{ROOT}/{{part}}/truth_given.csv",
        sfm=f"{ROOT}/{{part}}/truth_sfm.csv",
        difference=f"{ROOT}/{{part}}/label_difference.json",
    log:
        f"{ROOT}/logs/part/{{part}}.log",
    benchmark:
        f"{ROOT}/benchmarks/part/{{part}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    params:
        sequence=SETTINGS["sequence"],
        sequence_name=SETTINGS["sequence_name"],
        sfm_labels=SETTINGS["sfm_labels"],
        depth_from_color=SETTINGS["depth_from_color"],
        direction=lambda w: PARTS[w.part].direction,
        labels=lambda w: PARTS[w.part].labels,
        photographs=lambda w: PARTS[w.part].photographs,
    script:
        "../scripts/real/run_part.py"


rule scan:
    input:
        f"{ROOT}/{{whole}}/train",
    output:
        multiext(f"{ROOT}/{{whole}}/scan", ".glb", ".json", ".png"),
    log:
        f"{ROOT}/logs/scan/{{whole}}.log",
    benchmark:
        f"{ROOT}/benchmarks/scan/{{whole}}.tsv"
    priority: 20
    conda:
        "../envs/synfeal.yaml"
    params:
        cameras=REAL.cameras,
        more=REAL.scan,
    shell:
        "synfeal scan {input} --out {output[0]} {params.cameras} {params.more} > {log} 2>&1"


# Of a few photographs every one is fused. Too few show which way is down: that is known.
rule scan_fewer:
    input:
        f"{ROOT}/{{fewer}}/train",
        record=f"{ROOT}/{DESIGN.main}/scan.json",
    output:
        multiext(f"{ROOT}/{{fewer}}/scan", ".glb", ".json", ".png"),
    log:
        f"{ROOT}/logs/scan/{{fewer}}.log",
    benchmark:
        f"{ROOT}/benchmarks/scan/{{fewer}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    params:
        cameras=REAL.cameras,
        more=REAL.scan,
    shell:
        "synfeal scan {input[0]} --out {output[0]} {params.cameras} {params.more} --stride 1"
        " $(python -m reproduction.real.down {input.record}) > {log} 2>&1"


# It goes on where it was stopped: the frames themselves are no output that Snakemake deletes.
rule collect:
    input:
        train=f"{ROOT}/{{part}}/train",
        mesh=f"{ROOT}/{{part}}/scan.glb",
        record=SCAN,
    output:
        manifest=f"{ROOT}/{{part}}/rendered/manifest.json",
    log:
        f"{ROOT}/logs/collect/{{part}}.log",
    benchmark:
        f"{ROOT}/benchmarks/collect/{{part}}.tsv"
    priority: 10
    conda:
        "../envs/synfeal.yaml"
    params:
        out=subpath(output.manifest, parent=True),
        frames=frames_of,
        width=REAL.width,
        height=REAL.height,
        more=REAL.collect,
        like=lambda w, input: REAL.sequence if REAL.like == "all" else input.train,
    shell:
        "synfeal collect {input.mesh} --like {params.like} --frames {params.frames}"
        " --width {params.width} --height {params.height} --depth --out {params.out}"
        " {params.more} > {log} 2>&1"


rule fewer_frames:
    input:
        f"{ROOT}/{{part}}/rendered/manifest.json",
    output:
        dataset=directory(f"{ROOT}/{{part}}/rendered-{{frames}}"),
    log:
        f"{ROOT}/logs/fewer_frames/{{part}}-{{frames}}.log",
    benchmark:
        f"{ROOT}/benchmarks/fewer_frames/{{part}}-{{frames}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    params:
        dataset=subpath(input[0], parent=True),
    script:
        "../scripts/real/run_fewer_frames.py"


# It goes on where it was stopped: what it needs for that is no output that Snakemake deletes.
rule train:
    input:
        datasets=lambda w: [made for _, made in shown(w.part, w.row)],
        camera=SCAN,
    output:
        model=f"{ROOT}/{RUN}/model.pt",
        record=f"{ROOT}/{RUN}/training.json",
    log:
        f"{ROOT}/logs/train/{RUN}.log",
    benchmark:
        f"{ROOT}/benchmarks/train/{RUN}.tsv"
    conda:
        "../envs/synfeal.yaml"
    params:
        datasets=lambda w: [folder for folder, _ in shown(w.part, w.row)],
        out=subpath(output.model, parent=True),
        images=REAL.images,
        randomisation=lambda w: "off" if w.row == RENDERED else "on",
        # Of photographs by the camera that the scan found; rendered frames say theirs.
        camera=lambda w, input: (
            f"--camera {input.camera}" if w.row in (PHOTOGRAPHS, BOTH) else ""
        ),
    shell:
        "synfeal train {params.datasets} --out {params.out} --localizer {wildcards.localizer}"
        " --images {params.images} --randomisation {params.randomisation}"
        " --seed {wildcards.seed} {params.camera} > {log} 2>&1"


rule localize:
    input:
        model=f"{ROOT}/{RUN}/model.pt",
        test=f"{ROOT}/{{part}}/test",
        camera=SCAN,
    output:
        f"{ROOT}/{RUN}/poses.csv",
    log:
        f"{ROOT}/logs/localize/{RUN}.log",
    benchmark:
        f"{ROOT}/benchmarks/localize/{RUN}.tsv"
    conda:
        "../envs/synfeal.yaml"
    shell:
        "synfeal localize {input.model} {input.test}/seq-* --camera {input.camera}"
        " --out {output} > {log} 2>&1"


rule map:
    input:
        lambda w: shown(w.part, w.of)[0][1],
        camera=SCAN,
    output:
        directory(f"{ROOT}/{{part}}/maps/{{of}}/map"),
    log:
        f"{ROOT}/logs/map/{{part}}/{{of}}.log",
    benchmark:
        f"{ROOT}/benchmarks/map/{{part}}/{{of}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    params:
        dataset=lambda w: shown(w.part, w.of)[0][0],
        # Photographs by the camera that the scan found; rendered frames say theirs.
        cameras=lambda w, input: (
            f"{REAL.map_cameras} --color-camera {input.camera}"
            if w.of == PHOTOGRAPHS
            else ""
        ),
        most=REAL.map_frames,
    shell:
        "synfeal map {params.dataset} --out {output} --most {params.most} {params.cameras}"
        " > {log} 2>&1"


rule localize_in_map:
    input:
        map=f"{ROOT}/{{part}}/maps/{{of}}/map",
        test=f"{ROOT}/{{part}}/test",
        camera=SCAN,
    output:
        f"{ROOT}/{{part}}/maps/{{of}}/poses.csv",
    log:
        f"{ROOT}/logs/localize_in_map/{{part}}/{{of}}.log",
    benchmark:
        f"{ROOT}/benchmarks/localize_in_map/{{part}}/{{of}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    shell:
        "synfeal localize {input.map} {input.test}/seq-* --camera {input.camera}"
        " --out {output} > {log} 2>&1"


rule localize_refined:
    input:
        map=f"{ROOT}/{{part}}/maps/rendered/map",
        scan=f"{ROOT}/{{part}}/scan.glb",
        test=f"{ROOT}/{{part}}/test",
        camera=SCAN,
    output:
        f"{ROOT}/{{part}}/maps/refined/poses.csv",
    log:
        f"{ROOT}/logs/localize_refined/{{part}}.log",
    benchmark:
        f"{ROOT}/benchmarks/localize_refined/{{part}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    shell:
        "synfeal localize {input.map} {input.test}/seq-* --camera {input.camera}"
        " --refine {input.scan} --out {output} > {log} 2>&1"


rule references:
    input:
        manifest=f"{ROOT}/{{part}}/rendered/manifest.json",
        train=f"{ROOT}/{{part}}/train",
        test=f"{ROOT}/{{part}}/test",
        truth=lambda w: f"{ROOT}/{w.part}/truth_{PARTS[w.part].labels}.csv",
    output:
        retrieval=f"{ROOT}/{{part}}/references/retrieval.csv",
        nearest=f"{ROOT}/{{part}}/references/nearest.csv",
        mean=f"{ROOT}/{{part}}/references/mean.csv",
    log:
        f"{ROOT}/logs/references/{{part}}.log",
    benchmark:
        f"{ROOT}/benchmarks/references/{{part}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    params:
        rendered=subpath(input.manifest, parent=True),
    script:
        "../scripts/real/run_references.py"


rule cover:
    input:
        scan=f"{ROOT}/{{part}}/scan.glb",
        record=SCAN,
        test=f"{ROOT}/{{part}}/test",
    output:
        cover=f"{ROOT}/{{part}}/cover.csv",
    log:
        f"{ROOT}/logs/cover/{{part}}.log",
    benchmark:
        f"{ROOT}/benchmarks/cover/{{part}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    script:
        "../scripts/real/run_cover.py"


# Of photographs that may not be passed on: it stays here.
rule picture:
    input:
        scan=f"{ROOT}/{{part}}/scan.glb",
        record=SCAN,
        test=f"{ROOT}/{{part}}/test",
    output:
        picture=f"{ROOT}/{{part}}/picture.png",
    log:
        f"{ROOT}/logs/picture/{{part}}.log",
    benchmark:
        f"{ROOT}/benchmarks/picture/{{part}}.tsv"
    conda:
        "../envs/synfeal.yaml"
    script:
        "../scripts/real/run_picture.py"


rule real_tables:
    input:
        poses_behind_tables(),
        expand(f"{ROOT}/{{part}}/cover.csv", part=[part.name for part in DESIGN.parts]),
        expand(
            f"{ROOT}/{{part}}/{{file}}",
            part=PARTS,
            file=["truth_given.csv", "truth_sfm.csv", "scan.json"],
        ),
    output:
        table=f"{ROOT}/tables/table8_real.csv",
        tex=f"{ROOT}/tables/table8_real.tex",
        runs=f"{ROOT}/tables/real_runs.csv",
        amount=f"{ROOT}/tables/real_amount.csv",
        cover=f"{ROOT}/tables/real_cover.csv",
    log:
        f"{ROOT}/logs/real_tables.log",
    benchmark:
        f"{ROOT}/benchmarks/real_tables.tsv"
    conda:
        "../envs/synfeal.yaml"
    params:
        config=SETTINGS,
    script:
        "../scripts/real/run_tables.py"


rule real_figures:
    input:
        amount=f"{ROOT}/tables/real_amount.csv",
        cover=f"{ROOT}/tables/real_cover.csv",
        table=f"{ROOT}/tables/table8_real.csv",
    output:
        amount=multiext(f"{ROOT}/figures/real_amount", ".png", ".svg"),
        shares=multiext(f"{ROOT}/figures/real_cover", ".png", ".svg"),
    log:
        f"{ROOT}/logs/real_figures.log",
    benchmark:
        f"{ROOT}/benchmarks/real_figures.tsv"
    conda:
        "../envs/synfeal.yaml"
    script:
        "../scripts/real/run_figures.py"
