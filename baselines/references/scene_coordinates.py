"""Poses by scene-coordinate regression: a network predicts 3D points of cells, then PnP.

As in DSAC* with depth (Brachmann and Rother, PAMI 2021), without its end-to-end stage: exact depth
gives the points of the training images in their cameras, the labels put them into the world, and
from the points that are predicted for a test image its pose is found as structure-based poses are.
Errors of the labels become errors of the points to learn, which the network averages over.

The network is DSAC*'s in its small form (4 MB of weights), in colour, with one stride less, since
images here have 66 rows and not 480: half an image is what one cell sees in both.
"""

from __future__ import annotations

import logging

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from baselines.localizers.base import OutputLayer
from baselines.references.evidence import Evidence
from baselines.references.features import Views
from baselines.references.structure import absolute_pose, pinhole
from baselines.registry.kinds import ReferenceMethod
from baselines.training.data import ImageStatistics, image_statistics
from baselines.training.device import autocast, open_device, precision_on
from baselines.training.optimizer import Schedule, optimisation_of

log = logging.getLogger(__name__)
Array = NDArray[np.float64]

CHANNELS = 128


class _Convolution(nn.Sequential):
    """A convolution that keeps the size or halves it, and ReLU."""

    def __init__(self, n_in: int, n_out: int, kernel: int, stride: int = 1) -> None:
        super().__init__(nn.Conv2d(n_in, n_out, kernel, stride, kernel // 2), nn.ReLU(inplace=True))


class _Residual(nn.Module):
    """Three convolutions of these kernels, added to what they are given."""

    def __init__(self, *kernels: int) -> None:
        super().__init__()
        self.layers = nn.Sequential(*(_Convolution(CHANNELS, CHANNELS, k) for k in kernels))

    def forward(self, x: Tensor) -> Tensor:
        """Map (B, 128, R, C) to the same shape."""
        out: Tensor = x + self.layers(x)
        return out


class _Coordinates(OutputLayer):
    """The last linear map, in float32: bfloat16 rounds coordinates to centimetres."""

    def __init__(self) -> None:
        super().__init__()
        self.linear = nn.Conv2d(CHANNELS, 3, 1)

    def forward(self, x: Tensor) -> Tensor:
        with torch.autocast(x.device.type, enabled=False):
            out: Tensor = self.linear(x.float())
        return out


class CoordinateNetwork(nn.Module):
    """Network from normalised images (B, 3, h, w) to the points (B, 3, R, C) that their cells show.

    Points are in metres, in the world of the labels; at first all are the mean of those to learn.
    """

    mean_m: Tensor

    def __init__(self, mean_m: Tensor) -> None:
        super().__init__()
        out = _Coordinates()
        self.layers = nn.Sequential(
            _Convolution(3, 32, 3),
            _Convolution(32, 64, 3, 2),
            _Convolution(64, CHANNELS, 3, 2),
            _Convolution(CHANNELS, CHANNELS, 3),
            _Residual(3, 1, 3),
            _Residual(3, 1, 3),
            _Residual(1, 1, 1),
            _Convolution(CHANNELS, CHANNELS, 1),
            _Convolution(CHANNELS, CHANNELS, 1),
            out,
        )
        self.register_buffer("mean_m", mean_m.view(1, 3, 1, 1))
        for module in self.modules():
            if isinstance(module, nn.Conv2d):
                nn.init.kaiming_normal_(module.weight, nonlinearity="relu")
                nn.init.zeros_(module.bias)  # type: ignore[arg-type]
        nn.init.zeros_(out.linear.weight)  # the mean at first, not points outside the room

    def forward(self, images: Tensor) -> Tensor:
        """Predict scene coordinates from normalised images."""
        out: Tensor = self.layers(images) + self.mean_m
        return out


def distance_m(found: Tensor, wanted: Tensor) -> Tensor:
    """Compute the mean distance between points (B, 3, R, C), where the wanted one is known."""
    known = wanted.isfinite().all(dim=1)
    off = torch.where(known[:, None], found - wanted, 0.0)
    mean: Tensor = torch.linalg.vector_norm(off, dim=1)[known].mean()
    return mean


BATCH, LEARNING_RATE = 8, 1e-3
# Points are off by decimetres where features are off by a pixel: a twentieth of the image's width.
MAX_ERROR_OF_WIDTH = 0.05
LOGGED = 50  # steps


@ReferenceMethod(
    name="scene-coordinates",
    title="Scene coordinates",
    rank=7,
    group="coordinates",
    query=("views",),
)
def by_coordinates(evidence: Evidence) -> Array:
    """Find the poses (N, 4, 4) of the test frames, NaN where none is found."""
    device = open_device("auto")
    with evidence.preparing():
        train, test = evidence.views
        usable = evidence.train.usable_rows
        rows = torch.from_numpy(usable[usable < len(train)])
        world = world_points(train, evidence.train.world_from_cam[: len(train)])
        points = torch.from_numpy(world)[rows]
        images = torch.from_numpy(train.images).permute(0, 3, 1, 2)[rows]
        statistics = image_statistics(images)
        network = learn(images, points, statistics, evidence.samples_seen, evidence.seed, device)
    return poses_of(test, predict(network, test, statistics, device), evidence)


def world_points(views: Views, world_from_cam: Array) -> NDArray[np.float32]:
    """Compute the cells' points (N, 3, R, C) in the labels' world; not finite without depth."""
    with np.errstate(invalid="ignore"):  # no depth
        turned = np.einsum("nij,nrcj->nirc", world_from_cam[:, :3, :3], views.point_m)
    return np.asarray(turned + world_from_cam[:, :3, 3, None, None], dtype=np.float32)


def learn(
    images: Tensor,
    points: Tensor,
    statistics: ImageStatistics,
    samples_seen: int,
    seed: int,
    device: torch.device,
) -> CoordinateNetwork:
    """Train a network by the mean distance of points, with the localizers' optimiser.

    Args:
        images: Images (N, 3, h, w) uint8.
        points: Points (N, 3, R, C) that the cells show, metres; not finite where unknown.
        statistics: Statistics of the images.
        samples_seen: Images shown in all.
        seed: Seed of the initial weights and of the order of the images.
        device: Device to learn on.
    """
    torch.manual_seed(seed)
    known = points.movedim(1, -1)[points.isfinite().all(dim=1)]
    network = CoordinateNetwork(known.mean(dim=0))
    network.to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]
    schedule = Schedule(samples_seen, BATCH, LEARNING_RATE, weight_decay=0.0)
    optimisation = optimisation_of("muon", network, schedule)
    epochs = -(-schedule.steps * BATCH // len(images))
    order = torch.cat([torch.randperm(len(images)) for _ in range(epochs)])
    for step, rows in enumerate(torch.split(order, BATCH)[: schedule.steps]):
        found = _answer(network, images[rows], statistics, device)
        loss = distance_m(found, points[rows].to(device))
        optimisation.step(loss)
        if step % LOGGED == 0 or step == schedule.steps - 1:
            log.info("step %d of %d: %.3f m", step + 1, schedule.steps, loss.item())
    return network


@torch.no_grad()
def predict(
    network: CoordinateNetwork, views: Views, statistics: ImageStatistics, device: torch.device
) -> Array:
    """Predict the points of the cells of every image.

    Args:
        network: Trained network, on ``device``.
        views: Images (N, h, w, 3) as it sees them.
        statistics: Statistics of the images that it was trained on.
        device: Device to predict on.

    Returns:
        Points (N, R, C, 3), world, metres.
    """
    images = torch.from_numpy(views.images).permute(0, 3, 1, 2)
    parts = torch.split(images, BATCH)
    found = torch.cat([_answer(network, part, statistics, device).cpu() for part in parts])
    return found.movedim(1, -1).double().numpy()


def _answer(
    network: CoordinateNetwork, images: Tensor, statistics: ImageStatistics, device: torch.device
) -> Tensor:
    normal = statistics.normalise(images).to(device, memory_format=torch.channels_last)
    with autocast(device, precision_on(device, "auto")):
        found: Tensor = network(normal)
    return found


def poses_of(views: Views, points: Array, evidence: Evidence) -> Array:
    """Find the poses of images from the points that their cells show, by PnP.

    Args:
        views: The images, with the rays of their cells.
        points: Points (N, R, C, 3), world, metres.
        evidence: Data set whose camera and seed are used.

    Returns:
        Poses ``world_from_cam`` (N, 4, 4); NaN where none is found.
    """
    camera = pinhole(evidence.camera)
    pixel = views.slope.reshape(-1, 2) * camera.params[:2]
    error_px = MAX_ERROR_OF_WIDTH * camera.width
    seen = points.reshape(len(views), -1, 3)
    return np.array([absolute_pose(pixel, p, camera, evidence.seed, error_px) for p in seen])
