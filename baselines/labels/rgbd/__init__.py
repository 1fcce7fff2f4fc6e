"""RGB-D odometry with loop closures: the front end of both RGB-D SLAM rows of table 2.

RTAB-Map is replaced by the same steps. Each frame is registered to the one before by Open3D's dense
odometry, which starts from the motion of the pair before. Where that does not make most of the
depth agree, because the camera turned or changed its direction, features give a second starting
point. In front of a single surface, along which depth slides, features alone give the motion.
Keyframes that view the same place are joined by loop closures.

A motion is accepted when the depth images agree under it and when the odometry stays near its
starting point. A consecutive pair that fails keeps its starting point as an edge of low weight, so
that the graph stays connected; a loop closure that fails is dropped.
"""

from baselines.labels.rgbd.graph import rgbd_graph

__all__ = ["rgbd_graph"]
