"""`python -m benchmarks.kept_modules`: what imports of jobs cost, and in how many jobs."""

import subprocess
import sys

import pandas as pd
import pytest

from benchmarks import kept_modules
from benchmarks.kept_modules import import_s, imports_of, starts
from synfeal.errors import InputError
from tests import ROOT


def test_imports_are_found_wherever_they_stand(tmp_path):
    script = tmp_path / "run_it.py"
    script.write_text(
        "import json\n\nwith open('x') as file:\n    from os import path as p\nrun(p)\n"
    )
    assert set(imports_of(script).splitlines()) == {"import json", "from os import path as p"}


def test_modules_are_kept_in_one_case_alone(tmp_path, monkeypatch):
    """Each process notes its store; only one store is ever filled, and by the first process."""
    monkeypatch.delenv("PYTHONDONTWRITEBYTECODE", raising=False)
    (tmp_path / "imported.py").write_text("VALUE = 1\n")
    notes = tmp_path / "notes"
    program = f"""
import sys
from pathlib import Path
sys.path.insert(0, {str(tmp_path)!r})
had = any(Path(sys.pycache_prefix).rglob("imported*.pyc"))
import imported
print(Path(sys.pycache_prefix).name, had, file=open({str(notes)!r}, "a"))
"""
    import_s(program, rounds=2)
    first, *later = notes.read_text().splitlines()
    assert first == "kept False"
    assert later == ["kept True", "empty False"] * 2


def test_savings_are_those_of_all_jobs(monkeypatch):
    monkeypatch.setattr(kept_modules, "import_s", lambda program, rounds: (1.0, 3.5))
    jobs = pd.DataFrame({"stage": ["train", "train", "summary"], "cpu_s": [10.0, 20.0, 5.0]})
    (row,) = starts(jobs, rounds=1).to_dict("records")
    assert (row["stage"], row["jobs"], row["run_cpu_s"]) == ("train", 2, 30.0)
    assert row["saved_cpu_s"] == pytest.approx(5.0)
    with pytest.raises(InputError, match="no job of"):
        starts(jobs[jobs.stage == "summary"], rounds=1)


def test_make_keeps_modules_where_the_environment_forbids_it():
    show = 'show:\n\t@echo "[$$PYTHONDONTWRITEBYTECODE]"\n'
    command = ["make", "--silent", "--file", "Makefile", "--file", "-", "show"]
    run = subprocess.run(
        command,
        cwd=ROOT,
        input=show,
        capture_output=True,
        text=True,
        check=True,
        env={"PATH": "/usr/bin:/bin", "PYTHONDONTWRITEBYTECODE": "1"},
    )
    assert run.stdout.strip() == "[]"
    # Python takes an empty value as unset.
    code = "import sys; print(sys.dont_write_bytecode)"
    python = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env={"PYTHONDONTWRITEBYTECODE": ""},
    )
    assert python.stdout.strip() == "False"
