"""Rigid motions in float64: no input or output, no imports from the rest of the project."""
