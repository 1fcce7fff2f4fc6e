from pathlib import Path

from baselines.references.correspondences import write_matches
from synfeal.job import job

with job(snakemake.log[0]):
    write_matches(
        Path(snakemake.input.descriptors),
        Path(snakemake.input.train),
        Path(snakemake.input.test),
        snakemake.params.retrieved,
        Path(snakemake.output.matches),
    )
