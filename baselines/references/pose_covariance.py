"""Covariance of a pose from the matches that agree with it.

The pose minimises Cauchy's loss of reprojection errors, so their covariance carries over to it by
the Jacobian at the solution. How large errors are is read from the errors that are left (residuals)
and not assumed.

Matches are not independent. A feature of the photograph is matched with the same thing in up to
twenty frames of the map, each time from one place in the photograph; what is wrong with it is wrong
in all of them. So a cluster of matches counts as one match that has the mean information of the
cluster. Features of one patch of the photograph share errors of the mesh and of the lens, those of
one frame of the map that frame's own errors: the covariance is the sum of those from clusters by
patch and by frame.

That both sums are right in scale is not claimed: see :mod:`baselines.references.stated_errors`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Of Cauchy's loss, pixels: that of COLMAP's refinement of absolute poses.
LOSS_PX = 1.0
