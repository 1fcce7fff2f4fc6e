"""A collection that is killed again and again ends in the same bytes as one left in peace.

``python -m benchmarks.collect_faults`` collects a small data set undisturbed, then kills the same
command with SIGKILL at random moments and runs it again. After every kill each file under its
final name must be whole; in the end the two data sets must be the same, byte by byte.
"""

from __future__ import annotations

import argparse
import hashlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from PIL import Image

from synfeal.dataset.pose_table import read_pose_table
from synfeal.dataset.sevenscenes import read_pose
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.save import save_glb

SIZE = ("--width", "160", "--height", "120", "--depth", "--spacing", "0.2", "--packed", "32")


@dataclass(frozen=True)
class Killing:
    """What happened to one command.

    Attributes:
        after_s: when it was killed.
        killed: it had not ended before.
        n_files: whole files it left under their final names, those of earlier attempts included.
    """

    after_s: float
    killed: bool
    n_files: int


def save_room(path: Path, seed: int = 0) -> None:
    """A closed room of 6 x 5 x 3 m with coloured corners."""
    box = trimesh.creation.box((6.0, 5.0, 3.0))
    colors = np.random.default_rng(seed).integers(0, 256, (8, 3), np.uint8)
    part = MeshPart("room", np.asarray(box.vertices), np.asarray(box.faces), vertex_rgb=colors)
    save_glb(path, TexturedMesh((part,)))


def command(mesh: Path, out: Path, n_frames: int, *more: str) -> list[str]:
    """A collection of training frames, and a quarter as many test frames."""
    frames = ("--frames", str(n_frames), "--test-frames", str(n_frames // 4))
    start = (sys.executable, "-m", "synfeal.cli", "collect", "--mesh", str(mesh))
    return [*start, "--out", str(out), *frames, *SIZE, *more]


def tree_of(directory: Path) -> dict[str, str]:
    """SHA-256 of every file below a directory, by its path there."""
    return {
        path.relative_to(directory).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(directory.rglob("*"))
        if path.is_file()
    }


def kill_after(arguments: Sequence[str], out: Path, seconds: float) -> Killing:
    """Start a collection into ``out``, kill it after some time, and check what it left."""
    with subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
        try:
            _, errors = process.communicate(timeout=seconds)
            killed = False
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            killed = True
    if not killed and process.returncode:
        raise RuntimeError(errors.decode())
    return Killing(seconds, killed, check_whole(out if out.exists() else Path(f"{out}.part/data")))


def check_whole(data: Path) -> int:
    """Read every file of a data set under a final name to its end; how many there are.

    Raises:
        Exception: one of them is not whole.
    """
    paths = [path for path in data.rglob("[!.]*") if path.is_file()]
    for path in paths:
        if path.suffix == ".png":
            with Image.open(path) as image:
                image.load()
        elif path.suffix == ".csv":
            read_pose_table(path)
        elif path.suffix == ".npy":
            np.load(path)
        elif path.name.endswith(".pose.txt"):
            read_pose(path)
    return len(paths)


def main(arguments: Sequence[str] | None = None) -> None:
    """Kill collections and compare."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.collect_faults", description=__doc__
    )
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--frames", type=int, default=800, help="training frames")
    parser.add_argument("--workers", default="1", help="processes that render")
    options = parser.parse_args(arguments)
    rng = np.random.default_rng(0)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        save_room(folder / "room.glb")
        more = ("--workers", options.workers)
        begin = time.perf_counter()
        subprocess.run(
            command(folder / "room.glb", folder / "calm", options.frames, *more), check=True
        )
        whole_s = time.perf_counter() - begin
        expected = tree_of(folder / "calm")
        print(f"undisturbed: {len(expected)} files in {whole_s:.1f} s")
        n_kills = n_sets = 0
        while n_kills < options.kills:
            out = folder / f"killed-{n_sets}"
            again = command(folder / "room.glb", out, options.frames, *more)
            result = kill_after(again, out, rng.uniform(0.3, 1.0) * whole_s)
            n_kills += result.killed
            said = f"kill {n_kills}" if result.killed else "ended"
            print(f"{said} after {result.after_s:.2f} s: {result.n_files} files, all whole")
            if out.exists():
                _compare(expected, tree_of(out))
                n_sets += 1
        subprocess.run(again, check=not out.exists(), capture_output=True)
        _compare(expected, tree_of(out))
        leftovers = [path.name for path in folder.iterdir() if ".part" in path.name]
        print(f"{n_kills} kills, {n_sets + 1} data sets, all equal; left over: {leftovers}")


def _compare(expected: dict[str, str], found: dict[str, str]) -> None:
    differing = {name for name in expected | found if expected.get(name) != found.get(name)}
    if differing:
        raise RuntimeError(f"files differ: {sorted(differing)[:10]}")


if __name__ == "__main__":
    main()
