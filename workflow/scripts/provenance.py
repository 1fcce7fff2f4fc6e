from pathlib import Path

from synfeal.job import job
from synfeal.report.cost.measured import write_measured
from synfeal.report.html.provenance import write_provenance

with job(snakemake.log[0]):
    out_json = Path(snakemake.output.record)
    measured = [Path(path) for path in snakemake.input.measured]
    write_measured(measured, out_json.parent)
    write_provenance(
        snakemake.params.seed,
        snakemake.params.config_hash,
        measured,
        [Path(path) for path in snakemake.input.results],
        out_json,
    )
