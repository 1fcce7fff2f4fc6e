from pathlib import Path

from synfeal.job import job
from synfeal.scenes import save_light_shares

with job(snakemake.log[0]):
    directory = Path(snakemake.output.shares[0]).parent
    save_light_shares(snakemake.params.builder, snakemake.params.seed, directory)
