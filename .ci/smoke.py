"""Install wheels alone into an empty environment, use them, and say what that took.

``smoke.py WHEELS simulator|scan|baselines|reproduction [--folder DIR]``: WHEELS is a folder of the
project's wheels. Nothing is compiled (pip takes wheels only, but for PyOpenGL), and nothing of the
checkout can be imported. Prints the seconds and megabytes of the installation, and of every
command the seconds.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
COLLECT = (
    "collect room.glb --up-axis z --frames 60 --test-frames 16 --width 240 --height 180"
    " --spacing 0.1 --depth --out set"
)
SIMULATOR = (
    "--version",
    COLLECT,
    "inspect room.glb --up-axis z --out room",
    "validate set",
    "preview set --out set.gif",
    "export set --to colmap --out set-colmap",
    "evaluate set set/test.csv --out scores",
)
SCAN = (COLLECT, "scan set --out scan.glb", "inspect scan.glb --out scan")
BASELINES = (
    COLLECT,
    "train set --images 600 --device cpu --out trained",
    "localize trained/model.pt set/seq-01 --turns 0 --out by_model.csv",
    "map set --out map",
    "localize map set/seq-01 --camera set/manifest.json --out by_map.csv",
    "evaluate set by_map.csv --split train --out scores",
)
REPRODUCTION = ("plan --help", "run --help", "compare --help")
PARTS = {
    "simulator": ("synfeal", SIMULATOR),
    "scan": ("synfeal[scan]", SCAN),
    "baselines": ("synfeal-baselines", BASELINES),
    "reproduction": ("synfeal-reproduction", REPRODUCTION),
}


def main() -> None:
    """Install one part and run its commands; a command that fails ends with its output."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("wheels", type=Path)
    parser.add_argument("part", choices=PARTS)
    parser.add_argument("--folder", type=Path, help="where to work (a temporary folder)")
    arguments = parser.parse_args()
    wheels = arguments.wheels.resolve()
    if arguments.folder is None:
        with tempfile.TemporaryDirectory() as folder:
            smoke(wheels, arguments.part, Path(folder))
    else:
        arguments.folder.mkdir(parents=True)
        smoke(wheels, arguments.part, arguments.folder.resolve())


def smoke(wheels: Path, part: str, folder: Path) -> None:
    """Install ``part`` from ``wheels`` into ``folder``, and run its commands there."""
    requirement, commands = PARTS[part]
    # PyOpenGL 3.1.0, which pyrender pins, is pure Python but has no wheel.
    kinds = ["--prefer-binary"] if part == "reproduction" else ["--only-binary", ":all:"]
    run(folder, sys.executable, "-m", "venv", "venv")
    binaries = folder / "venv" / ("Scripts" if os.name == "nt" else "bin")
    python = binaries / "python"
    empty_mb = megabytes(folder / "venv")
    seconds = run(
        folder, python, "-m", "pip", "install", "--quiet", *kinds,
        "--find-links", wheels, requirement,
    )  # fmt: skip
    print(f"install {requirement}: {seconds:.0f} s, {megabytes(folder / 'venv') - empty_mb:.0f} MB")
    run(folder, python, HERE / "smoke_room.py", "room.glb")
    for command in commands:
        seconds = run(folder, binaries / "synfeal", *command.split())
        print(f"{seconds:6.1f} s  synfeal {command}", flush=True)


def run(folder: Path, *command: object) -> float:
    """Run a command in ``folder`` and return its seconds; end this program if it fails."""
    # Neither PYTHONPATH nor the folder above may lend a module that is not in a wheel.
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    start = time.monotonic()
    done = subprocess.run(
        [str(word) for word in command],
        cwd=folder,
        env=environment | {"PYTHONSAFEPATH": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        encoding="utf-8",
        errors="replace",
        check=False,
    )
    if done.returncode:
        sys.exit(
            f"{done.stdout}\nerror: exit status {done.returncode} of {' '.join(map(str, command))}"
        )
    return time.monotonic() - start


def megabytes(folder: Path) -> float:
    """Add up the sizes of all files below ``folder``."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()) / 1e6


if __name__ == "__main__":
    main()
