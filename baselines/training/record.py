"""Record of the inputs of a training run, which tells whether a later run would be the same.

Predictions travel further than models and frames (``make archive``). Where they arrive, this record
tells whether the configuration and the labels there are those that they were made with. Free of
torch, so that a workflow may import it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from synfeal.errors import InputError, why
from synfeal.records.files import file_sha256, read_json, write_json
from synfeal.records.provenance import provenance

RECORD = "training.json"


def write_training_record(
    path: Path, parameters: Mapping[str, Any], inputs: Mapping[str, Path]
) -> None:
    """Record what a training run was made from, and by which versions.

    Args:
        path: JSON to write.
        parameters: Settings of the run, ``seed`` among them.
        inputs: Input files by name, of which hashes are kept; that of packed frames is taken from
            the record beside them.
    """
    hashes = {name: _sha256(file) for name, file in inputs.items()}
    origin = provenance(parameters["seed"], "")
    kept = {key: origin[key] for key in ("commit", "packages", "platform")}
    write_json(path, {"parameters": dict(parameters), "sha256": hashes, **kept})


def _sha256(path: Path) -> str:
    record = path.with_suffix(".json")
    if path.suffix == ".npy" and record.exists():
        return str(read_json(record)["sha256"])
    return file_sha256(path)


def read_training_record(path: Path) -> dict[str, Any]:
    """Read the record of a run.

    Raises:
        InputError: it is missing or damaged.
    """
    try:
        record = read_json(path)
        if not isinstance(record["parameters"], dict) or not isinstance(record["sha256"], dict):
            raise ValueError("parameters and sha256 must be mappings")
    except (OSError, ValueError, TypeError, LookupError) as error:
        raise InputError(
            path, f"cannot be read as the record of a training run ({why(error)})", "train it again"
        ) from error
    return dict(record)


def check_same_labels(run: Path, test_labels: Path) -> None:
    """Refuse to score predictions by other labels than they were made for.

    A directory of a run without a record is passed over.

    Raises:
        InputError: the labels have changed since the run was trained.
    """
    if not (run / RECORD).exists():
        return
    recorded = read_training_record(run / RECORD)["sha256"].get("test_labels")
    if recorded != file_sha256(test_labels):
        raise InputError(
            test_labels,
            f"not the labels that {run / 'predictions.csv'} was made for",
            "restore both from one file, or delete the directory of the run to train it again",
        )
