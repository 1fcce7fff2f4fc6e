"""Contents of results: which files are promised to be the same, and which differ in two trees."""

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
    "references/*/facts.json": "what answers took",
    "references/*-costs.json": "what test frames took before",
    "scenes/*/collection_speed.json": "times of frames",
    "scenes/*/effects_speed.csv": "times of frames",
    "scenes/*/render_speed.csv": "times of frames",
    "scenes/*/collision_curve.csv": "times of rays",
    "tables/speed_vs_error.csv": "times",
    "estimates/*.json": "what stages of a batch took",
    "figures/speed_vs_error*": "shows times",
}
# Parts of files that say so; what is compared is the rest.
TIMED_PARTS = {
    "claims.csv": re.compile(rb"^C14,.*\n", re.MULTILINE),  # the rate of collection
    "tables/label_error.csv": re.compile(rb",[^,\n]*,[^,\n]*$", re.MULTILINE),  # seconds and MB
    "tables/references.csv": re.compile(rb",[^,\n]*,[^,\n]*$", re.MULTILINE),  # seconds
    "tables/label_error.tex": re.compile(rb"&[^&\n]*&[^&\n]*$", re.MULTILINE),
}
# Files that go when what needs them is made.
PASSING = ("frames/*/shards/*", "runs/*/resume.pt")
HIDDEN = ".*"  # the lock, Snakemake's stamps, and what is not finished


def reason_to_differ(name: str) -> str | None:
    """Why a file, by its path below the results directory, may differ between two runs."""
    return next((why for pattern, why in TIMED.items() if fnmatch.fnmatch(name, pattern)), None)


def hashes_of(root: Path) -> dict[str, str]:
    """SHA-256, without ``TIMED_PARTS``, of all finished files that stay, by their paths."""
    return {
        path.relative_to(root).as_posix(): hashlib.sha256(_compared(path)).hexdigest()
        for path in sorted(root.rglob("*"))
        if path.is_file() and _stays(path.relative_to(root))
    }


def _stays(name: Path) -> bool:
    passing = any(fnmatch.fnmatch(name.as_posix(), pattern) for pattern in PASSING)
    return not passing and not any(fnmatch.fnmatch(part, HIDDEN) for part in name.parts)


def _compared(path: Path) -> bytes:
    content = path.read_bytes()
    for name, part in TIMED_PARTS.items():
        if path.match(name):
            content = part.sub(b"", content)
    return content


def differing(expected: dict[str, str], found: dict[str, str]) -> list[str]:
    """Files promised to be those of another tree that are not, or of which one tree lacks one."""
    return sorted(
        name
        for name in expected.keys() | found.keys()
        if expected.get(name) != found.get(name)
        and (name not in found or not reason_to_differ(name))
    )


if __name__ == "__main__":  # EXPECTED FOUND: names what differs between two results directories
    off = differing(*(hashes_of(Path(root)) for root in sys.argv[1:3]))
    sys.exit("\n".join(["these files differ or lack:", *off]) if off else 0)
