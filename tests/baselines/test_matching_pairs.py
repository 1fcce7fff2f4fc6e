"""The example of a data loader for matchers."""

import subprocess
import sys
from pathlib import Path

import synfeal
from synfeal.mesh.save import save_glb
from tests.support.small_room import furnished_room

EXAMPLE = Path(__file__).parents[2] / "examples" / "matching_pairs.py"


def test_corresponding_points_have_the_same_colour(tmp_path):
    save_glb(tmp_path / "room.glb", furnished_room((24,)))
    options = {"width": 80, "height": 60, "spacing_m": 0.15, "depth": True, "backend": "raycast"}
    synfeal.collect(tmp_path / "room.glb", tmp_path / "set", 12, **options)
    synfeal.pairs(tmp_path / "set", tmp_path / "pairs", per_frame=2, max_overlap=0.97)
    command = [sys.executable, str(EXAMPLE), str(tmp_path / "set"), str(tmp_path / "pairs")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    words = done.stdout.split()
    same, other = (float(words[at + 1]) for at, word in enumerate(words) if word == "by")
    assert int(words[0]) >= 6
    assert same < 6.0 < 12.0 < other
