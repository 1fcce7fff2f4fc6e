"""Export of a data set into a directory that appears complete or not at all."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

from synfeal.dataset.frame_files import FrameFile, link_or_unpack
from synfeal.exporting.frames import ExportSet, Place, read_export_set
from synfeal.exporting.learned import export_ace, export_mstransformer, export_nerfstudio
from synfeal.exporting.reconstruction import export_colmap, export_hloc, export_tum
from synfeal.exporting.rosbag import export_rosbag
from synfeal.records.files import atomic_directory, refuse_existing, refuse_inside
from synfeal.records.progress import Progress

Exporter = Callable[[ExportSet, Path, Place], None]

FORMATS: dict[str, Exporter] = {
    "ace": export_ace,
    "colmap": export_colmap,
    "hloc": export_hloc,
    "mstransformer": export_mstransformer,
    "nerfstudio": export_nerfstudio,
    "rosbag": export_rosbag,
    "tum": export_tum,
}


def export(dataset: Path, to: str, out: Path, copy: bool, camera_file: Path | None) -> int:
    """Write a data set in another format.

    Args:
        dataset: Data set to export.
        to: Format, a key of ``FORMATS``.
        out: Directory to write, which must not exist.
        copy: Copy colour images; otherwise they are linked to.
        camera_file: Calibration; needed where the data set has no manifest.

    Returns:
        The number of frames.
    """
    refuse_existing(out)
    refuse_inside(out, dataset)
    data = read_export_set(dataset, camera_file)
    with (
        atomic_directory(out) as directory,
        Progress(len(data.frames), "export") as progress,
    ):

        def place(source: FrameFile, target: Path | None) -> None:
            """Link to an absolute path, or copy; what is archived, always."""
            if target is None:
                pass
            elif copy and isinstance(source, Path):
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, target)
            else:
                link_or_unpack(source, target)
            progress.update()

        FORMATS[to](data, directory, place)
    return len(data.frames)
