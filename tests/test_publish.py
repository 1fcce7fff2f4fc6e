"""Publishing a run, and what is published: small, whole, and of one run."""

import hashlib
import json
import subprocess
from pathlib import Path

import pytest

from synfeal.errors import InputError
from synfeal.report.publish import FINISHED, main, publish

REPOSITORY = Path(__file__).parent.parent
LIMIT_MB = 4.0


@pytest.fixture
def root(tmp_path, monkeypatch):
    """A finished run in ``results/mini``, and pages that show one of its two figures."""
    monkeypatch.chdir(tmp_path)
    run = tmp_path / "results/mini"
    texts = {
        "tables/table1_meshes.csv": "scene\n",
        "tables/table1_meshes.tex": "\\begin{table}\n",
        "figures/shown.png": "png",
        "figures/unseen.png": "png",
        "runs/model.pt": "weights",
        "report.html": "<html>",
        **dict.fromkeys(FINISHED, "text\n"),
    }
    texts["provenance.json"] = json.dumps(
        {
            "files": {
                name: hashlib.sha256(text.encode()).hexdigest()
                for name, text in texts.items()
                if name.startswith(("tables", "figures"))
            }
        }
    )
    for name, text in texts.items():
        (run / name).parent.mkdir(parents=True, exist_ok=True)
        (run / name).write_text(text)
    (tmp_path / "docs").mkdir()
    (tmp_path / "README.md").write_text("![x](results/published/mini/figures/shown.png)\n")
    (tmp_path / "docs/a.md").write_text("[x](../results/published/stretch/figures/other.png)\n")
    return run


def files_below(folder):
    return {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}


def test_a_run_is_published_without_what_no_page_shows_and_so_is_one_of_labels_alone(root):
    target = root.parent / "published/mini"
    (target / "tables").mkdir(parents=True)
    (target / "tables/of_an_older_design.csv").write_text("old")
    assert main(["--profile", "mini"]) == 0
    tables = {"tables/table1_meshes.csv", "tables/table1_meshes.tex"}
    assert files_below(target) == tables | {"figures/shown.png"} | set(FINISHED)
    assert all((target / name).read_bytes() == (root / name).read_bytes() for name in tables)
    for name in FINISHED:
        (root / name).unlink()
    assert main([]) == 0
    assert "figures/shown.png" in files_below(root.parent / "published/mini")


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("claims.csv", None, "claims.csv: missing; finish the run"),
        ("figures/shown.png", None, r"shown.png: missing, and README.md shows it"),
        ("tables/table1_meshes.csv", "another run's", "is not the file of .*provenance.json"),
    ],
)
def test_what_does_not_belong_together_is_not_published(root, name, text, said):
    if text is None:
        (root / name).unlink()
    else:
        (root / name).write_text(text)
    target = Path("results/published/mini")
    target.mkdir(parents=True)
    (target / "kept.txt").touch()
    with pytest.raises(InputError, match=said):
        publish(Path("results/mini"), target, [Path("README.md")])
    assert files_below(target) == {"kept.txt"}


def test_without_a_run_the_command_says_so(root, capsys):
    assert main(["--profile", "night"]) == 1
    assert "results/night/tables: holds no tables" in capsys.readouterr().err


def test_tracked_results_are_small_and_of_their_provenance():
    listed = subprocess.run(
        ["git", "ls-files", "-z", "results"], cwd=REPOSITORY, capture_output=True, check=True
    )
    paths = [REPOSITORY / name for name in listed.stdout.decode().split("\0") if name]
    assert {p.relative_to(REPOSITORY).parts[1] for p in paths} == {"published", "benchmarks"}
    assert sum(p.stat().st_size for p in paths) <= LIMIT_MB * 1e6


@pytest.mark.parametrize("profile", ["mini", "night"])
def test_published_results_are_those_of_a_recorded_run(profile):
    root = REPOSITORY / "results/published" / profile
    if profile != "mini" and not root.exists():
        pytest.skip("not published")
    record = json.loads((root / "provenance.json").read_text())
    assert len(record["commit"]) >= 40
    assert record["stages"]
    paths = [root / "claims.csv", root / "summary.md", *(root / "tables").glob("*.csv")]
    for path in [*paths, *(root / "figures").glob("*")]:
        sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
        assert record["files"][path.relative_to(root).as_posix()] == sha256
