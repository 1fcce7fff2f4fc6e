from pathlib import Path

from baselines.references.descriptors import write_descriptors
from synfeal.dataset.packed import read_packed
from synfeal.job import job

params = snakemake.params
with job(snakemake.log[0]):
    files = {name: Path(path) for name, path in snakemake.input.items()}
    counts = params.get("frames", {})
    frames = {name: read_packed(path)[: counts.get(name)] for name, path in files.items()}
    write_descriptors(frames, params.learned_from, params.seed, Path(snakemake.output.descriptors))
