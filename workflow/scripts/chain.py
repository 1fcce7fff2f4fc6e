from pathlib import Path

from baselines.groundtruth.label_set import chain_split, write_assistance
from synfeal.config.models import GroundTruthConfig
from synfeal.job import job

with job(snakemake.log[0]):
    config = GroundTruthConfig(**snakemake.params.groundtruth)
    assistance = {
        split: chain_split(
            [Path(path) for path in snakemake.input[f"{split}_batches"]],
            Path(snakemake.input[f"{split}_truth"]),
            Path(snakemake.output[split]),
            Path(snakemake.output[f"{split}_unassisted"]),
            config,
        )
        for split in ("train", "test")
    }
    write_assistance(
        Path(snakemake.output.assistance), snakemake.wildcards.reconstructed, assistance
    )
