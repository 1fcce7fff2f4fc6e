"""Rotation augmentation: images seen by a camera rotated about its centre.

The image of a camera that turns about its centre changes by a homography, whatever the scene: with
the intrinsics ``K`` and the rotated camera's axes ``R`` in the old camera's frame, the new pixel
``x`` shows what the old pixel ``K R K^-1 x`` showed (Hartley and Zisserman, Multiple View Geometry,
2nd ed., section 8.4.2). The position of the label stays, its rotation is multiplied by ``R``: exact
new poses for nothing but a resampling, so that few paths teach more orientations than they have.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import torch
from torch import Tensor, nn

from baselines.config.learning import AugmentationConfig, NetworkConfig
from baselines.training.checkpoint import FrameCamera, frame_camera
from synfeal.camera.projection import Intrinsics
from synfeal.dataset.packed import crop_of
from synfeal.errors import InputError

# Least depth of a ray: those of very wide cameras rotated far look sideways and see no pixel.
LEAST_DEPTH = 1e-3


class RandomRotation:
    """Turns every image of a batch by its own random rotation.

    Rotation vectors are uniform in a box: up to ``tilt_deg`` about the camera's x and y axes, up to
    ``roll_deg`` about its optical axis. What the frame did not see is filled with its border.

    Args:
        intrinsics: Camera of the images, pixels.
        input_px: Side of the images.
        augmentation: Largest rotations.
        seed: Seed of the rotations.
        device: Device of the images, on which rotations are drawn: a seed gives one row of them on
            every processor, and another on every GPU.

    Attributes:
        generator: Generator of the rotations.
    """

    def __init__(
        self,
        intrinsics: Intrinsics,
        input_px: int,
        augmentation: AugmentationConfig,
        seed: int,
        device: torch.device | str = "cpu",
    ) -> None:
        tilt, roll = math.radians(augmentation.tilt_deg), math.radians(augmentation.roll_deg)
        self._largest_rad = torch.tensor([tilt, tilt, roll], device=device)
        self.generator = torch.Generator(device).manual_seed(seed)
        self._rays = _rays(intrinsics, input_px).to(device)
        self._grid_from_ray = _grid_from_ray(intrinsics, input_px).to(device)

    def __call__(self, images: Tensor, quat_wxyz: Tensor) -> tuple[Tensor, Tensor]:
        """Rotate images (B, 3, S, S), channels last, and their quaternions (B, 4)."""
        draws = torch.rand(len(images), 3, generator=self.generator, device=images.device)
        rotvec_rad = (2 * draws - 1) * self._largest_rad
        return self.rotated(images, rotvec_rad), quat_product(quat_wxyz, quat_of(rotvec_rad))

    def rotated(self, images: Tensor, old_from_new_rad: Tensor) -> Tensor:
        """Rotate the camera of images (B, 3, S, S) about its axes by rotation vectors (B, 3).

        A positive turn about y looks further right, one about x further up, one about z rolls the
        camera clockwise.
        """
        points = self._grid_from_ray @ rotation_of(old_from_new_rad) @ self._rays
        across, down = points[:, :2].div_(points[:, 2:].clamp_min(LEAST_DEPTH)).unbind(1)
        grid = torch.stack([across, down], dim=-1).view(len(images), *images.shape[2:], 2)
        sampled = nn.functional.grid_sample(
            images, grid, mode="bilinear", padding_mode="border", align_corners=False
        )
        return sampled.contiguous(memory_format=torch.channels_last)

    def state_dict(self) -> dict[str, Tensor]:
        """Return the state of the generator."""
        return {"generator": self.generator.get_state()}

    def load_state_dict(self, state: Mapping[str, Tensor], /) -> None:
        """Restore the generator."""
        self.generator.set_state(state["generator"])


def random_rotation(
    frames: Path,
    network: NetworkConfig,
    augmentation: AugmentationConfig,
    seed: int,
    device: torch.device | str = "cpu",
) -> RandomRotation | None:
    """Set up random rotations of packed frames.

    Args:
        frames: Packed frames; the record beside them says through which camera they were taken.
        network: Side and view of the network's input.
        augmentation: Largest rotations.
        seed: Seed of the rotations.
        device: Device of the images.

    Returns:
        The rotations; None where nothing is to be rotated.

    Raises:
        InputError: there is no record, or the lens of its camera bends lines.
    """
    if not augmentation.turns:
        return None
    camera = frame_camera(frames)
    if camera is None or any(camera.distortion):
        reason = "names no perspective camera" if camera is None else "names a lens with distortion"
        raise InputError(
            frames.with_suffix(".json"),
            f"{reason}; images can only be rotated through a known pinhole camera, so set"
            " training.augmentation to 0",
        )
    intrinsics = packed_intrinsics(camera, network)
    return RandomRotation(intrinsics, network.input_px, augmentation, seed, device)


def packed_intrinsics(camera: FrameCamera, network: NetworkConfig) -> Intrinsics:
    """Return the intrinsics in pixels of frames of ``camera`` as packed for ``network``."""
    crop = crop_of((camera.width, camera.height), network.input_px, network.view)
    x, y = crop.width / camera.width, crop.height / camera.height
    return Intrinsics(
        camera.fx * x, camera.fy * y, camera.cx * x - crop.left, camera.cy * y - crop.top
    )


def rotation_of(rotvec_rad: Tensor) -> Tensor:
    """Compute the rotation matrices (B, 3, 3) of rotation vectors (B, 3)."""
    x, y, z = rotvec_rad.unbind(1)
    o = torch.zeros_like(x)
    skew = torch.stack([o, -z, y, z, o, -x, -y, x, o], dim=1).view(-1, 3, 3)
    if rotvec_rad.device.type != "cpu":
        return _rodrigues(skew, rotvec_rad)
    matrices: Tensor = torch.linalg.matrix_exp(skew)
    return matrices


def _rodrigues(skew: Tensor, rotvec_rad: Tensor) -> Tensor:
    """Compute the exponentials (B, 3, 3) of skew matrices (B, 3, 3) in closed form.

    Torch's ``matrix_exp`` copies from the processor to a GPU, which a CUDA graph does not allow.
    """
    angle_rad = torch.linalg.vector_norm(rotvec_rad, dim=1)[:, None, None]
    # sin(a) / a and (1 - cos(a)) / a^2 as sinc, which is 1 at 0; torch's has pi in its argument.
    sine = torch.sinc(angle_rad / math.pi)
    cosine = 0.5 * torch.sinc(angle_rad / (2 * math.pi)) ** 2
    identity = torch.eye(3, dtype=skew.dtype, device=skew.device)
    # Sums of three, not matrix products, which a GPU may be allowed to round.
    squared = (skew[:, :, :, None] * skew[:, None, :, :]).sum(2)
    return identity + sine * skew + cosine * squared


def quat_of(rotvec_rad: Tensor) -> Tensor:
    """Compute the unit quaternions wxyz (B, 4) of rotation vectors (B, 3); exact at zero."""
    angle_rad = torch.linalg.vector_norm(rotvec_rad, dim=1, keepdim=True)
    # sin(a / 2) / a as sinc, which is 1 at 0; torch's has pi in its argument.
    vector = 0.5 * torch.sinc(angle_rad / (2 * math.pi)) * rotvec_rad
    return torch.cat([torch.cos(angle_rad / 2), vector], dim=1)


def quat_product(a_wxyz: Tensor, b_wxyz: Tensor) -> Tensor:
    """Compute the Hamilton product (B, 4): the rotation ``b`` first, then ``a``."""
    aw, av = a_wxyz[:, :1], a_wxyz[:, 1:]
    bw, bv = b_wxyz[:, :1], b_wxyz[:, 1:]
    scalar = aw * bw - (av * bv).sum(1, keepdim=True)
    vector = aw * bv + bw * av + torch.linalg.cross(av, bv)
    return torch.cat([scalar, vector], dim=1)


def _rays(intrinsics: Intrinsics, input_px: int) -> Tensor:
    """Return directions (3, S * S) through the pixel centres, row by row, of depth 1."""
    centres = torch.arange(input_px) + 0.5
    x = (centres - intrinsics.cx) / intrinsics.fx
    y = (centres - intrinsics.cy) / intrinsics.fy
    down, across = torch.meshgrid(y, x, indexing="ij")
    return torch.stack([across, down, torch.ones_like(across)]).view(3, -1)


def _grid_from_ray(intrinsics: Intrinsics, input_px: int) -> Tensor:
    """Return the projection (3, 3) to ``grid_sample``'s coordinates, -1 and 1 at the borders.

    With ``align_corners=False`` the centre of the first pixel is half a pixel from them, as in our
    cameras.
    """
    projection = torch.tensor(intrinsics.matrix(), dtype=torch.float32)
    projection[:2] *= 2 / input_px
    projection[:2, 2] -= 1
    return projection
