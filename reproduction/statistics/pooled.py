"""Effects of several replications, pooled by random effects.

The unit is the replication: a room, paths, label sets and weights of its own. Its effects differ
from those of another by more than its test paths tell, so that limits have to come from the spread
over replications. The method of Hartung and Knapp ("A refined method for the meta-analysis of
controlled clinical trials with binary outcome", Statistics in Medicine 2001) weights replications
by random effects, between-replication variance after Paule and Mandel, and takes Student's t with
one degree of freedom less than there are replications. Simulated coverage with five of them is in
``results/benchmarks/pooled_coverage.csv``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import t
from statsmodels.stats.meta_analysis import combine_effects

from synfeal.evaluation.bootstrap import CONFIDENCE, Array

# Below what any resampling can tell; weights are inverse variances, so none may be 0.
LEAST_VARIANCE = 1e-12


class Pooled(NamedTuple):
    """An effect over replications, with two-sided limits."""

    value: float
    low: float
    high: float
    deviation: float  # between replications: standard deviation beyond that of their test paths
    replications: int


def pool(
    values: Sequence[float] | Array,
    variances: Sequence[float] | Array,
    comparisons: int = 1,
    counted: bool = False,
) -> Pooled:
    """Pool the effects of replications by random effects with Hartung–Knapp limits.

    Args:
        values: Effect (K,) of each replication, on a scale where errors add, such as logarithms.
        variances: Their squared standard errors (K,) within the replication.
        comparisons: Number of effects it is one of, for Bonferroni's correction.
        counted: Effects are of small counts, which may well be the same in all replications; then
            limits are no narrower than the standard errors within replications ask for.

    Returns:
        The pooled effect. With a single replication, or one whose effect or standard error is not
        finite, its limits are infinite: nothing is known of how replications differ.
    """
    effects = np.asarray(values, dtype=float)
    if len(effects) < 2 or not np.isfinite([*effects, *variances]).all():
        return Pooled(float(effects.mean()), -math.inf, math.inf, math.nan, len(effects))
    within = np.maximum(np.asarray(variances, dtype=float), LEAST_VARIANCE)
    with np.errstate(divide="ignore"):  # I² of effects that are all the same
        found = combine_effects(effects, within, method_re="iterated", use_t=True)
    error = float(found.sd_eff_w_re_hksj)
    if counted:
        error = max(error, float(found.sd_eff_w_re))
    level = 1 - (1 - CONFIDENCE) / comparisons / 2
    half = float(t.ppf(level, len(effects) - 1)) * error
    centre = float(found.mean_effect_re)
    deviation = math.sqrt(max(float(found.tau2), 0.0))
    return Pooled(centre, centre - half, centre + half, deviation, len(effects))
