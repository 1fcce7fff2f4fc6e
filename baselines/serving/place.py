"""A map in memory, and the threads that localize photographs in it and draw what it shows."""

from __future__ import annotations

import io
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np
import torch
from numpy.typing import NDArray

from baselines.places.place import open_map, shown_mesh
from baselines.references.map_localizer import FOUND, Located, MapLocalizer
from baselines.references.mapped import read_map
from baselines.references.photographs import Answer, Photograph
from baselines.references.redrawn import Redrawn, mesh_from_map, read_redrawn
from baselines.references.stated_errors import read_scale
from baselines.serving.job import ServeJob
from baselines.serving.plan import Plan, plan_of
from baselines.serving.uploads import CAMERA, Refusal, Upload
from baselines.serving.view import View
from baselines.training.localize import decode_picture
from synfeal.camera.calibration import decode_calibration
from synfeal.camera.photograph import PhotographCamera
from synfeal.dataset.images import IMAGE_DAMAGE, TooManyPixelsError, opened_image
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import TexturedMesh

Array = NDArray[np.float64]


class Found(NamedTuple):
    """Answer of a place about one photograph.

    Attributes:
        located: Its pose, or why there is none.
        seconds: Time it took, waiting left out.
        rendering: JPEG of what the map shows from there; None unless asked for and known.
    """

    located: Located
    seconds: float
    rendering: bytes | None


class ServedPlace:
    """A place that photographs are localized in; a context manager.

    Photographs are shared out to ``cores`` threads, of which each has a localizer of its own; most
    of their time is spent in libraries that let other threads run. All drawing is one thread's,
    because OpenGL and its context are.

    Args:
        job: The place and its settings.

    Attributes:
        name: Name of its folder.
        map: The map.
        world: World that poses are given in: ``sequence`` or ``mesh``, or ``map`` where there is
            only one.
        plan: The place seen from above, for poses in that world.
        seconds: Recent mean time for one photograph.

    Raises:
        InputError: The map or the mesh cannot be used.
    """

    def __init__(self, job: ServeJob) -> None:
        self._job = job
        folder, self._camera = open_map(job.place, job.camera)
        self.name = job.place.resolve().name
        self.map = read_map(folder)
        self._scale = read_scale(folder)
        _ = self.map.point_m, self.map.quat_wxyz  # computed once, before there are threads
        self._threads = threading.local()
        self._drawing = ThreadPoolExecutor(1, "draw")
        self._working = ThreadPoolExecutor(job.cores, "localize", torch.set_num_threads, (1,))
        self._opened = ExitStack()  # what draws; to be used in that thread
        self._redrawn: Redrawn | None = None
        self._view: View | None = None
        try:
            mesh, motion = self._drawing.submit(self._open_meshes, folder).result()
        except BaseException:
            self.close()
            raise
        localizer = self._open_localizer()
        self.world = localizer.world or "map"
        self.plan: Plan = plan_of(self.map, mesh, motion, localizer.out_from_map)
        self.seconds = 1.0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def has_renderings(self) -> bool:
        """Tell whether the place's mesh is there to be drawn."""
        return self._view is not None

    def close(self) -> None:
        """End the threads; photographs that wait are left."""
        self._working.shutdown(cancel_futures=True)
        self._drawing.submit(self._opened.close).result()
        self._drawing.shutdown()

    def submit(self, upload: Upload) -> Future[Found]:
        """Localize a photograph as soon as a thread is free.

        The result, or in its place a :class:`Refusal` or an ``InputError`` about the photograph,
        is that of the future.
        """
        return self._working.submit(self._find, upload)

    def _open_meshes(self, folder: Path) -> tuple[TexturedMesh | None, Array]:
        """Open what draws; return the mesh, if there is one, and its world's place in the map's."""
        if self._job.refine is not None:
            redrawn = read_redrawn(self.map, self._job.refine, folder)
            self._redrawn = self._opened.enter_context(redrawn)
        file = self._job.refine or shown_mesh(self._job.place)
        if file is None:
            return None, np.eye(4)
        mesh = load_mesh(file, self.map.mesh_file.up_axis, self.map.mesh_file.unit_m)
        motion = mesh_from_map(self.map, file)
        self._view = self._opened.enter_context(View(mesh, motion))
        return mesh, motion

    def _open_localizer(self) -> MapLocalizer:
        return MapLocalizer(
            self.map,
            world=self._job.world,
            least_confidence=self._job.least_confidence,
            scale=self._scale,
            refine=None if self._redrawn is None else partial(self._refined, self._redrawn),
        )

    def _refined(self, redrawn: Redrawn, photograph: Photograph, answer: Answer) -> Answer:
        return self._drawing.submit(redrawn.refine, photograph, answer).result()

    @property
    def _localizer(self) -> MapLocalizer:
        """The localizer of this thread."""
        if not hasattr(self._threads, "localizer"):
            self._threads.localizer = self._open_localizer()
        localizer: MapLocalizer = self._threads.localizer
        return localizer

    def _find(self, upload: Upload) -> Found:
        began = time.perf_counter()
        refuse_large(upload, self._job.megapixels)
        picture = decode_picture(upload.content, upload.name, self._job.most_pixels)
        camera = camera_of(upload, self._camera)
        located = self._localizer.locate(*picture, upload.name, camera)
        seconds = time.perf_counter() - began
        self.seconds += (seconds - self.seconds) / 8
        rendering = None
        if upload.rendering and self._view is not None and located.status == FOUND:
            draw: Callable[..., bytes] = self._view.draw
            pose = located.answer.world_from_cam
            rendering = self._drawing.submit(draw, pose, located.calibration).result()
        return Found(located, seconds, rendering)


def refuse_large(upload: Upload, megapixels: int) -> None:
    """Refuse a photograph of too many pixels before it is decoded."""
    try:
        with opened_image(io.BytesIO(upload.content), most_pixels=megapixels * 10**6):
            return
    except TooManyPixelsError as error:
        reason = f"{upload.name}: has more than {megapixels} megapixels; make it smaller"
        raise Refusal(413, reason) from error
    except IMAGE_DAMAGE:
        return  # the decoder says it better


def camera_of(upload: Upload, usual: PhotographCamera) -> PhotographCamera:
    """Return the source of a photograph's calibration.

    Args:
        upload: The photograph, which may say more than is usual.
        usual: Camera of photographs that come without one.

    Raises:
        InputError: The calibration that came with it cannot be used.
    """
    exif = usual.exif if upload.exif is None else upload.exif
    if upload.camera is not None:
        name, content = upload.camera
        calibration = decode_calibration(content, name)
        return replace(usual, calibration=calibration, focal_px=None, exif=exif, file=Path(CAMERA))
    if upload.focal_px is not None:
        return replace(usual, calibration=None, focal_px=upload.focal_px, exif=exif)
    return replace(usual, exif=exif)
