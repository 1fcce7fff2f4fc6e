"""Poses averaged over virtual rotations of the camera that took a picture.

How a picture changes when its camera turns about its centre is known whatever the scene
(:mod:`baselines.training.rotation`), so one picture gives many that the network has not answered
yet. Each answer is turned back by the rotation; what is left of it differs by the network's error
alone, much of which the mean takes away. The rotations are those that training images are turned
by, so no picture is one that the network has not learned to read.

The mean rotation is that of Markley et al., "Averaging quaternions" (Journal of Guidance, Control,
and Dynamics 30(4), 2007), equation 13: the eigenvector of the largest eigenvalue of the summed
outer products, which does not mind that ``q`` and ``-q`` are one rotation.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.stats.qmc import Halton
from torch import Tensor

from baselines.config.learning import AugmentationConfig
from baselines.training.checkpoint import TrainedLocalizer
from baselines.training.predict import BATCH, DECIMALS, normalised_quat_wxyz
from baselines.training.rotation import (
    RandomRotation,
    packed_intrinsics,
    quat_of,
    quat_product,
)

Array = NDArray[np.float64]


class VirtualViews:
    """Predicts the poses of pictures as the mean over virtual rotations of their camera.

    Args:
        trained: Localizer. One whose training images were not turned, or whose camera is not
            known, sees each picture once.
        pairs: Rotations beside none at all, each of them there and back.
    """

    def __init__(self, trained: TrainedLocalizer, pairs: int) -> None:
        self._trained = trained
        description = trained.description
        turns, camera = description.rotations, description.camera
        self._turn: RandomRotation | None = None
        self._rotvecs_rad = torch.zeros(1, 3)
        if turns is not None and camera is not None and pairs:
            network = description.network
            intrinsics = packed_intrinsics(camera, network)
            device = trained.device
            self._turn = RandomRotation(intrinsics, network.input_px, turns, 0, device)
            self._rotvecs_rad = paired_rotations_rad(turns, pairs)

    @property
    def count(self) -> int:
        """Views of each picture."""
        return len(self._rotvecs_rad)

    def predict(self, images: Tensor) -> tuple[Array, Array]:
        """Estimate poses.

        Args:
            images: Pictures (N, 3, S, S) uint8 as the network is to see them, on its device.

        Returns:
            Positions (N, 3) in metres and unit quaternions (N, 4), w first and not negative, with
            :data:`~baselines.training.predict.DECIMALS` decimals. ``nan`` where an answer of the
            network is not finite.
        """
        together = max(1, BATCH // self.count)
        answers = [self.answers(part) for part in torch.split(images, together)]
        position_m = np.concatenate([position for position, _ in answers], axis=1)
        quat_wxyz = np.concatenate([quat for _, quat in answers], axis=1)
        mean_m = position_m.mean(axis=0)
        return mean_m.round(DECIMALS), mean_quat_wxyz(quat_wxyz).round(DECIMALS)

    @torch.inference_mode()
    def answers(self, images: Tensor) -> tuple[Array, Array]:
        """Estimate the poses of the unturned camera from every view alone.

        Args:
            images: Pictures (N, 3, S, S) uint8, few enough to be seen at once in all views.

        Returns:
            Positions (V, N, 3) in metres and unit quaternions (V, N, 4), w first.
        """
        normalised = self._trained.statistics.normalise(images)
        views = [self._turned(normalised, rotvec_rad) for rotvec_rad in self._rotvecs_rad]
        prediction = self._trained.network(torch.cat(views))[0]
        position_m = prediction.position_m.double().cpu()
        back = quat_of(-self._rotvecs_rad).double().repeat_interleave(len(images), dim=0)
        quat_wxyz = quat_product(normalised_quat_wxyz(prediction.quat_wxyz), back)
        shape = (self.count, len(images), -1)
        return position_m.view(shape).numpy(), quat_wxyz.view(shape).numpy()

    def _turned(self, normalised: Tensor, rotvec_rad: Tensor) -> Tensor:
        """Resample images to what the camera sees after one rotation (3,) about its axes."""
        if self._turn is None or not rotvec_rad.any():
            return normalised
        rotvecs_rad = rotvec_rad.to(normalised.device).expand(len(normalised), 3)
        return self._turn.rotated(normalised, rotvecs_rad)


def paired_rotations_rad(turns: AugmentationConfig, pairs: int) -> Tensor:
    """Spread rotation vectors evenly over those that training images are turned by.

    Args:
        turns: Largest rotations about the camera's axes.
        pairs: Number of rotations beside none, each with its opposite: their mean is none.

    Returns:
        Rotation vectors (1 + 2 pairs, 3), radians; the first is zero.
    """
    # The first point of the sequence is a corner of the cube.
    unit = 2 * Halton(3, scramble=False).random(pairs + 1)[1:] - 1
    largest_rad = np.radians([turns.tilt_deg, turns.tilt_deg, turns.roll_deg])
    rotvecs_rad = np.concatenate([np.zeros((1, 3)), unit * largest_rad, -unit * largest_rad])
    return torch.from_numpy(rotvecs_rad).float()


def mean_quat_wxyz(quat_wxyz: Array) -> Array:
    """Average rotations over the first axis (Markley et al. 2007, equation 13).

    Args:
        quat_wxyz: Unit quaternions (V, N, 4).

    Returns:
        Unit quaternions (N, 4), w not negative; ``nan`` where one of the averaged is not finite.
    """
    mean = np.full(quat_wxyz.shape[1:], np.nan)
    known = np.isfinite(quat_wxyz).all(axis=(0, 2))
    if len(quat_wxyz) == 1:
        mean[known] = quat_wxyz[0, known]
    elif known.any():
        outer = np.einsum("vni,vnj->nij", quat_wxyz[:, known], quat_wxyz[:, known])
        mean[known] = np.linalg.eigh(outer)[1][..., -1]
    return np.where(mean[:, :1] < 0, -mean, mean)
