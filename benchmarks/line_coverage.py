"""Which share of the lines the tests run, after ``coverage run -m pytest`` (``make coverage``).

``python -m benchmarks.line_coverage`` reads ``coverage.json`` and writes
``results/benchmarks/coverage.csv``, one row per package.
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePath
from typing import Any

from synfeal.report.tables import write_rows

COLUMNS = ("package", "lines", "run", "share")
DEEPEST = 2  # names of packages in the table: synfeal.geometry, but not synfeal.render.opengl


def rows_of(files: Mapping[str, Mapping[str, Any]]) -> list[dict[str, str | int | float]]:
    """One row per package and one for all of them, from the files of coverage.py's report."""
    lines: dict[str, int] = defaultdict(int)
    run: dict[str, int] = defaultdict(int)
    for name, file in files.items():
        for package in (package_of(name), "all"):
            lines[package] += file["summary"]["num_statements"]
            run[package] += file["summary"]["covered_lines"]
    packages = [*sorted(lines.keys() - {"all"}), "all"]
    return [
        {"package": p, "lines": lines[p], "run": run[p], "share": run[p] / lines[p]}
        for p in packages
        if lines[p]
    ]


def package_of(file: str) -> str:
    """Package of a file: ``synfeal.render`` of ``synfeal/render/opengl/part.py``."""
    return ".".join(PurePath(file).parent.parts[:DEEPEST])


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the table of lines and print it."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.line_coverage", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks/coverage.csv"))
    out = parser.parse_args(arguments).out
    report = json.loads(Path("coverage.json").read_text(encoding="utf-8"))
    write_rows(out, COLUMNS, rows_of(report["files"]))
    print(out.read_text(encoding="utf-8"), end="")


if __name__ == "__main__":
    main()
