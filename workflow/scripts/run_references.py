"""Answer by all methods of a group; see :class:`Evidence` and :func:`answer_and_score`."""

from baselines.references.run import answer_group
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    answer_group,
    group=snakemake.params.group,
    files=dict(snakemake.input.items()),
    camera=snakemake.params.camera,
    seed=snakemake.params.seed,
    samples_seen=snakemake.params.get("samples_seen", 0),
    wildcards=dict(snakemake.wildcards.items()),
    out_references=snakemake.output.references,
)
