"""Write ``light_<group>.glb`` of a stand-in for :func:`synfeal.effects.scene.open_scene`."""

from reproduction.rooms import save_light_shares
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    save_light_shares,
    builder=snakemake.params.builder,
    seed=snakemake.params.seed,
    out_shares=snakemake.output.shares,
)
