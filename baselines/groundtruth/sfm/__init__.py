"""Structure from motion on one batch: the SfM row of table 2.

The paper used openMVG; here it is COLMAP on SIFT features, with intrinsics that are known and kept
fixed: mapping.py builds models, takes one and drops what bends it; batch.py finds and matches
features, calls it, and puts the model into metres.
"""

from baselines.groundtruth.sfm.batch import metric_scale, sfm_batch

__all__ = ["metric_scale", "sfm_batch"]
