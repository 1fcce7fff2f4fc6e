"""Pose graphs and the two optimisers of the paper."""
