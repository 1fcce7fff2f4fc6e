from pathlib import Path

from baselines.groundtruth.methods import solve_graph
from baselines.groundtruth.posegraph.graph import read_g2o
from baselines.groundtruth.trajectory import write_trajectory
from synfeal.config.models import PoseGraphConfig
from synfeal.files import write_json
from synfeal.job import job, refuse_restored

with job(snakemake.log[0]):
    refuse_restored(snakemake.input, snakemake.output[0])
    graph = read_g2o(Path(snakemake.input.graph))
    config = PoseGraphConfig(**snakemake.params.posegraph)
    trajectory, facts = solve_graph(snakemake.wildcards.graph_method, graph, config)
    write_json(Path(snakemake.output.facts), facts)
    write_trajectory(Path(snakemake.output.trajectory), trajectory)
