"""Publication of a finished run to ``results/published/<profile>``, where pages read it.

``python -m reproduction.report.publish --profile mini`` takes tables, claims, summary, provenance
and job times from ``results/mini``, and of its figures those that a page shows. Nothing else of a
run is tracked, so making results never changes the repository; publishing does.
"""

from __future__ import annotations

import argparse
import re
import shutil
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from reproduction.report.html.provenance import hashes
from reproduction.runs.published import PUBLISHED
from reproduction.runs.results import read_result, read_text
from synfeal.errors import InputError, exit_status
from synfeal.records.files import atomic_directory

RESULTS = Path("results")
FINISHED = ("claims.csv", "claim_effects.csv", "summary.md", "provenance.json", "benchmarks.csv")


def publish(root: Path, target: Path, pages: Iterable[Path]) -> None:
    """Replace what is published of a profile by what its run made.

    A run of labels alone (target ``labels``) has tables and figures and no more.

    Args:
        root: Results of the run, ``results/<profile>``.
        target: Folder of its published files; what lies there is replaced as a whole, or stays.
        pages: Markdown files; figures of ``target`` that they show are published.

    Raises:
        InputError: the run is not finished, its files are not those of its provenance, or a page
            shows a figure that it has not.
    """
    tables = sorted(p for p in (root / "tables").glob("*.*") if p.suffix in (".csv", ".tex"))
    if not tables:
        raise InputError(f"{root}/tables", "holds no tables", "make the results first")
    paths = [*tables, *_records(root), *_shown_figures(root, target, pages)]
    _check_provenance(root, paths)
    with atomic_directory(target, replace=True) as directory:
        for path in paths:
            copy = directory / path.relative_to(root)
            copy.parent.mkdir(exist_ok=True)
            shutil.copyfile(path, copy)


def _records(root: Path) -> list[Path]:
    """List the records of a run of everything; nothing for a run of labels alone."""
    missing = [name for name in FINISHED if not (root / name).is_file()]
    if len(missing) == len(FINISHED):
        return []
    if missing:
        raise InputError(root / missing[0], "missing", "finish the run, then publish it")
    return [root / name for name in FINISHED]


def _shown_figures(root: Path, target: Path, pages: Iterable[Path]) -> list[Path]:
    pattern = re.compile(rf"{re.escape(target.as_posix())}/(figures/[\w.-]+)\)")
    shown = {(name, page) for page in pages for name in pattern.findall(read_text(page))}
    for name, page in sorted(shown):
        if not (root / name).is_file():
            raise InputError(root / name, f"missing, and {page} shows it", "make it first")
    return sorted({root / name for name, _ in shown})


def _check_provenance(root: Path, paths: Iterable[Path]) -> None:
    """Refuse to publish tables of one run with the provenance of another."""
    record = root / "provenance.json"
    if record not in paths:
        return
    files = read_result(record, ["files"], "make the results again")["files"]
    for name, found in hashes(paths, root).items():
        if files.get(name, found) != found:
            raise InputError(root / name, f"is not the file of {record}", "finish the run")


def main(argv: Sequence[str] | None = None) -> int:
    """Publish the run of one profile."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--profile", default="mini", help="the run: results/PROFILE (mini)")
    profile = parser.parse_args(argv).profile
    pages = [Path("README.md"), *sorted(Path("docs").glob("*.md"))]
    status = exit_status(
        lambda: publish(RESULTS / profile, PUBLISHED / profile, pages), "publish again"
    )
    if not status:
        print(f"{PUBLISHED / profile}: published; git diff shows what changed")
    return status


if __name__ == "__main__":
    sys.exit(main())
