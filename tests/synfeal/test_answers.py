"""What functions answer to wrong calls: in keywords from Python, in flags on the command line."""

import pickle
from pathlib import Path

import pytest

from synfeal.cli import all_commands
from synfeal.cli.wording import Wording
from synfeal.errors import Argument, InputError


@pytest.fixture(scope="module")
def commands():
    return {command.name: command for command in all_commands()}


@pytest.fixture(scope="module")
def wording(commands):
    return Wording(commands["scan"], list(commands.values()))


@pytest.mark.parametrize(
    ("parts", "line"),
    [
        ((Argument("out"), "is a file", "name a directory"), "out: is a file; name a directory"),
        ((Path("a/b.csv"), "is empty"), "a/b.csv: is empty"),
        (("poses.csv, line 3", "holds\ntwo lines"), "poses.csv, line 3: holds two lines"),
        (("scan: nothing is seen",), "scan: nothing is seen"),
    ],
)
def test_an_error_is_one_line_of_place_problem_and_remedy(parts, line):
    assert str(InputError(*parts)) == line


def test_an_error_of_a_worker_process_arrives_whole():
    error = InputError(Argument("out"), "is a file", "name a directory")
    arrived = pickle.loads(pickle.dumps(error))
    assert (arrived.where, arrived.problem, arrived.remedy) == error.args


@pytest.mark.parametrize(
    ("text", "typed"),
    [
        ("give `unit_m`", "give --unit"),
        ("give `depth_scale=5000`", "give --depth-scale 5000"),
        ("`gravity=(X, Y, Z)` or `keep_axes=True`", "--gravity X Y Z or --keep-axes"),
        ('say `format="tum"`', "say --format tum"),
        ("give `exif=False`", "give --no-exif"),
        ("lies in the `sequence`", "lies in the SEQUENCE"),  # its place: it has no flag
        ("mode `repeat` and `a.b`", "mode `repeat` and `a.b`"),  # no arguments
    ],
)
def test_arguments_that_a_text_names_are_flags_on_the_command_line(text, typed, wording):
    assert wording.text(text) == typed


def test_the_command_that_runs_says_how_its_arguments_are_given(commands):
    """``poses`` are an option of collect, and stand without a flag in evaluate."""
    for name, typed in (("collect", "--poses"), ("evaluate", "POSES")):
        assert Wording(commands[name], list(commands.values())).name("poses") == typed


@pytest.mark.parametrize(
    ("error", "line"),
    [
        (InputError(Argument("voxel_m"), "is small", "see `stride`"), "--voxel: is small; see --s"),
        (InputError(Path("out"), "is a file", "give `out`"), "out: is a file; give --out"),
        (InputError("scan: nothing is seen; check `preset`"), "nothing is seen; check --preset"),
    ],
)
def test_an_error_is_told_in_flags(error, line, wording):
    with pytest.raises(InputError) as told, wording.of_errors():
        raise error
    assert line in str(told.value)
