from pathlib import Path

from baselines.groundtruth.label_set import chain_split, write_assistance
from synfeal.config.models import GroundTruthConfig
from synfeal.files import write_json
from synfeal.job import job, refuse_restored

with job(snakemake.log[0]):
    refuse_restored(snakemake.input, snakemake.output[0])
    params, output = snakemake.params, snakemake.output
    config = GroundTruthConfig(**params.groundtruth)
    assistance = {
        split: chain_split(
            [Path(path) for path in snakemake.input[f"{split}_batches"]],
            Path(snakemake.input[f"{split}_truth"]),
            Path(output[split]),
            Path(output[f"{split}_unassisted"]),
            config,
        )
        for split in ("train", "test")
    }
    write_assistance(Path(output.assistance), snakemake.wildcards.reconstructed, assistance)
    write_json(Path(output.record), {"parameters": params.estimation})
