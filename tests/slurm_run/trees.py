"""What results hold: which files are promised to be the same, and which differ in two trees."""

from __future__ import annotations

import fnmatch
import hashlib
import re
import sys
from pathlib import Path

# Files of a results directory that say how long something took, or embed what does; by why.
TIMED = {
    "benchmarks/*": "what jobs took",
    "benchmarks.csv": "what jobs took",
    "logs/*": "progress and times",
    "provenance.json": "dates, times and hashes of timed files",
    "report.html": "shows what jobs took",
    "report.tex": "shows times of hard cases",
    "summary.txt": "says where the results lie",
    "references/*/facts.json": "what answers took",
    "scenes/*/collection_speed.json": "times of frames",
    "scenes/*/effects_speed.csv": "times of frames",
    "scenes/*/render_speed.csv": "times of frames",
    "scenes/*/collision_curve.csv": "times of rays",
    "tables/speed_vs_error.csv": "times",
    "tables/hard_cases.csv": "times of every case",
    "groundtruth/*.json": "what stages of a batch took",
    "figures/speed_vs_error*": "shows times",
}
# Parts of files that say so; what is compared is the rest.
TIMED_PARTS = {
    "claims.csv": re.compile(rb"^C14,.*\n", re.MULTILINE),  # the rate of collection
    "tables/label_error.csv": re.compile(rb",[^,\n]*,[^,\n]*$", re.MULTILINE),  # seconds and MB
    "tables/references.csv": re.compile(rb",[^,\n]*$", re.MULTILINE),  # seconds
    "tables/label_error.tex": re.compile(rb"&[^&\n]*&[^&\n]*$", re.MULTILINE),
}
# Files that go when what needs them is made.
PASSING = ("frames/*/shards/*", "runs/*/resume.pt")
HIDDEN = ".*"  # the lock, Snakemake's stamps, and what is not finished


def reason_to_differ(name: str) -> str | None:
    """Why a file, by its path below the results directory, may differ between two runs."""
    return next((why for pattern, why in TIMED.items() if fnmatch.fnmatch(name, pattern)), None)


class Hashes:
    """SHA-256 of files without ``TIMED_PARTS``; one that has not changed is not read again."""

    def __init__(self) -> None:
        self._known: dict[Path, tuple[tuple[int, int], str]] = {}

    def of(self, path: Path) -> str:
        """Of one file."""
        stat = path.stat()
        state = (stat.st_mtime_ns, stat.st_size)
        if path not in self._known or self._known[path][0] != state:
            self._known[path] = (state, hashlib.sha256(_compared(path)).hexdigest())
        return self._known[path][1]

    def tree(self, root: Path) -> dict[str, str]:
        """Of all finished files below a directory that stay, by their paths there."""
        paths = (path for path in sorted(root.rglob("*")) if path.is_file())
        named = ((path.relative_to(root), path) for path in paths)
        return {
            name.as_posix(): self.of(path)
            for name, path in named
            if not any(fnmatch.fnmatch(part, HIDDEN) for part in name.parts)
            and not is_passing(name)
        }


def _compared(path: Path) -> bytes:
    content = path.read_bytes()
    for name, part in TIMED_PARTS.items():
        if path.match(name):
            content = part.sub(b"", content)
    return content


def is_passing(name: Path) -> bool:
    """Whether a file, by its path below the results directory, is not there in the end."""
    return any(fnmatch.fnmatch(name.as_posix(), pattern) for pattern in PASSING)


def damaged(expected: dict[str, str], found: dict[str, str]) -> list[str]:
    """Files under final names that are promised to be those of another tree, and are not."""
    return sorted(
        name for name in found if expected.get(name) != found[name] and not reason_to_differ(name)
    )


def missing(expected: dict[str, str], found: dict[str, str]) -> list[str]:
    """Files of a complete tree that another one lacks."""
    return sorted(expected.keys() - found.keys())


if __name__ == "__main__":  # EXPECTED FOUND: names what differs between two results directories
    trees = [Hashes().tree(Path(root)) for root in sys.argv[1:3]]
    differing = damaged(*trees) + missing(*trees)
    sys.exit("\n".join(["these files differ or lack:", *differing]) if differing else 0)
