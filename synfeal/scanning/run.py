"""From a posed RGB-D sequence to a scan: the stages of ``synfeal scan``, one after the other."""

from __future__ import annotations

import logging
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from synfeal.captures.unpack import known_up
from synfeal.dataset.depth_agreement import DepthAgreement, best_focal_px, check_depth, spread
from synfeal.dataset.images import image_size
from synfeal.dataset.posed_sequence import PosedFrames, is_tum, read_posed_sequence
from synfeal.dataset.world import MESH_SHA256, SCAN
from synfeal.errors import Argument, InputError
from synfeal.geometry.axes import PosesAre, meant_poses
from synfeal.geometry.poses import inverse
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.save import save_glb
from synfeal.records.files import file_sha256, refuse_unwritable, write_json
from synfeal.records.progress import Progress
from synfeal.scanning.camera import (
    CameraOptions,
    RgbdCamera,
    intrinsics_record,
    posed_depth,
    rgbd_camera,
)
from synfeal.scanning.cleaning import without_small_pieces
from synfeal.scanning.coloring import colors_of
from synfeal.scanning.consistency import N_FRAMES as FIT_FRAMES
from synfeal.scanning.consistency import ColorFit, fit_color, sightings_of, with_color
from synfeal.scanning.fusion import FusedSurface, fuse
from synfeal.scanning.gravity import GravityError, find_gravity, likely_up, upright_world
from synfeal.scanning.picture import Comparison, compare, write_picture

Array = NDArray[np.float64]
OPTIONS = frozenset({"convention", "depth_scale"})
COMPARED = 24  # photographs that the scan is compared with
# Beyond, a focal length is not that of the camera: tolerances of lenses are a tenth of it.
WRONG_FOCAL = 0.03
WARN_COVERED = 0.8

log = logging.getLogger("synfeal")


@dataclass(frozen=True)
class ScanJob:
    """A sequence to fuse, settings, and where to write the mesh.

    Attributes:
        sequence: Posed RGB-D frames, see :mod:`synfeal.dataset.posed_sequence`.
        out: The ``.glb`` to write; ``.json`` and ``.png`` of the same name come beside it.
        cameras: What is known of the cameras.
        start: First frame.
        stop: One past the last frame; None for all.
        stride: Every so many frames are fused; those between are what the scan is compared with.
        voxel_m: Edge of a voxel, metres.
        max_depth_m: Depth beyond is left out.
        min_piece_m2: Connected pieces of less surface are dropped.
        poses_are: Direction of the poses, or ``opengl`` for ``world_from_cam`` of cameras with
            OpenGL's axes.
        gravity: Way down (3,) in the sequence's world; ``find`` takes it from the device
            where its capture says it, or else from the planes of the scene;
            ``keep`` leaves the axes as they are.
        needs_gravity: Whether gravity that is not found ends the scan; otherwise an axis of the
            world stands in, with a warning.
        keep_calibration: Use the colour calibration as it is given, not as photographs agree best.
    """

    sequence: Path
    out: Path
    cameras: CameraOptions = field(default_factory=CameraOptions)
    start: int = 0
    stop: int | None = None
    stride: int = 2
    voxel_m: float = 0.01
    max_depth_m: float = 4.0
    min_piece_m2: float = 0.02
    poses_are: PosesAre = "world_from_cam"
    gravity: tuple[float, float, float] | Literal["find", "keep"] = "find"
    needs_gravity: bool = True
    keep_calibration: bool = False

    def check(self) -> None:
        """Refuse numbers that mean nothing."""
        if self.out.suffix.lower() != ".glb":
            raise InputError(
                Argument("out"), f"{self.out}: a scan is binary glTF", "end its name in .glb"
            )
        refuse_unwritable(self.out)
        if self.start < 0 or (self.stop is not None and self.stop <= self.start):
            raise InputError(Argument("range"), f"{self.start} to {self.stop} holds no frame")
        if self.stride < 1:
            raise InputError(Argument("stride"), f"must be at least 1, found {self.stride}")
        for name, value in (("voxel_m", self.voxel_m), ("max_depth_m", self.max_depth_m)):
            if not 1e-4 <= value <= 1e3:
                raise InputError(Argument(name), f"must be 0.0001 to 1000 metres, found {value:g}")
        if not (np.isfinite(self.min_piece_m2) and self.min_piece_m2 >= 0):
            raise InputError(
                Argument("min_piece_m2"), f"must be 0 square metres or more, {self.min_piece_m2:g}"
            )
        if not isinstance(self.gravity, str):
            longest = np.abs(self.gravity).max()
            if not 1e-6 <= longest <= 1e6:
                raise InputError(
                    Argument("gravity"),
                    "must be three numbers, the largest 1e-6 to 1e6 without its sign",
                )


