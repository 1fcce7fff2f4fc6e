"""What hloc localizes in: images, a COLMAP model of all and one of the training images, queries.

Source: ``hloc/pipelines/7Scenes`` and ``hloc/utils/parsers.py`` of cvg/Hierarchical-Localization.
``triangulation.main`` takes ``sfm_reference`` and ``images``; ``localize_sfm.main`` takes
``queries_with_intrinsics.txt`` (``name model width height params...``); the evaluation takes
``model`` and ``list_test.txt``. Its result file is read by ``synfeal evaluate``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from synfeal.export.colmap import camera_line, frame_name, write_model
from synfeal.export.frames import ExportFrame, ExportSet, need_splits, place


def export_hloc(
    data: ExportSet, out: Path, copy: bool, on_frame: Callable[[], object]
) -> list[str]:
    """Write ``images/``, ``model/``, ``sfm_reference/`` and the lists; returns no warnings.

    Raises:
        InputError: there are no splits.
    """
    need_splits(data)
    for frame in data.frames:
        place(frame.color, out / "images" / frame_name(frame), copy)
        on_frame()
    _write_binary(out / "model", data, data.frames)
    _write_binary(out / "sfm_reference", data, data.of_split("train"))
    camera = camera_line(data.camera).partition(" ")[2]  # without its number
    for split in ("train", "test"):
        names = [frame_name(frame) for frame in data.of_split(split)]
        _write(out / f"list_{split}.txt", names)
        if split == "test":
            _write(out / "queries_with_intrinsics.txt", [f"{name} {camera}" for name in names])
    return []


def _write_binary(folder: Path, data: ExportSet, frames: Iterable[ExportFrame]) -> None:
    """A model in the form that hloc reads by default."""
    import pycolmap

    folder.mkdir()
    write_model(folder, data.camera, frames)
    model = pycolmap.Reconstruction(folder)
    for path in folder.iterdir():
        path.unlink()
    model.write_binary(folder)


def _write(path: Path, lines: list[str]) -> None:
    path.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
