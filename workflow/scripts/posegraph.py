from pathlib import Path

from baselines.groundtruth.posegraph.graph import read_g2o
from baselines.groundtruth.posegraph.optimise import optimise
from baselines.groundtruth.trajectory import write_trajectory
from synfeal.config.models import PoseGraphConfig
from synfeal.job import job

with job(snakemake.log[0]):
    graph = read_g2o(Path(snakemake.input.graph))
    config = PoseGraphConfig(**snakemake.params.posegraph)
    trajectory = optimise(snakemake.wildcards.optimiser, graph, config)
    write_trajectory(Path(snakemake.output.trajectory), trajectory)
