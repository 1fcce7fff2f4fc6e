from reproduction.runs.job import call, job

with job(snakemake.log[0]):
    call(snakemake)
