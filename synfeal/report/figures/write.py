"""Drawing a profile's figures to files."""

from __future__ import annotations

from pathlib import Path

import matplotlib
from matplotlib.figure import Figure

from synfeal.config import Design
from synfeal.files import atomic_path
from synfeal.report.figures.registry import FIGURES
from synfeal.report.figures.sources import Results
from synfeal.report.figures.style import RC

DPI = 150
METADATA: dict[str, dict[str, str | None]] = {".png": {"Software": None}, ".svg": {"Date": None}}


def write_figures(design: Design, root: Path, out_dir: Path) -> list[str]:
    """Write every figure whose inputs the design makes, as SVG and PNG; their names.

    Equal results give equal files.
    """
    results, written = Results(root, design), []
    for name, entry in FIGURES.items():
        with matplotlib.rc_context(rc=RC):
            figure = entry.draw(results)
            if figure is None:
                continue
            for suffix in entry.suffixes:
                save(figure, (out_dir / name).with_suffix(suffix))
            written.append(name)
    return written


def save(figure: Figure, path: Path) -> None:
    """Write one file, without a date."""
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=DPI, metadata=METADATA[path.suffix])
