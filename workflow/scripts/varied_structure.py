from pathlib import Path

from baselines.references.evidence import Evidence
from baselines.references.run import pose_table
from baselines.references.varied import answer_varied, sampled, varied_features
from synfeal.config.models import CameraConfig, ReferencesConfig, RenderConfig
from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.job import job

inputs, params = snakemake.input, snakemake.params
with job(snakemake.log[0]):
    plan, rows = read_pose_table(Path(inputs.plan)), sampled(params.n_test, params.sample)
    camera, cfg = CameraConfig(**params.camera), ReferencesConfig(**params.references)
    render, mesh = RenderConfig(**params.render), Path(inputs.mesh)
    test = varied_features(mesh, plan, rows, camera, render, cfg)
    files = {name: Path(inputs[name]) for name in ("descriptors", "features")}
    labels = Path(inputs.labels).parent
    evidence = Evidence(labels, labels, files, camera, params.seed)
    poses = answer_varied(evidence, test, rows, snakemake.wildcards.effects, cfg.retrieved)
    write_pose_table(Path(snakemake.output.predictions), pose_table(plan.at(rows), poses))