@dataclass(frozen=True)
class Scan:
    """A fused mesh and the measures of its quality.

    Attributes:
        mesh: In its world, z up, metres.
        record: What ``scan.json`` holds.
        compared: Photographs beside renderings.
    """

    mesh: TexturedMesh
    record: dict[str, Any]
    compared: tuple[Comparison, ...]


def scan(job: ScanJob) -> Scan:
    """Fuse, clean, colour, set upright, compare with photographs, and write.

    Raises:
        InputError: The sequence cannot be used, its parts do not fit together, or no gravity is
            found; the message says what to do.
    """
    job.check()
    every = _read(job)
    frames, held_out = every[:: job.stride], _held_out(every, job.stride)
    camera = _camera(job, frames)
    agreement = check_depth(posed_depth(frames, camera, options=OPTIONS))
    total = 2 * len(frames) + min(FIT_FRAMES, len(frames)) + min(COMPARED, len(held_out))
    with Progress(total, "scan") as progress:
        with _stage(progress, "depth fused", len(frames)):
            surface = fuse(frames, camera, job.voxel_m, job.max_depth_m, progress.update)
        surface, n_dropped = without_small_pieces(surface, job.min_piece_m2)
        gravity, sequence_from_world = _world(job, surface, frames)
        with _stage(progress, "calibration compared", min(FIT_FRAMES, len(frames))):
            sightings = sightings_of(surface, frames, camera, progress.update)
            fit = fit_color(sightings, camera.color)
        if fit.is_better and not job.keep_calibration:
            camera = with_color(camera, fit)
        with _stage(progress, "colours found", len(frames)):
            rgb = colors_of(surface, frames, camera, progress.update)
        mesh = _mesh(surface, rgb, sequence_from_world)
        some = spread(len(held_out), COMPARED)
        shown = _at(held_out, some)
        poses = inverse(sequence_from_world) @ shown.world_from_cam
        with _stage(progress, "photographs compared", len(some)):
            compared = compare(mesh, shown, poses, camera.color, progress.update)
    _tell(job, agreement, fit, compared)
    record = _record(job, frames, camera, agreement, fit, gravity, compared) | {
        "sequence_from_world": sequence_from_world.tolist(),
        "faces": mesh.n_faces,
        "pieces_dropped": n_dropped,
    }
    title = (
        f"{job.out.name}: {record['photographs']['difference']:.1f} grey levels from photographs,"
        f" {record['photographs']['covered']:.0%} of them covered"
    )
    write_picture(compared, title, job.out.with_suffix(".png"))
    save_glb(job.out, mesh, {SCAN: record})
    record[MESH_SHA256] = file_sha256(job.out)
    write_json(job.out.with_suffix(".json"), record)
    return Scan(mesh, record, tuple(compared))


@contextmanager
def _stage(progress: Progress, name: str, n_frames: int) -> Iterator[None]:
    began = time.perf_counter()
    yield
    progress.part_done(name, n_frames, time.perf_counter() - began)


def _read(job: ScanJob) -> PosedFrames:
    every = read_posed_sequence(job.sequence, slice(job.start, job.stop))
    if not every.has_depth:
        raise InputError(
            job.sequence, "has no depth images; a scan is made of photographs with depth"
        )
    return replace(every, world_from_cam=meant_poses(every.world_from_cam, job.poses_are))


def _held_out(every: PosedFrames, stride: int) -> PosedFrames:
    """Return the frames that are not fused, or all of them where all are fused."""
    index = [i for i in range(len(every)) if i % stride]
    return _at(every, index) if index else every


def _at(frames: PosedFrames, index: list[int]) -> PosedFrames:
    return PosedFrames(
        names=tuple(frames.names[i] for i in index),
        color=tuple(frames.color[i] for i in index),
        depth=tuple(frames.depth[i] for i in index),
        world_from_cam=frames.world_from_cam[index],
    )


def _camera(job: ScanJob, frames: PosedFrames) -> RgbdCamera:
    depth = frames.depth[0]
    assert depth is not None
    return rgbd_camera(
        options=job.cameras,
        sequence=job.sequence,
        color_size=image_size(frames.color[0]),
        depth_size=image_size(depth),
        is_tum=is_tum(job.sequence),
    )


