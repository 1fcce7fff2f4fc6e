"""Structure from motion on one batch: the SfM row of table 2.

The paper used openMVG; here it is COLMAP on SIFT features, with intrinsics that are known and kept
fixed. batch.py does it all: features.py finds features, pairs.py says which images are matched,
mapping.py builds models, takes one and drops what bends it, gauge.py puts it into the world.
"""

from baselines.labels.sfm.batch import sfm_batch
from baselines.labels.sfm.gauge import metric_scale

__all__ = ["metric_scale", "sfm_batch"]
