"""Plan one split of a scene; see :func:`plan_split`."""

from reproduction.runs.job import run_job
from synfeal.planning.plan import write_plan

run_job(
    snakemake.log[0],
    write_plan,
    collision=snakemake.input.collision,
    scene=snakemake.params.scene,
    collection=snakemake.params.collection,
    n_frames=snakemake.params.n_frames,
    seed=snakemake.params.seed,
    split=snakemake.wildcards.split,
    out_plan=snakemake.output.plan,
)
