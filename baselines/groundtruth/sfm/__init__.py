"""Structure from motion on one batch: the SfM row of table 2.

The paper used openMVG; here it is COLMAP on SIFT features, with intrinsics that are known and kept
fixed: features.py finds and matches them, mapping.py builds models and takes one, refine.py drops
what bends it, batch.py does it all for one batch and puts the model into metres.
"""

from baselines.groundtruth.sfm.batch import metric_scale, sfm_batch

__all__ = ["metric_scale", "sfm_batch"]
