"""Draw some test frames with effects, and write what ``structure-depth`` answers for them."""

from baselines.references.varied import write_varied
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_varied,
    effects=snakemake.wildcards.effects,
    files={
        name: snakemake.input[name]
        for name in ("mesh", "plan", "descriptors", "features", "labels")
    },
    n_test=snakemake.params.n_test,
    sample=snakemake.params.sample,
    camera=snakemake.params.camera,
    render=snakemake.params.render,
    references=snakemake.params.references,
    seed=snakemake.params.seed,
    out_predictions=snakemake.output.predictions,
)
