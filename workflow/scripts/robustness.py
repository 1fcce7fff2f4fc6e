from pathlib import Path

from baselines.references.robustness import robustness_table
from synfeal.config.models import MODELS
from synfeal.config.robustness import CLEAN, MIXED
from synfeal.job import job
from synfeal.report.robustness import write_robustness

inputs, outputs = snakemake.input, snakemake.output
with job(snakemake.log[0]):
    models = {
        CLEAN: dict(zip(MODELS, map(Path, inputs.clean), strict=True)),
        MIXED: dict(zip(MODELS, map(Path, inputs.mixed), strict=True)),
    }
    descriptors = dict(zip(models, map(Path, inputs.descriptors), strict=True))
    varied = zip(snakemake.params.effects, map(Path, inputs.varied), strict=True)
    test = {CLEAN: Path(inputs.test), **dict(varied)}
    structure = dict(zip(test, map(Path, inputs.structure), strict=False))  # of all, or of none
    labels = Path(inputs.labels[0]).parent
    table = robustness_table(models, descriptors, structure, test, labels, snakemake.params.device)
    write_robustness(table, Path(outputs.csv), Path(outputs.tex))
