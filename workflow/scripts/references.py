from pathlib import Path

from baselines.references.evidence import Evidence
from baselines.references.registry import in_group
from baselines.references.run import answer_and_score
from synfeal.config.models import CameraConfig
from synfeal.job import job

params = snakemake.params
with job(snakemake.log[0]):
    files = {name: Path(str(path)) for name, path in snakemake.input.items()}
    labels, truth = files["train"].parent, files["train_truth"].parent
    camera, samples = CameraConfig(**params.camera), params.get("samples_seen", 0)
    evidence = Evidence(labels, truth, files, camera, params.seed, samples)
    out_dir = Path(snakemake.output[0]).parents[1]
    answer_and_score(evidence, in_group(params.group), out_dir, dict(snakemake.wildcards))
