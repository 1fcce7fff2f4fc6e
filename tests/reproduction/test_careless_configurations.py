"""Whatever a configuration file holds: one line that names the file, the key, and what to do."""

import os
import subprocess
import sys

import pytest

from reproduction.config.load import check_mesh_files, check_results
from reproduction.design.profiles import read_profile
from synfeal.cli import main
from tests import ROOT
from tests.support.careless import FILES
from tests.support.fuzzing import problem_with

DIGITS = "9" * 5000
BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{after}: &{after} [{', '.join(9 * [f'*{before}'])}]\n"
    for before, after in zip("abcdefgh", "bcdefghi", strict=True)
)

# What the file holds, and what the message has to say besides the file's name.
TABLE = (
    # unknown keys, and keys at the wrong place
    ("profle: mine", "profle: unknown key; allowed here: archive_sequences, collection, dataset"),
    ("collection: {spacing: 0.1}", "collection.spacing: unknown key; allowed here: around_m"),
    ("scenes: {large_room: {colour: red}}", "scenes.large_room.colour: unknown key"),
    ('"": 1', "'': unknown key"),
    ("null: 2", "None: keys must be text"),
    # values of another kind
    ("seed: one", "seed: must be a whole number"),
    ("scenes: {large_room: {sizes: {6k: 1500}}}", "scenes.large_room.sizes.6k: must hold a map"),
    # numbers out of range: negative, none at all, huge
    (f"seed: {DIGITS}", "cannot be read as YAML"),
    ("scale: 1.5", "scale: must be 1 or less"),
    ("collection: {frame_spacing_m: 1e-9}", "collection.frame_spacing_m: "),
    ("network_camera: {near_m: 5, far_m: 1}", "near_m: must be below far_m"),
    ("network_camera: {fx: 500}", "fx: fx, fy, cx and cy are given together"),
    # units
    ("scenes: {large_room: {angles: {pitch_deg: [-90, 90]}}}", "pitch_deg: must lie within"),
    ("scenes: {large_room: {sampling_box: [0, 5, 0, 5]}}", "sampling_box: must hold a mapping"),
    ("scenes: {large_room: {sampling_box: {x: [5, 0], y: [0, 1], z: [0, 1]}}}", "x: the first"),
    ("scenes: {attic: {source: mesh, path: a.glb, sampling_box: {x: [0, 5]}}}", "box.y: missing"),
    # what does not go together
    ("collection: {mode: repeat}", "repeat: mode `repeat` needs the poses"),
    ("network: {width: 1.0}", "network.width: must be 0.25 when pretraining.source is shipped"),
    ("network_camera: {width: 20, height: 20}", "network_camera: both sides must be at least"),
    ("training: {patience: 3}", "patience: must be left out with `protocol: corrected`"),
    ("datasets: [attic]", "datasets: 'attic' is not one of ['large_room', 'sanctuary']"),
    ("scenes: {attic: {source: mesh}}", "path: a scene with `source: mesh` needs the path"),
    ("scenes: {attic: {source: procedural}}", "builder: a scene with `source: procedural` needs"),
    ("references: {external: {mine: {title: Mine}}}", "give either `poses` or `command`"),
    ("network: {input_px: 96}", "network_camera: both sides must be at least 96 pixels"),
    ("network: {backbone: inception_v3}", "network.input_px: must be at least 75"),
    ("pretraining: {source: rooms}", "pretraining.source: "),
    ("pretraining: {source: imagenet}", "network.width: must be 1"),
    ("network_camera: {near_m: 200}", "network_camera.near_m: must be below far_m"),
    (
        "localizers: {posenet: {lr: 1}}",
        "localizers.posenet.lr: unknown key; allowed here: auxiliary, beta",
    ),
    # effects
    ("render: {effects: {motion_blur: {exposure_s: 0.7}}}", "0.7 s is longer than the 0.5 s"),
    ("render: {effects: {light: {ev: [1, -1]}}}", "light.ev: the first number"),
    ("render: {effects: {light: {states: [disco]}}}", "light.states.0: "),
    ("render: {effects: {clutter: {}, light: {states: [night]}}}", "effects.clutter: it is not"),
    # paths
    ("experiments: absent.csv", "absent.csv: cannot be read as CSV (No such file or directory)"),
    ("experiments: config", "config: cannot be read as CSV (Is a directory)"),
    ("experiments: README.md", "README.md: "),
    ("results: README.md", "results: README.md is not a directory; choose another one"),
    ('results: "a\\0b"', "results: must not hold the character NUL"),
    ("profile: ../mini", "profile: must match ^[a-z0-9]"),
    (
        "{datasets: [attic], scenes: {attic: {source: mesh, path: absent.glb}}}",
        "scenes.attic.path: absent.glb does not",
    ),
    ("network_camera: {calibration: absent.yaml}", "calibration: absent.yaml: cannot be read as"),
    # YAML that is more than plain values, or none
    ("seed:\n\t1", "line 2: found character '\\t' that cannot start any token"),
    ("seed: !!python/object/apply:os.getcwd []", "could not determine a constructor for the tag"),
    ("seed: !!int x", "'x' is no number"),
    ("profile: 2026-13-45", "month"),
    (BOMB, "aliases (*name) are not read"),
    ("profile", "must hold a mapping of keys, found 'profile'"),
    ("seed: 1\n---\nseed: 2", "expected a single document in the stream"),
)


def read(path):
    """Check a profile as the workflow does before it plans a run."""
    config = read_profile(str(path)).config
    check_mesh_files(config.scenes)
    check_results(config.root)


@pytest.mark.parametrize(("text", "words"), TABLE, ids=[words[:40] for _, words in TABLE])
def test_a_careless_configuration_ends_in_one_line(text, words, tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    path = tmp_path / "mine.yaml"
    path.write_text(f"{text}\n", encoding="utf-8")
    assert problem_with(lambda: read(path), lambda _: False, (words,), tmp_path) is None


def test_run_hands_a_sound_profile_to_snakemake(tmp_path, monkeypatch):
    started = []
    monkeypatch.setattr(
        os, "execve", lambda _, command, env: started.append((command, env["PYTHONPATH"]))
    )
    monkeypatch.chdir(ROOT)
    path = tmp_path / "mine.yaml"
    path.write_text("profile: mine\n")
    assert main(["run", "--profile", str(path), "smoke", "--cores", "3", "--", "runs", "-n"]) == 0
    assert main(["run", "--cores", "1"]) == 0
    (command, paths), (default, _) = started
    files = ["--configfile", str(path), "config/smoke.yaml"]
    display = ["snakemake", "--logger", "synfeal", "--quiet", "host"]
    assert command[2:] == [*display, *files, "--cores", "3", "runs", "-n"]
    assert default[2:] == [*display, "--cores", "1"]
    assert paths.split(os.pathsep)[0] == str(ROOT / "workflow/plugins")


@pytest.mark.parametrize("content", [FILES["deep.yaml"], b"profile: ../mini\n"])
def test_run_ends_in_one_line_where_snakemake_has_a_traceback(content, tmp_path):
    """The command as it is typed; to the second file only Snakemake itself comes."""
    path = tmp_path / "mine.yaml"
    path.write_bytes(content)
    command = [sys.executable, "-m", "synfeal.cli", "run", "--profile", str(path), "--cores", "1"]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    (line,) = [line for line in run.stderr.splitlines() if line.strip() and "profiles/" not in line]
    assert run.returncode == 1
    assert line.startswith("error: ")
    assert str(path) in line
    assert not run.stdout
