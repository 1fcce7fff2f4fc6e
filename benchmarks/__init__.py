"""Measurements run by hand; their tables lie under ``results/benchmarks``."""
