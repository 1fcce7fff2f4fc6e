"""Names of published results; this is the one place that has them."""

from __future__ import annotations

from pathlib import Path

PUBLISHED = Path("results/published")
# Of the first that is published pages show tables that replications do not repeat: one run.
HEADLINES = ("night", "mini")
# Whose jobs those of other profiles are predicted from.
MEASURED = (PUBLISHED / "mini", PUBLISHED / "night")
# Scores of photographs (`make real`), which need recordings that are not ours to pass on; they lie
# beside those of a profile, and are part of none.
REAL = "real"
# Archives and pooled tables, by which claims are told; the single runs that decided them before.
REPLICATIONS, SINGLE_RUNS = "replications", "single_runs"
