"""Replications of the paper: archives of their errors, effects of the claims, pooled verdicts."""
