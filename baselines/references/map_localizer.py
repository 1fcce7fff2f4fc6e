"""One photograph after the other, localized in a map that is read once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from baselines.references.confidence import LEAST_CONFIDENCE
from baselines.references.mapped import StructureMap
from baselines.references.photographs import Answer, Finder, Photograph
from baselines.references.stated_errors import ErrorScale, Stated
from synfeal.camera.calibration import Calibration
from synfeal.camera.orientation import Orientation
from synfeal.camera.photograph import PhotographCamera
from synfeal.dataset.pose_table import COLUMNS, IMAGE, STATED, SUPPORT
from synfeal.errors import InputError
from synfeal.geometry.poses import quat_wxyz_of

Array = NDArray[np.float64]
World = Literal["sequence", "mesh"]
Status = Literal["localized", "not localized", "ambiguous"]
Refine = Callable[[Photograph, Answer], Answer]

HEADER = (IMAGE, *COLUMNS[2:], *SUPPORT, *STATED)
FOUND: Status = "localized"
NOT_FOUND: Status = "not localized"
AMBIGUOUS: Status = "ambiguous"
DECIMALS = 6  # micrometres


class Located(NamedTuple):
    """Answer of a localizer about one photograph.

    Attributes:
        status: Whether it was localized.
        world_from_cam: Pose (4, 4) in the world that was asked for; NaN unless it was localized.
        answer: What the map says, its pose in the world of the map.
        calibration: Camera of the upright photograph.
        is_turned: True where its EXIF turns it, and its calibration with it.
        stated: Radii that hold its error; None unless it was localized in a map that was tried.
    """

    status: Status
    world_from_cam: Array
    answer: Answer
    calibration: Calibration
    is_turned: bool
    stated: Stated | None = None

    @property
    def row(self) -> dict[str, float | int | str]:
        """Columns of ``HEADER`` after the image; numbers are NaN where there are none."""
        values = np.full(7, np.nan)
        if self.status == FOUND:
            values[:3] = self.world_from_cam[:3, 3]
            values[3:] = quat_wxyz_of(self.world_from_cam)
        pose = dict(zip(COLUMNS[2:], values.round(DECIMALS).tolist(), strict=True))
        status, inliers, confidence = SUPPORT
        radii = [np.nan] * len(STATED) if self.stated is None else self.stated
        return {
            **pose,
            status: self.status,
            inliers: self.answer.support.inliers,
            confidence: round(self.answer.support.confidence, DECIMALS),
            **{name: round(radius, DECIMALS) for name, radius in zip(STATED, radii, strict=True)},
        }


class MapLocalizer:
    """Localizes photographs in a map; one thread at a time.

    Args:
        place: The map.
        world: Whose coordinates poses are given in, where the place was scanned from a sequence
            that has its own.
        least_confidence: Poses with less are not given.
        refine: Improves the pose of a photograph that was localized; None leaves it as it is.
        scale: Scale of the errors that poses state; None where the map was not tried.
        seed: Seed of RANSAC's samples, the same for every photograph.

    Attributes:
        world: Whose coordinates poses are in; None where there is only one.
        out_from_map: Rigid motion (4, 4) to that world from the map's.
    """

    def __init__(
        self,
        place: StructureMap,
        *,
        world: World = "sequence",
        least_confidence: float = LEAST_CONFIDENCE,
        refine: Refine | None = None,
        scale: ErrorScale | None = None,
        seed: int = 0,
    ) -> None:
        self._finder = Finder(place, seed)
        self._least_confidence = least_confidence
        self._refine = refine
        self._scale = scale
        self.world: World | None = None if place.sequence_from_world is None else world
        sequence = place.sequence_from_world
        self.out_from_map = np.eye(4)
        if sequence is not None and world == "sequence":
            self.out_from_map = sequence

    def locate(
        self, image: Image.Image, turn: Orientation, name: object, camera: PhotographCamera
    ) -> Located:
        """Find out where a photograph was taken.

        Args:
            image: The photograph (RGB), upright.
            turn: How its stored pixels were turned to stand upright.
            name: Its name in messages.
            camera: Source of its calibration.

        Raises:
            InputError: Nothing says what its focal length is, or it does not fit its calibration.
        """
        calibration = camera.of(image, name, turn)
        if calibration is None:
            raise InputError(
                name,
                "nothing says what its focal length is, which its pose depends on",
                "give the camera's calibration with `camera`, or its focal length in pixels with"
                " `focal_px`",
            )
        photograph = self._finder.look_at(image, calibration)
        answer = self._finder.find(photograph)
        status = self._status_of(answer)
        if self._refine is not None and status == FOUND:
            answer = self._refine(photograph, answer)
        pose = answer.world_from_cam if status == FOUND else np.full((4, 4), np.nan)
        return Located(
            status=status,
            world_from_cam=self.out_from_map @ pose,
            answer=answer,
            calibration=calibration,
            is_turned=camera.turns_with(image, turn),
            stated=self._stated(answer) if status == FOUND else None,
        )

    def _stated(self, answer: Answer) -> Stated | None:
        """State the error of a pose; None where nothing bounds it."""
        if self._scale is None or answer.spread is None or not np.isfinite(answer.spread).all():
            return None
        return self._scale.stated(answer.spread) if self._scale.knows(answer.spread) else None

    def _status_of(self, answer: Answer) -> Status:
        if answer.support.confidence < self._least_confidence:
            return NOT_FOUND
        return AMBIGUOUS if answer.is_ambiguous else FOUND
