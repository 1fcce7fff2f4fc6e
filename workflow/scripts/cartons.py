from pathlib import Path

from synfeal.job import job
from synfeal.scenes.objects import save_cartons

with job(snakemake.log[0]):
    save_cartons(Path(snakemake.input.mesh))
