"""Figures from result files, ``<root>/figures/<name>.{svg,png}``; one module per figure."""

from synfeal.report.figures.registry import CAPTIONS, FIGURES, write_figures
from synfeal.report.figures.sources import Results

__all__ = ["CAPTIONS", "FIGURES", "Results", "write_figures"]
