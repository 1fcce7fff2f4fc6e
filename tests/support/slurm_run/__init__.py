"""The smoke profile on a SLURM cluster whose node crashes in the middle, against a local run."""
