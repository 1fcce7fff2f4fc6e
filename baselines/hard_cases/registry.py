"""The hard cases of the simulator and of what the paper compares."""

from __future__ import annotations

from baselines.hard_cases import losses, pose_graphs
from synfeal.hard_cases import registry

CASES = (*registry.CASES, *losses.CASES, *pose_graphs.CASES)
