"""Write what later stages read of a scene: ``out_mesh`` (``mesh.glb``, world frame)."""

from reproduction.runs.job import run_job
from synfeal.collection.prepare import prepare_scene

run_job(
    snakemake.log[0],
    prepare_scene,
    name=snakemake.params.name,
    scene=snakemake.params.scene,
    collision_agreement=snakemake.params.collision_agreement,
    seed=snakemake.params.seed,
    shade=snakemake.params.shade,
    out_mesh=snakemake.output.mesh,
)
