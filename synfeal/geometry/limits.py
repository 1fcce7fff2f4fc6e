"""Limits of coordinates, where nothing else may be loaded."""

FARTHEST_M = 1e9  # no place is farther from the origin of its world; squares of it do not overflow
