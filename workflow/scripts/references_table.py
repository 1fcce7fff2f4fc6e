from pathlib import Path

from synfeal.config import Design
from synfeal.config.models import ExternalConfig
from synfeal.job import job
from synfeal.report.references import write_references_table

with job(snakemake.log[0]):
    design = Design(**snakemake.params.design)
    csv, tex = Path(snakemake.output.csv), Path(snakemake.output.tex)
    external = {n: ExternalConfig(**e) for n, e in snakemake.params.external.items()}
    write_references_table(design, external, csv.parents[1], csv, tex)
