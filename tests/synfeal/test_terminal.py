"""A command and its terminal: Ctrl-C before it works, letters it lacks, a reader that leaves."""

import io
import subprocess
import sys
import time

import pytest

from synfeal.cli import main, parser
from synfeal.records import progress

LIBRARIES = ("argparse", "dataclasses", "numpy", "pydantic", "PIL", "scipy", "yaml", "trimesh")


def test_nothing_slow_is_imported_before_ctrl_c_is_handled():
    code = f"import sys, synfeal.cli.program; print([n for n in {LIBRARIES} if n in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_ctrl_c_before_anything_is_begun_is_one_line():
    code = (
        "import os, signal\nfrom synfeal.cli import program\n"
        "os.kill(os.getpid(), signal.SIGINT)\n"  # as during the imports that follow
        "program.main()"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 130
    assert done.stderr == "error: interrupted; nothing was begun\n"


def test_ctrl_c_while_libraries_are_imported_is_one_line(monkeypatch, capsys):
    class Interrupted:
        def __getattr__(self, name):
            raise KeyboardInterrupt

    monkeypatch.setitem(sys.modules, "synfeal.cli.parser", Interrupted())
    assert main(["inspect", "mesh.glb"]) == 130
    assert capsys.readouterr().err == "error: interrupted; what was not finished was not kept\n"


@pytest.mark.parametrize(
    ("encoding", "said"),
    [
        ("utf-8", "5 × 4 m in café → house".encode()),
        ("latin-1", b"5 \xd7 4 m in caf\xe9 \\u2192 house"),
        ("ascii", b"5 \\xd7 4 m in caf\\xe9 \\u2192 house"),
    ],
)
def test_a_terminal_without_a_letter_gets_its_number(monkeypatch, encoding, said):
    stdout = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
    monkeypatch.setattr(sys, "stdout", stdout)
    monkeypatch.setattr(parser, "run", lambda argv: print("5 × 4 m in café → house"))
    assert main([]) == 0
    assert stdout.buffer.getvalue() == said + b"\n"


def test_a_reader_that_has_read_enough_is_no_error():
    code = (
        "import sys; from synfeal.cli import main, parser\n"
        "parser.run = lambda argv: print('line')\n"
        "sys.exit(main([]))"
    )
    command = [sys.executable, "-c", code]
    with subprocess.Popen(command, stdout=-1, stderr=-1) as process:
        process.stdout.close()
        said = process.stderr.read()
    assert (process.returncode, said) == (141, b"")


def test_work_without_a_count_is_not_silent(monkeypatch, capsys):
    monkeypatch.setattr(progress, "EVERY_S", 0.01)
    with progress.at_work("inspect", "drawing"):
        time.sleep(0.1)
    first, *_ = capsys.readouterr().err.splitlines()
    assert first == "inspect: drawing, 0 s so far"
    with progress.at_work("inspect", "drawing"):
        pass
    assert capsys.readouterr().err == ""
