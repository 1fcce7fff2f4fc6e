"""``python -m reproduction.real.down scan.json``: the gravity of a scan, for another."""

from __future__ import annotations

import sys
from pathlib import Path

from synfeal.records.files import read_json


def gravity_option(record: Path) -> str:
    """Write the way down that ``synfeal scan`` found as its option; nothing where none was."""
    found = read_json(record)["gravity"]
    if not isinstance(found, dict):  # given or kept, by options that the other scan has too
        return ""
    return "--gravity " + " ".join(f"{-value:.9f}" for value in found["up"])


if __name__ == "__main__":
    print(gravity_option(Path(sys.argv[1])))
