"""Structure from motion on one batch: the SfM row of table 2.

The paper used openMVG; here it is COLMAP on SIFT features, with intrinsics that are known and kept
fixed: features.py finds and matches them, mapping.py builds models and takes one, options.py holds
the mappers' settings, scale.py puts the model into metres, batch.py does it all for one batch.
"""

from baselines.groundtruth.sfm.batch import SfmEstimate, SfmFacts, sfm_batch
from baselines.groundtruth.sfm.scale import metric_scale

__all__ = ["SfmEstimate", "SfmFacts", "metric_scale", "sfm_batch"]
