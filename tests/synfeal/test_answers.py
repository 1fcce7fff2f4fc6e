"""Answers to wrong calls: in keywords from Python, in flags on the command line."""

import ast
import inspect
import math
import pickle
import re
from pathlib import Path

import pytest

import synfeal
from synfeal.cli.parser import all_commands
from synfeal.cli.wording import Wording
from synfeal.config.flags import flag_of
from synfeal.errors import Argument, InputError
from tests.support.collected import refused, save_room


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


ROOT = Path(__file__).parents[2]
# Modules that are no command and hold flags, with the reason.
ON_COMMAND_LINES = {
    "baselines/training/sharing.py": "options of nvidia-smi",
    "reproduction/config/collected.py": "comments of the profile that a command prints",
    "reproduction/plan/gpu.py": "a text that a command prints, which is no function",
    "reproduction/plan/plan.py": "a text that a command prints, which is no function",
    "reproduction/report/paper_tables.py": "a command that a page shows",
    "reproduction/real/config.py": "options of commands that a rule runs",
    "reproduction/real/down.py": "an option of a command that a rule runs",
    "reproduction/runs/job.py": "answers of jobs, which the command line of Snakemake starts",
    "synfeal/config/flags.py": "makes flags of names",
}
FLAG = re.compile(r"(?<![\w-])--([a-z][a-z_-]*|$)")


def is_command(path, tree):
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.Import)]
    parses = any(alias.name == "argparse" for node in imports for alias in node.names)
    return parses or "cli" in path.with_suffix("").parts


def flags_in(tree):
    """Yield the name of each flag in a text that is no docstring; "" where a value makes it."""
    nodes = list(ast.walk(tree))
    documentation = {id(node.value) for node in nodes if isinstance(node, ast.Expr)}
    joined = [node.values[:-1] for node in nodes if isinstance(node, ast.JoinedStr)]
    before_a_value = {id(text) for texts in joined for text in texts}
    for node in nodes:
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            found = [] if id(node) in documentation else FLAG.findall(node.value)
            yield from (name for name in found if name or id(node) in before_a_value)


def test_no_module_but_commands_names_a_flag(commands):
    names = {name.replace("_", "-") for command in commands.values() for name in command.flags}
    typed = {flag for each in commands.values() for flag in (*each.flags.values(), *each.was)}
    ours = {flag.removeprefix("--") for flag in typed} | names | {""}
    naming = {}
    for package in ("synfeal", "baselines", "reproduction"):
        for path in sorted((ROOT / package).rglob("*.py")):
            name, tree = path.relative_to(ROOT), ast.parse(path.read_text())
            found = [] if is_command(name, tree) else [f for f in flags_in(tree) if f in ours]
            if found:
                naming[name.as_posix()] = found
    assert sorted(naming) == sorted(ON_COMMAND_LINES)  # none is excused longer than it needs to be


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A mesh, and a data set of it without depth."""
    folder = tmp_path_factory.mktemp("place")
    room = save_room(folder / "room.glb")
    synfeal.collect(room, folder / "set", 4, width=32, height=24, spacing_m=0.2, backend="raycast")
    return folder


# Function, arguments, keywords; what its answer names, and what that of its command does.
NEW = {"frames": 5, "out": "new"}
WRONG = [
    ("collect", ("room.glb",), NEW | {"spacing_m": 0.0}, "spacing_m: must", "--spacing: must"),
    ("collect", ("room.glb",), NEW | {"cores": 0}, "cores: must", "--cores: must"),
    ("collect", ("room.glb",), NEW | {"unit_m": 1e-4}, "with `unit_m`", "with --unit"),
    ("collect", ("room.glb",), NEW | {"out": "/"}, "out: / is a whole", "--out: / is a whole"),
    ("plan", ("room.glb",), NEW | {"mode": "repeat"}, "poses: mode", "--poses: mode"),
    ("inspect", ("room.glb",), {"out": "set"}, "with `out`", "with --out"),
    ("preview", ("set",), {"out": "new.txt"}, "out: ", "--out: "),
    ("preview", ("set",), {"out": "new.gif", "show": ("masks",)}, "`masks=True`", "with --masks"),
    ("pairs", ("set",), {"out": "new"}, "`depth=True`", "with --depth"),
    ("pairs", ("set",), {"out": "new", "stride": 0}, "stride: must", "--stride: must"),
    ("export", ("set",), {"out": "set/new", "to": "tum"}, "out: ", "--out: "),
    ("evaluate", ("set", "set/train.csv"), {"rate_hz": 0.0}, "rate_hz: must", "--rate: must"),
    ("evaluate", ("set", "set/train.csv"), {"offset_s": math.inf}, "offset_s: ", "--offset: "),
    ("scan", ("set/seq-01",), {"out": "new.ply"}, "out: ", "--out: "),
    ("scan", ("set/seq-01",), {"out": "new.glb", "voxel_m": 0.0}, "voxel_m: ", "--voxel: "),
    ("scan", ("set/seq-01",), {"out": "new.glb", "range": (3, 1)}, "range: 3", "--range: 3"),
    ("train", ("set",), {"out": "new", "held_out": 2.0}, "held_out: must", "--held-out: must"),
    ("train", ("set",), {"out": "new", "images": 9, "minutes": 1.0}, "`images`", "--minutes: --im"),
    ("train", ("set",), {"out": "new", "range": ((1, 1),)}, "range: 1 1", "--range: 1 1"),
    ("map", ("set",), {"out": "new"}, "`depth=True`", "with --depth"),
    ("map", ("set",), {"out": "new", "most": 0}, "most: must", "--most: must"),
    ("localize", ("set", "set/preview.png"), {"turns": 3}, "turns: is for", "--turns: is for"),
    ("localize", ("set", "set/preview.png"), {"focal_px": -1.0}, "focal_px: ", "--focal: "),
]


def typed_of(command, given, keywords):
    """The command line of a call."""
    words = [command, *given]
    for name, value in keywords.items():
        parts = value[0] if name == "range" and isinstance(value[0], tuple) else value
        many = parts if isinstance(parts, tuple) else (parts,)
        words += [flag_of(name), *map(str, many)]
    return words


@pytest.mark.parametrize(("name", "given", "keywords", "answer", "line"), WRONG)
def test_a_function_answers_in_keywords_and_its_command_in_flags(
    name, given, keywords, answer, line, place, monkeypatch, capfd
):
    monkeypatch.chdir(place)
    before = sorted(place.rglob("*"))
    takes = inspect.signature(getattr(synfeal, name)).parameters
    words = {key: value for key, value in keywords.items() if key in takes}  # no table of plan's
    with pytest.raises(InputError) as refused_call:
        getattr(synfeal, name)(*given, **words)
    assert answer in str(refused_call.value)
    assert "--" not in str(refused_call.value)
    assert line in refused(capfd, *typed_of(name, given, keywords))
    assert sorted(place.rglob("*")) == before
