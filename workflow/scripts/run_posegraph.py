"""Write :func:`solve_graph` of a ``.g2o`` file."""

from baselines.labels.methods import write_solved
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_solved,
    graph_method=snakemake.wildcards.graph_method,
    graph=snakemake.input.graph,
    posegraph=snakemake.params.posegraph,
    out_trajectory=snakemake.output.trajectory,
    out_facts=snakemake.output.facts,
)
