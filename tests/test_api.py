"""Synfeal from Python: the quick start runs, files are the command's, nothing loads early."""

import copy
import re
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

import synfeal
from synfeal.errors import InputError
from tests.collected import collect, save_room

QUICKSTART = Path(__file__).parent.parent / "docs" / "quickstart.ipynb"


def texts(notebook):
    """What each cell of code says: printed, or its value."""
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    said = [[o.get("text") or o.data.get("text/plain", "") for o in c.outputs] for c in cells]
    return ["".join(parts).split(" at 0x")[0] for parts in said]


def test_the_quick_start_runs(tmp_path):
    shown = nbformat.read(QUICKSTART, as_version=4)
    ran = copy.deepcopy(shown)
    place = {"metadata": {"path": tmp_path}}
    NotebookClient(ran, timeout=600, startup_timeout=600, resources=place).execute()
    for notebook in (shown, ran):  # what stands in the file, and what comes of it now
        _, seen, made, scored = texts(notebook)
        assert "(120, 160, 3) nearest surface at" in seen
        assert "40 training frames, 10 test frames, camera 160\nwrong with it: nothing" in made
        assert re.search(r"position_m +0\.080", scored)
    assert synfeal.open_dataset(tmp_path / "mydata").train.poses.position_m.shape == (40, 3)


def test_the_functions_make_what_the_command_makes(tmp_path):
    mesh = save_room(tmp_path / "room.glb")
    assert collect(mesh, tmp_path / "typed") == 0
    options = {"width": 40, "height": 33, "spacing": 0.2, "sequence_frames": 10}
    data = synfeal.collect(mesh, tmp_path / "called", 24, test_frames=8, **options)
    for name in ("train.csv", "manifest.json", "seq-02/frame-000003.color.png"):
        assert (data.path / name).read_bytes() == (tmp_path / "typed" / name).read_bytes()
    assert (
        data.test.images[0].read_bytes()
        == (tmp_path / "typed" / "seq-04" / "frame-000000.color.png").read_bytes()
    )
    with pytest.raises(InputError, match=r"^--spacing: "):
        synfeal.plan(mesh, 10, spacing=-1)
    with pytest.raises(InputError, match=r"^colour: no such option"):
        synfeal.plan(mesh, 10, colour="red")


def loaded_by(code, among):
    """Which of some modules a fresh interpreter has loaded after some code."""
    code = f"{code}\nimport sys; print(*sorted({among!r} & set(sys.modules)))"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return run.stdout.strip()


def test_nothing_is_loaded_early_and_collecting_needs_no_networks():
    assert not loaded_by("import synfeal", {"numpy", "pydantic", "scipy", "torch", "trimesh"})
    names = ("api", "inspect.run", "validation.run", "export.run", "evaluation.run")
    code = "\n".join(f"import synfeal.{name}" for name in names)
    assert not loaded_by(code, {"baselines", "cv2", "gtsam", "open3d", "snakemake", "torch"})
