"""Scores of poses: the field's measures, and readers of the files that other programs write."""
