"""Photometric randomisation of training images: light, lens and sensor.

Where a scan has not seen the place, renderings are empty; there they show random colours. The rest
happens in linear light, white is 1, between files that hold sRGB (IEC 61966-2-1), in the order in
which it comes to a photograph: light falls on the scene, something stands before it, the lens
blurs, the exposure scales, stray light and the black level are added, the sensor adds noise and
clips, white balance scales red and blue.

Domain randomisation after Tobin et al., "Domain randomization for transferring deep neural networks
from simulation to the real world" (IROS 2017); rectangles after Zhong et al., "Random erasing data
augmentation" (AAAI 2020).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from typing import NamedTuple

import torch
from torch import Tensor, nn

from synfeal.config.effects import NoiseConfig
from synfeal.config.photometric import OcclusionConfig, PhotometricConfig

# Of IEC 61966-2-1: below the first number of light, above it the power of the second.
LINEAR_BELOW, POWER = 0.0031308, 2.4


class Rectangles(NamedTuple):
    """A rectangle of one colour for each image, in pixels; empty where the width is 0."""

    left: Tensor  # (B,) int64
    top: Tensor  # (B,) int64
    width: Tensor  # (B,) int64
    height: Tensor  # (B,) int64
    light: Tensor  # (B, 3) linear


class PhotometricRandomisation:
    """Shows every image of a batch under its own random light, lens and sensor.

    Draws are made on the device of the images: for noise alone there are as many as pixels, more
    than a processor makes in the time in which a GPU learns from them.

    Args:
        config: Ranges to draw from.
        seed: Seed of all draws. It gives one row of them on every processor, and another on every
            GPU.
        device: Device of the images.

    Attributes:
        generator: Generator of all draws.
    """

    def __init__(
        self, config: PhotometricConfig, seed: int, device: torch.device | str = "cpu"
    ) -> None:
        self._config = config
        self._device = torch.device(device)
        self.generator = torch.Generator(device).manual_seed(seed)

    def __call__(self, images: Tensor) -> Tensor:
        """Randomise images (B, 3, S, S) uint8 to float grey levels in 0 to 255, channels last."""
        config, count, side = self._config, len(images), images.shape[-1]
        if config.unseen is not None:
            cells = config.unseen.cells
            images = filled(images, config.unseen.level, self._uniform(count, 3, cells, cells))
        light = light_of(images)
        if config.field_ev:
            nodes_ev = config.field_ev * self._normal(count, 1, config.field_cells)
            light = light * smooth_gain(nodes_ev, side)
        if config.occlusion is not None:
            light = covered(light, self._rectangles(config.occlusion, count, side))
        if config.blur is not None:
            sigma_px = config.blur.sigma * side * self._uniform(count, 2)
            light = blurred_where(self._uniform(count) < config.blur.share, light, sigma_px)
        low_ev, high_ev = config.exposure_ev
        gain = torch.exp2(low_ev + (high_ev - low_ev) * self._uniform(count, 1, 1, 1))
        low, high = config.offset
        offset = low + (high - low) * self._uniform(count, 1, 1, 1)
        light = (light * gain + offset).clamp_(0.0, 1.0)
        if config.noise is not None:
            light = noisy(light, self._normal(count, 3, side), config.noise)
        balance_ev = config.white_balance_ev * (2 * self._uniform(count, 2) - 1)
        light = light * balance_gains(balance_ev)
        return levels_of(light).contiguous(memory_format=torch.channels_last)

    def state_dict(self) -> dict[str, Tensor]:
        """Return the state of the generator."""
        return {"generator": self.generator.get_state()}

    def load_state_dict(self, state: Mapping[str, Tensor], /) -> None:
        """Restore the generator."""
        self.generator.set_state(state["generator"])

    def _uniform(self, *shape: int) -> Tensor:
        return torch.rand(*shape, generator=self.generator, device=self._device)

    def _normal(self, count: int, channels: int, side: int) -> Tensor:
        shape = (count, channels, side, side)
        return torch.randn(*shape, generator=self.generator, device=self._device)

    def _rectangles(self, config: OcclusionConfig, count: int, side: int) -> Rectangles:
        """Draw rectangles of uniform area and place, their aspect ratio uniform in logarithm."""
        low, high = config.area
        area_px = (low + (high - low) * self._uniform(count)) * side**2
        log_aspect = math.log(config.most_aspect) * (2 * self._uniform(count) - 1)
        # Where a rectangle of this shape would not fit, it is as wide (as high) as the image.
        width = (area_px * log_aspect.exp()).sqrt().clamp(max=side).round().clamp(min=1)
        height = (area_px / width).clamp(max=side).round()
        width = torch.where(self._uniform(count) < config.share, width, 0.0)
        left = (self._uniform(count) * (side - width + 1)).floor()
        top = (self._uniform(count) * (side - height + 1)).floor()
        color = self._uniform(count, 3)
        return Rectangles(left.long(), top.long(), width.long(), height.long(), color)


def filled(images: Tensor, level: int, colors: Tensor) -> Tensor:
    """Fill the empty pixels of images (B, 3, H, W) uint8 with smooth random colours.

    A pixel is empty if no channel is above ``level``, or if it lies beside such a pixel, where the
    edge of what is seen was averaged with nothing.

    Args:
        images: Images; nothing is drawn where they are black.
        level: Grey level.
        colors: Between 0 and 1 (B, 3, n, n), of a grid over the image that is interpolated.
    """
    empty = (images.amax(1, keepdim=True) <= level).float()
    empty = nn.functional.max_pool2d(empty, 3, stride=1, padding=1) > 0
    fill = nn.functional.interpolate(
        255 * colors, images.shape[2:], mode="bilinear", align_corners=True
    )
    return torch.where(empty, fill.round().byte(), images)


def light_of(images: Tensor) -> Tensor:
    """Convert grey levels (...) uint8 to linear light (...), white at 1."""
    level = torch.arange(256, dtype=torch.float32, device=images.device) / 255
    linear = torch.where(
        level <= 12.92 * LINEAR_BELOW, level / 12.92, ((level + 0.055) / 1.055) ** POWER
    )
    return linear[images.contiguous().int()]


def levels_of(light: Tensor) -> Tensor:
    """Convert linear light (...) to grey levels (...), not rounded; above white it is 255."""
    light = light.clamp(0.0, 1.0)
    curve = 1.055 * light.clamp_min(LINEAR_BELOW) ** (1 / POWER) - 0.055
    return 255 * torch.where(light <= LINEAR_BELOW, 12.92 * light, curve)


def smooth_gain(nodes_ev: Tensor, side: int) -> Tensor:
    """Interpolate stops (B, 1, n, n) at equally spaced nodes to factors (B, 1, side, side)."""
    if nodes_ev.shape[-1] == 1:
        return torch.exp2(nodes_ev).expand(-1, -1, side, side)
    return torch.exp2(
        nn.functional.interpolate(nodes_ev, (side, side), mode="bicubic", align_corners=True)
    )


def covered(light: Tensor, rectangles: Rectangles) -> Tensor:
    """Cover light (B, 3, H, W) with a rectangle of one colour per image."""
    left, top, width, height = (values[:, None] for values in rectangles[:4])
    column = torch.arange(light.shape[3], device=light.device)
    row = torch.arange(light.shape[2], device=light.device)
    across = (column >= left) & (column < left + width)
    down = (row >= top) & (row < top + height)
    hidden = (down[:, :, None] & across[:, None, :])[:, None]
    return torch.where(hidden, rectangles.light[:, :, None, None], light)


def blurred_where(hit: Tensor, light: Tensor, sigma_px: Tensor) -> Tensor:
    """Blur those of the images (B, 3, S, S) that are hit (B,), as :func:`blurred` does.

    A processor leaves the others out. On a GPU all are blurred and some results not used: how many
    are hit would have to be waited for, and differs from batch to batch.
    """
    if light.device.type != "cpu":
        return torch.where(hit[:, None, None, None], blurred(light, sigma_px), light)
    rows = torch.nonzero(hit).squeeze(1)
    light[rows] = blurred(light[rows], sigma_px[rows])
    return light


def blurred(light: Tensor, sigma_px: Tensor) -> Tensor:
    """Blur light (B, C, S, S) by Gaussians of standard deviations (B, 2) across and down, pixels.

    The image goes on as in a mirror beyond its border. There the cosine transform diagonalises the
    filter, which is ``exp(-sigma^2 omega^2 / 2)`` on its coefficients: the mean stays as it is,
    and two blurs are one of the summed variances.
    """
    across, down = (_mirrored_gaussian(light.shape[-1], sigma) for sigma in sigma_px.T)
    return down[:, None] @ light @ across[:, None]


def _mirrored_gaussian(side: int, sigma_px: Tensor) -> Tensor:
    """Return symmetric matrices (B, side, side) that filter a row or a column."""
    cosines = _cosine_transform(side, sigma_px.device)
    omega = torch.arange(side, device=sigma_px.device).to(sigma_px) * (math.pi / side)
    damping = torch.exp(-0.5 * (sigma_px[:, None] * omega) ** 2)
    return cosines.T @ (damping[:, :, None] * cosines)


@cache
def _cosine_transform(side: int, device: torch.device) -> Tensor:
    """Return the orthogonal DCT-II (side, side), a row for each frequency, on a device."""
    frequency = torch.arange(side, dtype=torch.float64)[:, None]
    place = torch.arange(side, dtype=torch.float64)[None] + 0.5
    rows = torch.cos(math.pi / side * frequency * place) * math.sqrt(2 / side)
    rows[0] /= math.sqrt(2)
    return rows.float().to(device)


def noisy(light: Tensor, normal: Tensor, noise: NoiseConfig) -> Tensor:
    """Add a sensor's noise to linear light.

    Variance ``light / full_well + (read / full_well)^2``, as in
    :func:`synfeal.effects.light.with_noise`.

    Args:
        light: Linear light (B, 3, H, W), 0 to 1.
        normal: Standard normal values of the same shape.
        noise: Read noise and full-well capacity, electrons.

    Returns:
        Light (B, 3, H, W), which may leave 0 to 1.
    """
    variance = light / noise.full_well_e + (noise.read_e / noise.full_well_e) ** 2
    return torch.addcmul(light, variance.sqrt_(), normal)


def balance_gains(balance_ev: Tensor) -> Tensor:
    """Convert stops (B, 2) of red and blue beside green to factors (B, 3, 1, 1) on the channels."""
    red, blue = torch.exp2(balance_ev).unbind(1)
    return torch.stack([red, torch.ones_like(red), blue], dim=1)[:, :, None, None]
