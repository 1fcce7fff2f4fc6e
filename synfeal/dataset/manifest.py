"""The manifest of a data set, as far as readers need it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from synfeal.errors import InputError, read_as
from synfeal.records.files import read_json

MANIFEST = "manifest.json"


def read_manifest(dataset: Path) -> dict[str, Any]:
    """Read the manifest as it stands.

    Raises:
        InputError: it cannot be read as a JSON object.
    """
    path = dataset / MANIFEST
    with read_as(path, "a manifest"):
        manifest = read_json(path)
    if not isinstance(manifest, dict):
        raise InputError(path, "cannot be read as a manifest (no JSON object)")
    return manifest
