"""One line for a person, the log for the rest, and types for what a rule hands over."""

import json
import subprocess
import sys

from tests.support.jobs import run_job


def test_job_tells_a_person_one_line_and_logs_the_rest_and_a_defects_traceback(tmp_path):
    run = run_job(tmp_path, "raise InputError('mesh.glb: holds no faces;\\n export it again')")
    assert run.returncode == 1
    assert run.stderr == "error: mesh.glb: holds no faces; export it again\n"
    assert run.stdout == ""
    log = (tmp_path / "job.log").read_text()
    assert "spoken" in log
    assert "native" in log
    run = run_job(tmp_path, "1 / 0")
    assert run.returncode == 1
    assert "ZeroDivisionError" in (tmp_path / "job.log").read_text()


CALL = """
import json
from pathlib import Path
from reproduction.runs.job import run_job
from synfeal.config.dataset import CameraConfig

def draw(camera: CameraConfig, count: int, out: Path) -> None:
    print("drawing")
    out.write_text(json.dumps([camera.width, count]))

run_job({log!r}, draw, camera={{"width": 64, "height": 48}}, count="3", out={out!r})
"""


def test_a_job_hands_its_function_what_that_annotates(tmp_path):
    log, out = tmp_path / "job.log", tmp_path / "out.json"
    code = CALL.format(log=str(log), out=str(out))
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert json.loads(out.read_text()) == [64, 3]
    assert log.read_text() == "drawing\n"
    wrong = code.replace("count='3'", "count='x'").replace('count="3"', 'count="x"')
    run = subprocess.run([sys.executable, "-c", wrong], capture_output=True, text=True, check=False)
    assert run.returncode == 1
    assert "count" in log.read_text()


def test_a_job_names_keys_of_the_configuration_where_functions_name_arguments(tmp_path):
    error = "InputError('m.glb', 'is narrow', 'widen `box`, give `depth_scale=100` or `min_seen`')"
    run = run_job(tmp_path, f"import logging; logging.warning('see `spacing_m`'); raise {error}")
    line = "m.glb: is narrow; widen `sampling_box`, give `depth_units_per_m: 100` or `min_seen`"
    assert run.stderr == f"error: {line}\n"
    log = (tmp_path / "job.log").read_text()
    assert "see `frame_spacing_m`\n" in log
    assert line in log
    about = "from synfeal.errors import Argument; raise InputError(Argument('box'), 'is empty')"
    assert run_job(tmp_path, about).stderr == "error: sampling_box: is empty\n"
