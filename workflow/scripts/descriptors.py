from pathlib import Path

from baselines.references.descriptors import write_descriptors
from synfeal.job import job

with job(snakemake.log[0]):
    write_descriptors(
        Path(snakemake.input.train),
        Path(snakemake.input.test),
        snakemake.params.learned_from,
        snakemake.params.seed,
        Path(snakemake.output.descriptors),
    )
