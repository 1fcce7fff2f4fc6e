"""Provenance: where a result comes from."""

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
