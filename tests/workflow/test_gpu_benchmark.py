"""The measurement of a GPU, at toy size on a processor."""

import os
import subprocess
import sys
from pathlib import Path

import pandas as pd

from benchmarks.gpu import measure
from benchmarks.gpu_cases import TOY_CASES, Case
from tests.support.collected import save_room

ROOT = Path(__file__).parents[2]


PROFILE = """
profile: toy
scale: 0.005
network: {{input_px: 32}}
collection: {{collision_agreement: null}}
scenes:
  large_room:
    source: mesh
    builder: null
    path: {room}
    up_axis: z
    sampling_box: {{x: [-2, 2], y: [-2, 2], z: [-1, 1]}}
"""


def test_the_script_draws_and_measures_without_a_gpu(tmp_path):
    room = save_room(tmp_path / "room.glb")
    (tmp_path / "toy.yaml").write_text(PROFILE.format(room=room))
    script = ["bash", ROOT / "benchmarks/gpu.sh", tmp_path / "out"]
    named = {"PYTHON": sys.executable, "DEVICE": "cpu", "SCALE": "toy"}
    environment = os.environ | named | {"PROFILE": str(tmp_path / "toy.yaml")}
    done = subprocess.run(script, env=environment, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr

    rates = pd.read_csv(tmp_path / "out/rates.csv")
    assert list(rates["processes"]) == [case.processes for case in TOY_CASES]
    assert (rates["card"] == "processor").all()
    # A step of B images in t milliseconds is 1000 B / t images in a second.
    alone = rates[rates["processes"] == 1]
    product = alone["images_per_s"] * alone["step_ms"] / 1000
    assert (abs(product - alone["batch"]) < 0.01).all()

    small = pd.read_csv(tmp_path / "out/errors_cpu.csv")
    large = pd.read_csv(tmp_path / "out/errors_224.csv")
    assert list(small["input_px"]) == [32]
    assert list(large["input_px"]) == [224]
    for errors in (small, large):
        # The room is 8.4 m from corner to corner.
        assert errors["position_m"].between(1e-3, 8.4).all()
        assert errors["orientation_deg"].between(1e-3, 180).all()


def test_a_case_that_is_lost_is_left_out_and_the_others_go_on(capfd):
    impossible = Case("posenet2", input_px=8)  # below what a network takes
    cases = (impossible, TOY_CASES[0])
    measured = [case for case, *_ in measure(cases, "cpu", 0.01)]
    assert measured == [TOY_CASES[0]]
    assert "lost: Case(localizer='posenet2', input_px=8" in capfd.readouterr().err
