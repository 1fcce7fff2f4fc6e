"""A Data Package (datapackage.org, version 1) in a ZIP file: files, their hashes and schemas.

Members are compressed one by one, in order of name and without a date: the same files give the same
bytes, and a package that has grown shares most of its bytes with the one before, so that git keeps
the difference. LZMA makes tables of poses a quarter smaller than what ``unzip`` can read; Python,
7-Zip and bsdtar read it.
"""

from __future__ import annotations

import hashlib
import json
import lzma
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

from tqdm import tqdm

from synfeal.dataset.archive import ARCHIVE_DAMAGE, EPOCH, PLAIN_FILE, UNIX
from synfeal.errors import InputError, why
from synfeal.files import atomic_path

DESCRIPTOR, SCHEMA = "datapackage.json", "schemas/poses.json"
POSES: dict[str, Any] = {
    "fields": [
        {"name": "frame", "type": "integer", "description": "index of the frame in its split"},
        {"name": "path", "type": "integer", "description": "index of its straight path"},
        *(
            {"name": f"t{axis}", "type": "number", "description": "camera centre, metres"}
            for axis in "xyz"
        ),
        *(
            {"name": f"q{axis}", "type": "number", "description": "world_from_cam, unit quaternion"}
            for axis in "wxyz"
        ),
    ],
    "missingValues": ["nan"],
    "primaryKey": "frame",
}
POSE_HEADER = (",".join(field["name"] for field in POSES["fields"]) + "\n").encode()
DAMAGE = (OSError, *ARCHIVE_DAMAGE, lzma.LZMAError, KeyError, TypeError)


@dataclass(frozen=True)
class Resource:
    """A file of a package."""

    path: str  # below the results directory, with ``/``
    sha256: str  # of what it holds
    member: str  # name in the ZIP file
    # How much of that member it is; a smaller data set is the beginning of a larger one.
    n_bytes: int


def write_package(root: Path, paths: Mapping[str, str], out: Path) -> None:
    """Pack files below ``root`` in a ZIP file.

    ``paths`` says which file holds each: itself, or a longer one that begins with the same bytes.
    """
    resources = []
    with atomic_path(out) as temporary, zipfile.ZipFile(temporary, "w") as package:
        for path in tqdm(sorted(paths), unit="file", desc="keep", leave=False, disable=None):
            data = (root / path).read_bytes()
            resources.append(_described(path, paths[path], data))
            if paths[path] == path:
                _add(package, path, data)
        _add(package, SCHEMA, _json(POSES))
        _add(package, DESCRIPTOR, _json({"name": "synfeal-run", "resources": resources}))


def _described(path: str, member: str, data: bytes) -> dict[str, Any]:
    """A resource as the standard has it; ``member`` is ours, of a file that another one holds."""
    entry: dict[str, Any] = {
        "name": path.lower().replace("/", "."),
        "path": path,
        "format": PurePosixPath(path).suffix[1:],
        "bytes": len(data),
        "hash": f"sha256:{hashlib.sha256(data).hexdigest()}",
    }
    if data.startswith(POSE_HEADER):
        entry["schema"] = SCHEMA
    return entry if member == path else {**entry, "member": member}


def _json(value: Any) -> bytes:
    return (json.dumps(value, indent=1) + "\n").encode()


def _add(package: zipfile.ZipFile, name: str, data: bytes) -> None:
    info = zipfile.ZipInfo(name, EPOCH)
    info.create_system, info.external_attr = UNIX, PLAIN_FILE << 16
    package.writestr(info, data, zipfile.ZIP_LZMA)


def read_resources(package: Path) -> list[Resource]:
    """What a package says it holds.

    Raises:
        InputError: it cannot be read, or names a file outside of where it is unpacked.
    """
    try:
        with zipfile.ZipFile(package) as opened:
            entries = json.loads(opened.read(DESCRIPTOR))["resources"]
        resources = [
            Resource(
                path=str(entry["path"]),
                sha256=str(entry["hash"]).removeprefix("sha256:"),
                member=str(entry.get("member", entry["path"])),
                n_bytes=int(entry["bytes"]),
            )
            for entry in entries
        ]
    except DAMAGE as error:
        raise InputError(
            f"{package}: cannot be read as what synfeal keep writes ({why(error)})"
        ) from None
    for resource in resources:
        path = PurePosixPath(resource.path)
        if path.is_absolute() or ".." in path.parts or "\\" in resource.path:
            raise InputError(f"{package}: '{resource.path}' does not lie in a results directory")
    return resources


def read_contents(package: Path, resources: list[Resource]) -> Iterator[tuple[Resource, bytes]]:
    """What files of a package hold, their hashes verified; each member is read once.

    Raises:
        InputError: a member is missing, damaged or not what its hash says.
    """
    member, data = "", b""
    with zipfile.ZipFile(package) as opened:
        for resource in sorted(resources, key=lambda r: (r.member, r.path)):
            try:
                if resource.member != member:
                    member, data = resource.member, opened.read(resource.member)
            except DAMAGE as error:
                raise InputError(
                    f"{package}: {resource.member}: is damaged ({why(error)})"
                ) from None
            content = data[: resource.n_bytes]
            if hashlib.sha256(content).hexdigest() != resource.sha256:
                raise InputError(f"{package}: {resource.path}: differs from its hash; copy it anew")
            yield resource, content