def _world(
    job: ScanJob, surface: FusedSurface, frames: PosedFrames
) -> tuple[dict[str, Any] | str, Array]:
    """Return how the way up is known, for the record, and ``sequence_from_world`` (4, 4)."""
    if job.gravity == "keep":
        return "kept", np.eye(4)
    if job.gravity == "find":
        sensed = known_up(job.sequence)
        if sensed is not None:
            return "sensed by the device", upright_world(surface, sensed)
        try:
            found = find_gravity(surface, frames.world_from_cam)
        except GravityError as error:
            if job.needs_gravity:
                raise
            return _stood_in(surface, frames, error)
        record = {"up": found.up.tolist(), "level": found.level, "plumb": found.plumb}
        return record, upright_world(surface, found.up)
    down = np.array(job.gravity, np.float64)
    return "given", upright_world(surface, -down / np.linalg.norm(down))


def _stood_in(surface: FusedSurface, frames: PosedFrames, error: GravityError) -> tuple[str, Array]:
    """Take an axis of the capture for the way up, and say so."""
    up = likely_up(frames.world_from_cam)
    axis = f"{'-' if up.sum() < 0 else '+'}{'xyz'[int(np.abs(up).argmax())]}"
    log.warning(
        "%s: %s of the capture is taken for up, to which the upper edges of its photographs are"
        " nearest",
        str(error).partition(";")[0],
        axis,
    )
    return f"not found: {axis} of the capture stands in", upright_world(surface, up)


def _mesh(
    surface: FusedSurface, rgb: NDArray[np.uint8], sequence_from_world: Array
) -> TexturedMesh:
    world_from_sequence = inverse(sequence_from_world)
    vertices = surface.vertices_m @ world_from_sequence[:3, :3].T + world_from_sequence[:3, 3]
    return TexturedMesh((MeshPart("scan", vertices, surface.faces, vertex_rgb=rgb),))


def _tell(
    job: ScanJob, agreement: DepthAgreement, fit: ColorFit, compared: list[Comparison]
) -> None:
    """Warn of what is bad, and say what to do."""
    given, best = fit.given.intrinsics, fit.fitted.intrinsics
    if abs(fit.focal_change) > WRONG_FOCAL and fit.is_better:
        said = (
            f"scan: photographs agree best with a focal length of {best.fx:.0f} px,"
            f" {given.fx:.0f} px was given for colour"
        )
        if job.keep_calibration:
            log.warning(
                "%s: give `color_focal_px=%.0f`, or leave out `keep_calibration`", said, best.fx
            )
        else:
            log.warning("%s: %.0f px is used; `keep_calibration` uses what is given", said, best.fx)
    covered = float(np.mean([one.covered.mean() for one in compared]))
    if covered < WARN_COVERED:
        log.warning(
            "scan: covers %.0f %% of what photographs show; give more frames, or a larger"
            " `max_depth_m` (%g m)",
            100 * covered,
            job.max_depth_m,
        )


def _record(
    job: ScanJob,
    frames: PosedFrames,
    camera: RgbdCamera,
    agreement: DepthAgreement,
    fit: ColorFit,
    gravity: dict[str, Any] | str,
    compared: list[Comparison],
) -> dict[str, Any]:
    """Return the content of ``scan.json``, less the mesh itself."""
    differences = np.array([one.difference for one in compared])
    return {
        "sequence": job.sequence.resolve().name,
        "frames": {
            "start": job.start,
            "stop": job.stop,
            "stride": job.stride,
            "fused": len(frames),
            "first": frames.names[0],
            "last": frames.names[-1],
        },
        "poses_are": job.poses_are,
        "camera": camera.record,
        "color_as_given": intrinsics_record(fit.given),
        "voxel_m": job.voxel_m,
        "max_depth_m": job.max_depth_m,
        "gravity": gravity,
        "depth_agreement": None if np.isnan(agreement.share) else agreement.share,
        "depth_best_focal_px": (
            None if np.isnan(agreement.share) else best_focal_px(agreement.sample, camera.depth)
        ),
        "color_disagreement": fit.record,
        "photographs": {
            "compared": len(compared),
            "held_out": job.stride > 1,
            "difference": float(np.nanmean(differences)),
            "covered": float(np.mean([one.covered.mean() for one in compared])),
        },
    }
