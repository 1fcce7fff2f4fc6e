"""State that every test module leaves as it found it, and data that several of them read."""

import shutil
import sys
from pathlib import Path

import pytest
from hypothesis import settings

from synfeal.records import progress

# No test is about time, and the machine may be busy.
progress.EVERY_S = float("inf")
settings.register_profile("calm", deadline=None)
settings.load_profile("calm")


@pytest.fixture(autouse=True, scope="module")
def _denormal_numbers():
    """Opening a device has the processor flush denormal numbers, for good and in all of numpy."""
    yield
    if "torch" in sys.modules:
        sys.modules["torch"].set_flush_denormal(False)


@pytest.fixture(scope="session")
def mesh(tmp_path_factory):
    """A closed room of 6 x 5 x 3 m, as GLB."""
    from tests.support.collected import save_room

    return save_room(tmp_path_factory.mktemp("mesh") / "room.glb")


@pytest.fixture(scope="session")
def calm(mesh, tmp_path_factory):
    """A collected data set nothing happened to."""
    from tests.support.collected import collect

    out = tmp_path_factory.mktemp("calm") / "set"
    assert collect(mesh, out, "--depth") == 0
    return out


@pytest.fixture(scope="session")
def planar(tmp_path_factory):
    """A data set of two planes, in closed form."""
    from tests.support.damaged_sets import write_planar_set

    folder = tmp_path_factory.mktemp("planar") / "set"
    write_planar_set(folder)
    return folder


@pytest.fixture
def damaged(planar, tmp_path):
    """A copy of it that may be damaged."""
    return Path(shutil.copytree(planar, tmp_path / "set"))


@pytest.fixture(scope="session")
def results(tmp_path_factory):
    """Results of the shipped design, complete, with known scores."""
    from tests.support.report_results import complete_results

    return complete_results(tmp_path_factory.mktemp("results") / "mini")
