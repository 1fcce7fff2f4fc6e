"""From a capture or a mesh to a map of renderings: the stages of ``synfeal build``."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

import synfeal
from baselines.places.check import (
    CHECKED,
    Known,
    check_of,
    learn_of_photographs,
    localize_known,
    photographs_of,
    renderings_of,
    trial_of,
)
from baselines.places.choices import choose, stride_of
from baselines.places.place import Place, cameras_of, is_place
from baselines.places.report import write_report
from baselines.references.map_frames import FrameChoice, read_map_frames
from baselines.references.mapped import build_map, read_map
from baselines.references.stated_errors import TRIED, write_trial
from synfeal.captures.capture import Capture
from synfeal.captures.formats import capture_formats, read_capture
from synfeal.captures.unpack import read_capture_record, unpack
from synfeal.dataset.posed_sequence import read_posed_sequence
from synfeal.errors import Argument, InputError
from synfeal.mesh.checks import SUFFIXES
from synfeal.records.files import read_json, write_json
from synfeal.records.lock import LOCK, only_command, remove_unfinished
from synfeal.records.progress import Outlook, Progress, duration_text
from synfeal.scanning.camera import CameraOptions
from synfeal.scanning.fusion import load_open3d
from synfeal.scanning.run import ScanJob, scan

log = logging.getLogger("synfeal")

UNPACK, SCAN, RENDER, MAP = "unpack", "scan", "render", "map"
TRIAL, CHECK, TRAIN = "trial", "check", "train"
# Seconds of one core for one frame, or in all: only their ratios matter much, see Outlook.
FRAME_S = {UNPACK: 0.15, SCAN: 1.0, RENDER: 0.15, MAP: 0.15, TRIAL: 0.3, CHECK: 0.3}
TRAIN_S = 120.0
# Depth is drawn of the full mesh for every frame anyway; choosing less of it for colours takes
# longer than a thousand frames save.
DETAIL: Literal["full"] = "full"
USUAL_FRAMES = 300  # frames of a capture
# The network of the default size is off by 5 to 10 per cent of the extent of the cameras: 12 cm in
# a kitchen of 3 m, 3 m in a corridor of 30 m, where the map is off by 3 cm.
LEARNABLE_M, ERROR_SHARE = 8.0, 0.08


@dataclass(frozen=True)
class PlaceJob:
    """A capture or a mesh, and where its place is built.

    Attributes:
        source: Folder or file of a capture, see :mod:`synfeal.captures`, or a textured mesh.
        out: Folder of the place.
        format: Of the capture; None finds out.
        frames: Frames that are rendered of the scan, from which the map is made.
        width: Of rendered frames, pixels.
        train: Train a localizer on the rendered frames, too.
        cores: Rendering processes.
        seed: Of all random numbers.
    """

    source: Path
    out: Path
    format: str | None = None
    frames: int = 1000
    width: int = 320
    train: bool = False
    cores: int = 1
    seed: int = 0

    @property
    def is_mesh(self) -> bool:
        """True where the source is a mesh, so that nothing is scanned."""
        return self.source.suffix.lower() in SUFFIXES and not self.source.is_dir()


class _Run:
    """A build under way: which stages are due, and how long the rest takes."""

    def __init__(self, expected_s: dict[str, float], say: Callable[[str], None]) -> None:
        self._outlook = Outlook(expected_s)
        self.say = say

    @contextmanager
    def stage(self, name: str, product: Path, what: str) -> Iterator[bool]:
        """Make a product unless it is there: yield whether it is due, then say how long it took."""
        if product.exists():
            yield False
            self.say(f"{product}: {what}, was there")
            return
        began_s = time.monotonic()
        with self._outlook.stage(name):
            yield True
        self.say(f"{product}: {what}, {duration_text(time.monotonic() - began_s)}")


def build(job: PlaceJob, say: Callable[[str], None] = print) -> dict[str, Any]:
    """Build a place; stages that were finished before are not made again.

    Args:
        job: What to build.
        say: Takes a line for each stage.

    Returns:
        Content of ``place.json``.

    Raises:
        InputError: The source cannot be used, the folder holds another place, or another build is
            at work there.
    """
    place = Place(job.out)
    capture = None
    if not job.is_mesh and not place.frames.exists():
        capture = read_capture(job.source, job.format)
        _refuse_without_depth(job, capture)
        load_open3d()  # now, not after minutes of unpacking
    record = _begin(job, place)
    with only_command(job.out, job.out / LOCK):
        remove_unfinished(job.out)
        return _built(job, place, capture, record, say)


def _built(
    job: PlaceJob,
    place: Place,
    capture: Capture | None,
    record: dict[str, Any],
    say: Callable[[str], None],
) -> dict[str, Any]:
    """Make the stages that are due; see :func:`build`."""
    run = _Run(_expected_s(job, 0 if capture is None else len(capture)), say)
    if job.is_mesh:
        known = _render_mesh(job, place, run)
    else:
        record["notes"] = list(_unpack(job, place, capture, run)) or record.get("notes", [])
        write_json(place.record, record)
        known, record["scan"] = _render_scan(job, place, run)
    choice, camera = FrameChoice(most=job.frames), CameraOptions()
    with run.stage(MAP, place.map, "map") as due:
        if due:
            build_map(read_map_frames(place.rendered, choice, camera), place.map, job.seed)
    with run.stage(TRIAL, place.trial, "map tried on frames left out of it") as due:
        if due:
            frames = read_map_frames(place.rendered, choice, camera)
            write_trial(read_map(place.map), frames, place.map, job.seed)
            # An earlier version's, whose poses state no error.
            place.check.unlink(missing_ok=True)
    with run.stage(CHECK, place.check, f"map tried on {known.kind}") as due:
        if due:
            localize_known(place, known, job.seed)
    learn_of_photographs(place, known)
    record["cameras"] = cameras_of(place)
    record["check"] = check_of(place, known)
    record["trial"] = trial_of(place)
    if job.train:
        record["localizer"] = _train(job, place, run)
    record["finished"] = True
    write_json(place.record, record)
    write_report(place, record)
    return record


def _expected_s(job: PlaceJob, n_captured: int) -> dict[str, float]:
    """Estimate the seconds of each stage by its name.

    Args:
        job: What is built.
        n_captured: Frames of its capture; 0 where that was unpacked before.
    """
    n_captured = n_captured or USUAL_FRAMES
    captured = {
        UNPACK: FRAME_S[UNPACK] * n_captured,
        SCAN: FRAME_S[SCAN] * n_captured / stride_of(n_captured),
    }
    return {
        **({} if job.is_mesh else captured),
        RENDER: FRAME_S[RENDER] * job.frames / job.cores,
        MAP: FRAME_S[MAP] * job.frames,
        TRIAL: FRAME_S[TRIAL] * min(TRIED, job.frames),
        CHECK: FRAME_S[CHECK] * CHECKED,
        **({TRAIN: TRAIN_S} if job.train else {}),
    }


def _begin(job: PlaceJob, place: Place) -> dict[str, Any]:
    """Open the folder of the place; refuse one of another source or other settings."""
    asked = {
        "source": {"path": str(job.source.resolve()), "format": job.format},
        "frames": job.frames,
        "width": job.width,
        "seed": job.seed,
    }
    if is_place(job.out):
        record: dict[str, Any] = read_json(place.record)
        for key, value in asked.items():
            if record.get(key) != value:
                raise InputError(
                    place.record,
                    f"is of {key} {record.get(key)}, asked for is {value}",
                    "build into another folder, or delete this one",
                )
        return record
    if job.out.exists() and (not job.out.is_dir() or any(job.out.iterdir())):
        raise InputError(job.out, "is no place and not empty", "choose another folder with `out`")
    if job.is_mesh and not job.source.is_file():
        raise InputError(job.source, "is not there", "give a capture or a mesh")
    if job.is_mesh and job.format is not None:
        raise InputError(Argument("format"), f"{job.source} is a mesh, no capture", "leave it out")
    job.out.mkdir(parents=True, exist_ok=True)
    record = {**asked, "version": synfeal.__version__, "finished": False}
    write_json(place.record, record)
    return record


def _refuse_without_depth(job: PlaceJob, capture: Capture) -> None:
    if not any(frame.read_depth_m is not None for frame in capture.frames):
        raise InputError(
            job.source,
            "has no depth, of which a scan is made",
            "make a map of its photographs alone (synfeal map) and localize in that, or give a"
            " textured mesh of the place that another program made",
        )


def _unpack(job: PlaceJob, place: Place, capture: Capture | None, run: _Run) -> tuple[str, ...]:
    """Write the capture as a sequence; return what was left out, and say it."""
    with run.stage(UNPACK, place.frames, "capture unpacked") as due:
        if not due or capture is None:
            return ()
        run.say(f"{job.source}: {len(capture)} frames of {capture_formats()[capture.format].title}")
        with Progress(len(capture), "unpacked") as progress:
            done = unpack(capture, place.frames, on_frame=progress.update)
    for note in done.notes:
        log.warning("%s: %s", job.source, note)
    return done.notes


def _render_scan(job: PlaceJob, place: Place, run: _Run) -> tuple[Known, dict[str, float]]:
    """Scan the unpacked capture, and render frames around its photographs.

    Returns:
        Photographs to try the map on, and what was chosen of the scan, for ``place.json``.
    """
    frames = read_posed_sequence(place.frames)
    if not frames.has_depth:
        raise InputError(
            job.source, "most of its frames have no depth, of which a scan is made", "capture again"
        )
    capture_record = read_capture_record(place.frames) or {}
    choice = choose(frames, float(capture_record["camera"]["depth"]["fx"]))
    if job.train:
        tell_of_network(choice.extent_m, run.say)
    with run.stage(SCAN, place.scan, "scan") as due:
        if due:
            scan(
                ScanJob(
                    sequence=place.frames,
                    out=place.scan,
                    stride=choice.stride,
                    voxel_m=choice.voxel_m,
                    max_depth_m=choice.max_depth_m,
                    needs_gravity=False,
                )
            )
    with run.stage(RENDER, place.rendered, f"{job.frames} frames rendered") as due:
        if due:
            synfeal.collect(
                place.scan,
                place.rendered,
                job.frames,
                like=place.frames,
                mode="around",
                width=job.width,
                depth=True,
                detail=DETAIL,
                cores=job.cores,
                seed=job.seed,
            )
    return photographs_of(place, frames, choice.stride), asdict(choice)


def _render_mesh(job: PlaceJob, place: Place, run: _Run) -> Known:
    """Render frames of a mesh, and others to try the map on."""
    with run.stage(RENDER, place.rendered, f"{job.frames} frames rendered") as due:
        if due:
            synfeal.collect(
                job.source,
                place.rendered,
                job.frames,
                test_frames=min(CHECKED, max(1, job.frames // 4)),
                mode="random",
                width=job.width,
                height=job.width * 3 // 4,
                depth=True,
                detail=DETAIL,
                cores=job.cores,
                seed=job.seed,
            )
    if job.train:
        poses = synfeal.open_dataset(place.rendered).train.world_from_cam
        tell_of_network(float(np.ptp(poses[:, :3, 3], axis=0).max()), run.say)
    return renderings_of(place)


def tell_of_network(extent_m: float, say: Callable[[str], None]) -> None:
    """Say before the time is spent how much a network will learn of a place of this size."""
    expected = (
        f"the cameras span {extent_m:.1f} m: a network trained on rendered frames will be off by"
        f" about {ERROR_SHARE * extent_m:.1f} m, which is 5 to 10 % of that; the map localizes"
        " without it"
    )
    if extent_m > LEARNABLE_M:
        log.warning("%s", expected)
    else:
        say(expected)


def _train(job: PlaceJob, place: Place, run: _Run) -> dict[str, float] | None:
    """Train a localizer on the rendered frames; return its errors on those held out."""
    from baselines.training.train import MODEL, TrainJob, train

    with run.stage(TRAIN, place.localizer / MODEL, "localizer trained"):
        # One that has ended is not made again, and tells its errors.
        errors = train(TrainJob([place.rendered], place.localizer, seed=job.seed)).errors
    if errors is None:
        return None
    return {"position_m": errors.position_m, "orientation_deg": errors.orientation_deg}
