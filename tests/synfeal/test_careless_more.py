"""More careless inputs, over all commands: one line that names what to change."""

import shlex
import shutil

import pytest

from tests import CONFIG
from tests.support.careless_more import COMMANDS, DAMAGES, FILES, LATER, ON_SETS, make_more
from tests.support.colored_frames import save, untrained
from tests.support.fuzzing import tree
from tests.synfeal.test_careless import problem_with


@pytest.fixture(scope="module")
def folder(mesh, calm, tmp_path_factory):
    model = tmp_path_factory.mktemp("made") / "model.pt"
    save(model, untrained())
    folder = tmp_path_factory.mktemp("more")
    make_more(folder, mesh, calm, model)
    (folder / "config").symlink_to(CONFIG)
    return folder


def problems_of(commands, folder, capfd):
    """Return what is wrong with the ends of commands, each with words its line must have one of."""
    before, found = tree(folder), []
    for typed, words in commands:
        problem = problem_with(shlex.split(typed), words.split("|"), capfd)
        if tree(folder) != before:
            problem = f"{problem or ''} something was written or lost"
            before = tree(folder)
        found += [f"{typed!r}: {problem}"] if problem else []
    return found


TYPED = (*COMMANDS, *LATER)
PARTS = [TYPED[start : start + 20] for start in range(0, len(TYPED), 20)]


@pytest.mark.parametrize("commands", PARTS, ids=[part[0][0][:30] or "none" for part in PARTS])
def test_what_is_typed_carelessly_ends_in_one_line(commands, folder, monkeypatch, capfd):
    monkeypatch.chdir(folder)
    found = problems_of(commands, folder, capfd)
    assert not found, "\n".join(found)


@pytest.mark.parametrize(("command", "files", "words"), FILES, ids=[row[0][:40] for row in FILES])
def test_a_careless_file_is_named(command, files, words, folder, monkeypatch, capfd):
    monkeypatch.chdir(folder)
    commands = [(command.format(name), f"{name}|{words}") for name in files]
    found = problems_of(commands, folder, capfd)
    assert not found, "\n".join(found)


@pytest.mark.parametrize("damage", DAMAGES, ids=lambda damage: damage.__name__)
def test_a_damaged_set_is_named_by_every_command(damage, folder, monkeypatch, capfd):
    monkeypatch.chdir(folder)
    shutil.rmtree("bad", ignore_errors=True)
    shutil.copytree("set", "bad")
    damage(folder / "bad")
    found = problems_of([(ON_SETS[name], "bad") for name in DAMAGES[damage]], folder, capfd)
    assert not found, "\n".join(found)


def test_none_is_there_twice():
    assert len({typed for typed, _ in TYPED}) == len(TYPED)


def test_there_are_two_hundred_of_them():
    n_files = sum(len(files) for _, files, _ in FILES)
    n_damages = sum(len(commands) for commands in DAMAGES.values())
    assert len(COMMANDS) + n_files + n_damages >= 200
    assert len(LATER) >= 40
