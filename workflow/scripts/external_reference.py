from pathlib import Path

from baselines.references.external import Answers, run_external, score_external
from synfeal.job import job

inputs, params = snakemake.input, snakemake.params
with job(snakemake.log[0]):
    files = {name: Path(str(path)) for name, path in inputs.items() if str(path)}
    folder = Path(snakemake.output[0]).parent
    answers = Answers(Path(str(inputs.poses)), 0.0) if params.method["poses"] else None
    if answers is None:
        answers = run_external(params.method["command"], files, params.named, folder)
    score_external(answers, files, folder, dict(snakemake.wildcards))
