"""Frames of a video, decoded one after the other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from synfeal.captures.capture import Colors
from synfeal.errors import InputError


class Video:
    """A video whose frames are read by number, best in rising order.

    Seeking goes by key frames and is not exact in every container, so frames are counted from the
    first: going back begins anew.
    """

    def __init__(self, path: Path) -> None:
        if not path.is_file():
            raise InputError(path, "missing", "copy the recording again")
        self._path = path
        self._opened: Any = None
        self._next = 0
        opened = self._open()
        cv2 = _opencv(path)
        self.width = int(opened.get(cv2.CAP_PROP_FRAME_WIDTH))
        self.height = int(opened.get(cv2.CAP_PROP_FRAME_HEIGHT))
        self._count = int(opened.get(cv2.CAP_PROP_FRAME_COUNT))
        opened.release()
        if min(self.width, self.height, self._count) < 1:
            raise InputError(path, "holds no frame that can be decoded")

    def __len__(self) -> int:
        return self._count

    def _open(self) -> Any:
        cv2 = _opencv(self._path)
        opened = cv2.VideoCapture(str(self._path))
        # Calibration and depth are of the pixels as they are stored.
        opened.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
        if not opened.isOpened():
            raise InputError(self._path, "cannot be read as a video")
        return opened

    def read(self, number: int) -> Colors:
        """Decode a frame (H, W, 3).

        Raises:
            InputError: The video ends before.
        """
        if self._opened is None or number < self._next:
            self._opened, self._next = self._open(), 0
        while self._next < number and self._opened.grab():
            self._next += 1
        done, image = self._opened.read()
        if self._next != number or not done:
            raise InputError(self._path, f"ends before frame {number}", "copy the recording again")
        self._next += 1
        return np.ascontiguousarray(image[..., ::-1])


def _opencv(path: Path) -> Any:
    try:
        import cv2
    except ImportError as error:
        raise InputError(
            path, "videos are decoded by OpenCV", "pip install 'synfeal[captures]'"
        ) from error
    return cv2
