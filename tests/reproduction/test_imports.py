"""Jobs import what they use: a budget of modules that a job of each kind must not import.

Hundreds of jobs are processes of a few seconds, and large libraries take a second to import.
"""

import gc
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from reproduction.runs.job import uncollected

ROOT = Path(__file__).parents[2]
# Functions of rules, and the modules that their jobs do without.
BUDGETS = {
    "baselines.training.score:write_scores": [
        "torch",
        "matplotlib",
        "pandas",
        "trimesh",
        "open3d",
        "networkx",
        "scipy",
        "sympy",
    ],
    "baselines.training.experiment:train_and_score": [
        "torch._dynamo",
        "torch._inductor",
        "sympy",
        "matplotlib",
        "pandas",
        "trimesh",
        "open3d",
        "networkx",
        "scipy",
    ],
    "synfeal.dataset.render_sequence:render_packed": [
        "torch",
        "matplotlib",
        "pandas",
        "sympy",
    ],
    "synfeal.dataset.packed:write_packed": ["torch", "matplotlib", "pandas", "trimesh", "scipy"],
    "synfeal.dataset.pose_table:write_first_frames": [
        "torch",
        "matplotlib",
        "pandas",
        "trimesh",
        "scipy",
    ],
    "baselines.labels.posegraph.toro:by_toro": ["torch", "matplotlib", "pandas", "open3d", "gtsam"],
    "baselines.labels.posegraph.levenberg_marquardt:by_g2o": [
        "torch",
        "matplotlib",
        "pandas",
        "open3d",
        "numba",
    ],
    "baselines.references.varied:write_varied": ["torch", "matplotlib", "pandas", "open3d"],
    "synfeal.planning.plan:write_plan": ["torch", "matplotlib", "pandas"],
}
OPTIMISERS = """
import torch
from baselines.training.optimizer import OPTIMISERS, Schedule
for make in OPTIMISERS.values():
    network = torch.nn.Linear(3, 2)
    optimisation = make(network, Schedule(64, 8, 1e-3, 0.0))
    for _ in range(2):
        optimisation.step(network(torch.ones(1, 3)).sum())
    optimisation.load_state_dict(optimisation.state_dict())
"""


def modules_after(code):
    """Return the modules a new process has imported after this code."""
    code += "\nimport json, sys\nprint(json.dumps(sorted(sys.modules)))"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", code]
    run = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return set(json.loads(run.stdout))


@pytest.mark.parametrize("function", BUDGETS)
def test_a_job_does_not_import_what_it_does_not_use(function):
    code = "import reproduction.runs.job\nfrom pkgutil import resolve_name\n"
    code += f"resolve_name({function!r})"
    imported = modules_after(code)
    assert function.partition(":")[0] in imported
    assert not imported.intersection(BUDGETS[function])


def test_training_steps_do_not_import_torchs_compiler():
    imported = modules_after(OPTIMISERS)
    assert "torch" in imported
    assert not imported & {"torch._dynamo", "torch._inductor", "sympy"}


def test_imports_are_not_looked_through_for_garbage_then_or_later():
    made, kept = [], gc.get_freeze_count()
    try:
        with uncollected():
            assert not gc.isenabled()
            made = [[] for _ in range(1000)]
        assert gc.isenabled()
        assert gc.get_freeze_count() >= kept + len(made)
        with pytest.raises(ImportError), uncollected():
            import absent_module  # noqa: F401
        assert gc.isenabled()
        gc.disable()
        with uncollected():
            pass
        assert not gc.isenabled()  # as it was before
    finally:
        gc.enable()
        gc.unfreeze()


@pytest.mark.parametrize("script", ["run_pretrain", "run_train", "run_train_varied"])
def test_scripts_that_import_torch_collect_no_garbage_meanwhile(script):
    text = (ROOT / f"workflow/scripts/{script}.py").read_text()
    assert "with uncollected():\n    from baselines.training" in text
