"""The three distributions hold what git tracks, one version, and build from each other."""

import io
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from email import message_from_string

import pytest
import yaml
from packaging.requirements import Requirement

import synfeal
from tests import ROOT

# Python 3.11.2, that of Debian 12, has no filters yet.
SAFELY = {"filter": "data"} if hasattr(tarfile, "data_filter") else {}

FOLDERS = {"synfeal": ".", "baselines": "baselines", "reproduction": "reproduction"}
NAMES = {
    "synfeal": "synfeal",
    "baselines": "synfeal_baselines",
    "reproduction": "synfeal_reproduction",
}
# What stands in a package's folder for building it, or for whoever looks into the folder.
NOT_IMPORTED = {"LICENSE", "README.md", "hatch_build.py", "pyproject.toml"}
VERSION = synfeal.__version__


def built(folder, out, *kind):
    """Build the distribution in ``folder`` as nobody's network could: with what is installed."""
    command = [sys.executable, "-m", "build", "--no-isolation", *kind, "--outdir", str(out)]
    done = subprocess.run([*command, str(folder)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="session")
def checkout(tmp_path_factory):
    """Copy what git tracks, and nothing else, without git."""
    folder = tmp_path_factory.mktemp("checkout")
    files = tracked("")
    archive = subprocess.run(
        ["tar", "-C", str(ROOT), "-c", "-T", "-"],
        input="\n".join(name for name in files if not name.startswith("results/")).encode(),
        capture_output=True,
        check=True,
    )
    with tarfile.open(fileobj=io.BytesIO(archive.stdout)) as tar:
        tar.extractall(folder, **SAFELY)
    return folder


@pytest.fixture(scope="session")
def dist(checkout, tmp_path_factory):
    """A wheel and an sdist of each package; the wheel is built from the sdist."""
    out = tmp_path_factory.mktemp("dist")
    for folder in FOLDERS.values():
        built(checkout / folder, out)
    return out


def tracked(package):
    """Files of a folder that git tracks, as they are now."""
    listed = subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", "-z", "--", package or "."],
        capture_output=True,
        text=True,
        check=True,
    )
    return {name for name in listed.stdout.split("\0") if name and (ROOT / name).is_file()}


def wheel(dist, package):
    return zipfile.ZipFile(dist / f"{NAMES[package]}-{VERSION}-py3-none-any.whl")


def metadata(dist, package):
    with wheel(dist, package) as file:
        name = f"{NAMES[package]}-{VERSION}.dist-info/METADATA"
        return message_from_string(file.read(name).decode())


@pytest.mark.parametrize("package", FOLDERS)
def test_a_wheel_holds_the_tracked_files_of_its_package_byte_for_byte(dist, package):
    expected = {
        name for name in tracked(package) if name.removeprefix(f"{package}/") not in NOT_IMPORTED
    }
    with wheel(dist, package) as file:
        found = {name for name in file.namelist() if ".dist-info/" not in name}
        assert found == expected
        assert f"{package}/py.typed" in found
        for name in found:
            assert file.read(name) == (ROOT / name).read_bytes(), name


@pytest.mark.parametrize("package", FOLDERS)
def test_an_sdist_builds_the_same_wheel_in_an_empty_folder(dist, package, tmp_path):
    stem = f"{NAMES[package]}-{VERSION}"
    with tarfile.open(dist / f"{stem}.tar.gz") as tar:
        tar.extractall(tmp_path, **SAFELY)
    built(tmp_path / stem, tmp_path, "--wheel")
    name = f"{stem}-py3-none-any.whl"
    assert (tmp_path / name).read_bytes() == (dist / name).read_bytes()


@pytest.mark.parametrize("package", FOLDERS)
def test_a_distribution_says_what_an_index_shows(dist, package):
    found = metadata(dist, package)
    assert found["Name"].startswith("synfeal")
    assert found["Version"] == VERSION
    assert found["License-Expression"] == "MIT"
    assert found["Requires-Python"] == ">=3.11"
    assert found["Description-Content-Type"] == "text/markdown"
    assert found["Keywords"]
    assert "Typing :: Typed" in found.get_all("Classifier")
    assert len(found.get_payload()) > 300
    with wheel(dist, package) as file:
        licence = file.read(f"{NAMES[package]}-{VERSION}.dist-info/licenses/LICENSE")
    assert licence == (ROOT / "LICENSE").read_bytes()


def test_distributions_need_each_other_at_their_own_version(dist):
    pins = {
        package: {
            requirement.name: str(requirement.specifier)
            for requirement in map(Requirement, metadata(dist, package).get_all("Requires-Dist"))
            if requirement.name.startswith("synfeal")
        }
        for package in FOLDERS
    }
    assert pins == {
        "synfeal": {},
        "baselines": {"synfeal": f"=={VERSION}"},
        "reproduction": {"synfeal": f"=={VERSION}", "synfeal-baselines": f"=={VERSION}"},
    }


def test_the_simulator_compiles_nothing_and_loads_no_network_unasked(dist):
    needed = map(Requirement, metadata(dist, "synfeal").get_all("Requires-Dist"))
    always = {requirement.name.lower() for requirement in needed if requirement.marker is None}
    assert not always & {"meshoptimizer", "dracopy", "open3d", "torch", "imageio-ffmpeg"}


def test_a_wheel_of_the_simulator_is_imported_from_where_it_is_installed(dist, tmp_path):
    """Also inside somebody's repository it has no commit: that repository is not its own."""
    target = tmp_path / "target"
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    found = dist / f"synfeal-{VERSION}-py3-none-any.whl"
    subprocess.run([*pip, "--target", str(target), str(found)], check=True)
    for arguments in (["init", "--quiet"], ["commit", "--quiet", "--allow-empty", "-m", "theirs"]):
        identity = ["-c", "user.name=a", "-c", "user.email=a@b"]
        subprocess.run(["git", "-C", str(tmp_path), *identity, *arguments], check=True)
    code = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "import synfeal, synfeal.api\n"
        "from synfeal.records.provenance import provenance\n"
        "from synfeal.render.base import SHADERS\n"
        "print(synfeal.__file__, synfeal.api.__file__)\n"
        "print(len(list(SHADERS.iterdir())), provenance(0, '')['commit'])"
    )
    # -I: no PYTHONPATH and no current folder; the target goes before what is installed.
    done = subprocess.run(
        [sys.executable, "-I", "-c", code, str(target)],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    files, facts = done.stdout.splitlines()
    assert all(name.startswith(str(target)) for name in files.split())
    assert facts == f"{len(list((ROOT / 'synfeal/render/shaders').iterdir()))} unknown"


def test_the_version_stands_in_one_place():
    for package, folder in FOLDERS.items():
        project = tomllib.loads((ROOT / folder / "pyproject.toml").read_text())
        path = project["tool"]["hatch"]["version"]["path"]
        assert (ROOT / folder / path).resolve() == ROOT / "synfeal/__init__.py", package
    hooks = [(ROOT / folder / "hatch_build.py").read_bytes() for folder in list(FOLDERS)[1:]]
    assert hooks[0] == hooks[1]
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text())["version"] == VERSION


def test_the_page_installs_the_torch_that_is_locked():
    (locked,) = (
        line
        for line in (ROOT / "requirements.lock").read_text().splitlines()
        if line.startswith("torch==")
    )
    assert f"pip install {locked} --index-url" in (ROOT / "docs/installing.md").read_text()
