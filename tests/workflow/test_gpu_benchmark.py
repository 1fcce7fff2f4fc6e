"""The measurement of a GPU, at toy size on a processor."""

import os
import subprocess
import sys
from pathlib import Path

import pandas as pd

from benchmarks import gpu
from tests.support.colored_frames import write_split

ROOT = Path(__file__).parents[2]


def test_the_script_measures_rates_and_errors_without_a_gpu(tmp_path):
    for name in ("frames", "labels"):
        (tmp_path / "data" / name).mkdir(parents=True)
    for split, count in (("train", 30), ("test", 10)):
        frames, labels = write_split(tmp_path, split, count, 0)
        frames.rename(tmp_path / "data/frames" / frames.name)
        labels.rename(tmp_path / "data/labels" / labels.name)
    script = ["bash", ROOT / "benchmarks/gpu.sh", tmp_path / "out", tmp_path / "data"]
    environment = os.environ | {"PYTHON": sys.executable, "DEVICE": "cpu", "SCALE": "toy"}
    done = subprocess.run(script, env=environment, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    rates = pd.read_csv(tmp_path / "out/rates.csv")
    assert list(rates["processes"]) == [case.processes for case in gpu.TOY_CASES]
    assert (rates["card"] == "processor").all()
    # A step of B images in t milliseconds is 1000 B / t images in a second.
    alone = rates[rates["processes"] == 1]
    product = alone["images_per_s"] * alone["step_ms"] / 1000
    assert (abs(product - alone["batch"]) < 0.01).all()
    errors = pd.read_csv(tmp_path / "out/errors_cpu.csv")
    assert (errors["position_m"] > 0).all()
    assert (errors["orientation_deg"] > 0).all()


def test_a_case_that_is_lost_is_left_out_and_the_others_go_on(capfd):
    impossible = gpu.Case("posenet2", input_px=8)  # below what a network takes
    cases = (impossible, gpu.TOY_CASES[0])
    measured = [case for case, _ in gpu.measure(cases, "cpu", 0.01)]
    assert measured == [gpu.TOY_CASES[0]]
    assert "lost: Case(localizer='posenet2', input_px=8" in capfd.readouterr().err
