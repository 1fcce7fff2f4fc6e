"""Whatever is typed: no traceback, one line that says what is wrong, and nothing lost."""

import warnings

import pytest

from synfeal.cli import main
from tests import CONFIG
from tests.support.careless import TABLE, arguments_of, make_folder
from tests.support.colored_frames import save, untrained
from tests.support.fuzzing import JARGON, TooSlow, at_most, tree

SECONDS = 20.0


@pytest.fixture(scope="module")
def folder(mesh, calm, tmp_path_factory):
    model = tmp_path_factory.mktemp("made") / "model.pt"
    save(model, untrained())
    folder = tmp_path_factory.mktemp("folder")
    make_folder(folder, mesh, calm, model)
    (folder / "config").symlink_to(CONFIG)
    return folder


def problem_with(arguments, names, capfd):
    """Return what is wrong with a command's answer to its arguments; None if nothing is."""
    capfd.readouterr()
    try:
        with at_most(SECONDS), warnings.catch_warnings():
            status = main(arguments)
    except SystemExit as ended:
        status = int(ended.code or 0)
    except TooSlow:
        return f"took more than {SECONDS:g} s"
    except Exception as error:
        return f"{type(error).__name__}: {str(error)[:120]}"
    lines = capfd.readouterr().err.strip().splitlines()
    errors = [line for line in lines if "error: " in line]
    if jargon := JARGON.search("\n".join(lines)):
        return f"says {jargon.group()!r}: {lines[:3]}"
    if status == 2 and len(lines) == 1 and lines[0].endswith("--help"):
        return None  # no number where one is needed
    if arguments[0] == "validate" and status == 1 and len(errors) == len(lines):
        return None  # a line for each check that fails
    if status != 1 or len(lines) != 1 or len(errors) != 1 or not lines[0].startswith("error: "):
        return f"status {status}, {lines[:3]}"
    return None if any(name in lines[0] for name in names) else f"names nothing: {lines[0]}"


@pytest.mark.parametrize("name", TABLE)
def test_a_careless_command_ends_in_one_line_and_nothing_is_lost(name, folder, monkeypatch, capfd):
    monkeypatch.chdir(folder)
    before, failures = tree(folder), []
    _, option, values = TABLE[name]
    for value in values:
        # What is found on the way has the name of Python: flags are those without the unit.
        keyword = option.removeprefix("--").replace("-", "_")
        names = (*filter(None, [option, keyword]), value[:4], folder.name)
        problem = problem_with(arguments_of(name, value), names, capfd)
        if tree(folder) != before:
            problem = f"{problem or ''} something was written or lost"
        failures += [f"{value[:20]!r}: {problem}"] if problem else []
    assert not failures, "\n".join(failures)
