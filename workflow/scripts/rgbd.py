from pathlib import Path

from baselines.groundtruth.posegraph.graph import write_g2o
from baselines.groundtruth.rgbd import rgbd_graph
from synfeal.config.models import CameraConfig, RgbdConfig
from synfeal.dataset.sevenscenes import frame_paths
from synfeal.job import job

params = snakemake.params
with job(snakemake.log[0]):
    sequences = [Path(path) for path in snakemake.input.sequences]
    color = frame_paths(sequences, "color.png")[params.start : params.stop]
    depth = frame_paths(sequences, "depth.png")[params.start : params.stop]
    graph = rgbd_graph(color, depth, CameraConfig(**params.camera), RgbdConfig(**params.rgbd))
    write_g2o(Path(snakemake.output.graph), graph)
