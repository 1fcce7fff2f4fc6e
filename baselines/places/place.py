"""The folder of a place: where its parts lie, and the record that names its capture."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from baselines.references.mapped import photographs_camera
from baselines.references.stated_errors import FILE as TRIAL
from synfeal.camera.calibration import read_calibration
from synfeal.camera.photograph import PhotographCamera
from synfeal.dataset.manifest import MANIFEST
from synfeal.errors import InputError, read_as
from synfeal.mesh.checks import SUFFIXES
from synfeal.records.files import read_json

RECORD = "place.json"


@dataclass(frozen=True)
class Place:
    """Paths of the parts of a place.

    Attributes:
        folder: Root of the place.
    """

    folder: Path

    @property
    def record(self) -> Path:
        """Record of the place: its source, and what was measured."""
        return self.folder / RECORD

    @property
    def frames(self) -> Path:
        """The capture as a posed sequence."""
        return self.folder / "frames"

    @property
    def camera(self) -> Path:
        """Calibration of the capture's photographs, as the scan fitted it to them.

        The capture's own misses where its poses put things by 11 pixels in a Kinect's photographs
        (TUM *freiburg1*): each pose found by it is turned by 1.2 degrees against the capture's.
        """
        return self.scan.with_suffix(".json")

    @property
    def scan(self) -> Path:
        """The mesh."""
        return self.folder / "scan.glb"

    @property
    def rendered(self) -> Path:
        """Data set rendered from the mesh."""
        return self.folder / "rendered"

    @property
    def map(self) -> Path:
        """Map that photographs are localized in."""
        return self.folder / "map"

    @property
    def trial(self) -> Path:
        """Errors of frames that the map was tried on, by which poses state theirs."""
        return self.map / TRIAL

    @property
    def check(self) -> Path:
        """Poses of the capture's own photographs, as the map finds them."""
        return self.folder / "check.csv"

    @property
    def localizer(self) -> Path:
        """Folder of a trained network, where one was asked for."""
        return self.folder / "localizer"

    @property
    def report(self) -> Path:
        """Page that shows all of it."""
        return self.folder / "report.html"


def is_place(folder: Path) -> bool:
    """Tell whether a folder is one that ``synfeal build`` made, finished or not."""
    return (folder / RECORD).is_file()


def cameras_of(place: Place) -> dict[str, Any]:
    """Say where the cameras of the rendered frames were placed, by the record of these frames.

    Returns:
        The mode of the collection; for ``around`` also how far from photographs, metres.
    """
    collection = read_json(place.rendered / MANIFEST)["collection"]
    mode = collection["mode"]
    return {"mode": mode, **({"around_m": collection["around_m"]} if mode == "around" else {})}


def read_place(folder: Path) -> tuple[Place, dict[str, Any]]:
    """Read the record of a place that is finished.

    Raises:
        InputError: It cannot be read, or the place has no map yet.
    """
    place = Place(folder)
    with read_as(place.record, "the record of a place"):
        values = read_json(place.record)
    if not isinstance(values, dict) or "source" not in values:
        raise InputError(place.record, "is no record of a place", "build the place again")
    if not place.map.is_dir():
        raise InputError(
            folder,
            "has no map yet",
            f"run synfeal build again, of {values['source']['path']} into this folder",
        )
    return place, values


def open_map(folder: Path, camera: PhotographCamera) -> tuple[Path, PhotographCamera]:
    """Return the map of a folder, and the camera of photographs in it.

    Args:
        folder: A map, or a place that has one.
        camera: As a person gives it. In a place of a capture, and in a map of photographs, the one
            that took these stands in where nothing is known.
    """
    if not is_place(folder):
        return folder, replace(camera, otherwise=photographs_camera(folder))
    place, _ = read_place(folder)
    if not place.camera.is_file():  # it was built from a mesh
        return place.map, camera
    return place.map, replace(camera, otherwise=read_calibration(place.camera))


def shown_mesh(folder: Path) -> Path | None:
    """Return the mesh that the map of a place shows; None where it is not there, or of a map."""
    if not is_place(folder):
        return None
    place, record = read_place(folder)
    source = Path(record["source"]["path"])
    candidates = [place.scan] + ([source] if source.suffix.lower() in SUFFIXES else [])
    return next((file for file in candidates if file.is_file()), None)
