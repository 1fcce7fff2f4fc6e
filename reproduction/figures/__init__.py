"""Figures from result files, ``<root>/figures/<name>.{svg,png}``."""
