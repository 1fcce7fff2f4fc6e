"""Lay out the photographs of a part: those to scan, those to localize, labels of the latter."""

from reproduction.real.stages import write_part
from reproduction.runs.job import run_job

run_job(
    snakemake.log[0],
    write_part,
    sequence=snakemake.params.sequence,
    sequence_name=snakemake.params.sequence_name,
    sfm_labels=snakemake.params.sfm_labels,
    depth_from_color=snakemake.params.depth_from_color,
    direction=snakemake.params.direction,
    labels=snakemake.params.labels,
    photographs=snakemake.params.photographs,
    out_train=snakemake.output.train,
    out_test=snakemake.output.test,
    out_given=snakemake.output.given,
    out_sfm=snakemake.output.sfm,
    out_difference=snakemake.output.difference,
)
