"""Figures from result files, ``<root>/figures/<name>.{svg,png}``; one module per figure."""

from synfeal.report.figures.registry import CAPTIONS, FIGURES
from synfeal.report.figures.sources import Results
from synfeal.report.figures.write import write_figures

__all__ = ["CAPTIONS", "FIGURES", "Results", "write_figures"]
