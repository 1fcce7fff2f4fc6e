"""Tables made again from the predictions of an archive, where nothing else is left of a run."""

import re
from pathlib import Path

import yaml

from reproduction.config.load import load_config
from reproduction.design.experiments import read_design
from reproduction.design.files import SPLITS, Files
from tests import CONFIG
from tests.workflow.test_workflow import snakemake

CHANGED = {
    "experiments": [{"table": "table4_size", "scene": "large_room", "size": "6k"}],
    "robustness": {"made": False},
    "references": {"groups": ["images"]},
}


def archived(files):
    """Files of a finished run that `make archive` packs, as far as tables read them."""
    root = files.root
    runs = [f"{root}/runs/{run.directory}" for run in files.design.runs]
    return [
        *(
            f"{run}/{name}"
            for run in runs
            for name in ("predictions.csv", "common_predictions.csv")
        ),
        *(f"{root}/labels/{s}/{split}.csv" for s in files.true_sets for split in SPLITS),
        *(f"{root}/scenes/{scene}/test_depth.npy" for scene in files.scenes),
        *(f"{root}/scenes/{scene}/properties.json" for scene in files.scenes),
        *(f"{root}/scenes/{scene}/collection_speed.json" for scene in files.scenes),
        *(
            f"{root}/references/{answer}/{name}.json"
            for answer in files.reference_answers
            for name in ("metrics", "facts")
        ),
    ]


def test_tables_are_made_again_and_nothing_is_trained(tmp_path):
    changed = CHANGED | {"results": str(tmp_path / "results")}
    (tmp_path / "my.yaml").write_text(yaml.safe_dump(changed))
    config = load_config(CONFIG / "config.yaml", CONFIG / "smoke.yaml", tmp_path / "my.yaml")
    files = Files(config, read_design(config))
    for path in map(Path, archived(files)):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    profiles = ("--configfile", "config/smoke.yaml", str(tmp_path / "my.yaml"))
    run = snakemake("--snakefile", "workflow/rescored/Snakefile", "--dry-run", *profiles)
    assert run.returncode == 0, run.stdout + run.stderr
    jobs = {name: int(n) for name, n in re.findall(r"^(\w+) +(\d+)$", run.stdout, re.MULTILINE)}
    jobs.pop("total")
    once = ("rescored", "table", "document", "claims", "summary")
    assert jobs == {**dict.fromkeys(once, 1), "side_table": 3, "score": 5}
