from pathlib import Path

from baselines.groundtruth.posegraph.graph import write_g2o
from baselines.groundtruth.rgbd import rgbd_graph
from synfeal.config.models import CameraConfig, RgbdConfig
from synfeal.dataset.sevenscenes import frame_paths
from synfeal.files import write_json
from synfeal.job import job, refuse_restored

params = snakemake.params
with job(snakemake.log[0]):
    refuse_restored(snakemake.input, snakemake.output[0])
    sequences = [Path(path) for path in snakemake.input.sequences]
    color = frame_paths(sequences, "color.png")[params.start : params.stop]
    depth = frame_paths(sequences, "depth.png")[params.start : params.stop]
    graph, facts = rgbd_graph(
        color, depth, CameraConfig(**params.camera), RgbdConfig(**params.rgbd), params.seed
    )
    write_g2o(Path(snakemake.output.graph), graph)
    write_json(Path(snakemake.output.facts), facts.as_dict())
