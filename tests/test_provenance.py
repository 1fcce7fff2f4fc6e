"""Provenance: where a result comes from."""

import subprocess
from pathlib import Path

from synfeal.config import load_config
from synfeal.provenance import config_hash, git_commit, provenance

REPOSITORY = Path(__file__).parent.parent


def test_provenance_names_commit_versions_and_configuration(tmp_path):
    config = load_config(REPOSITORY / "config" / "config.yaml")
    record = provenance(7, config_hash(config))
    assert record["seed"] == 7
    assert record["packages"]["numpy"][0].isdigit()
    assert len(record["config_sha256"]) == 64
    assert git_commit(tmp_path) == "unknown"


def test_the_configuration_hash_follows_the_values_alone():
    config = load_config(REPOSITORY / "config" / "config.yaml")
    assert config_hash(config) == config_hash(config.model_copy())
    assert config_hash(config) != config_hash(config.model_copy(update={"seed": 1}))


def test_a_commit_is_dirty_when_code_changed_but_not_when_results_did(tmp_path):
    def git(*arguments):
        identity = ("-c", "user.name=a", "-c", "user.email=a@b.c")
        subprocess.run(["git", "-C", str(tmp_path), *identity, *arguments], check=True)

    (tmp_path / "results").mkdir()
    for name in ("code.py", "results/table.csv"):
        (tmp_path / name).write_text("1")
    git("init", "--quiet")
    git("add", ".")
    git("commit", "--quiet", "--message", "first")
    clean = git_commit(tmp_path / "results")
    assert len(clean) == 40
    (tmp_path / "results" / "table.csv").write_text("2")
    assert git_commit(tmp_path / "results") == clean
    (tmp_path / "code.py").write_text("2")
    assert git_commit(tmp_path) == f"{clean}-dirty"
