"""Global image descriptors: thumbnails and DenseVLAD.

DenseVLAD (Torii et al., CVPR 2015) is the retrieval baseline that Sattler et al. (CVPR 2019) hold
against pose regression. It needs no weights from elsewhere: its vocabulary and its principal axes
come from the training frames. SIFT descriptors are taken at every node of a grid, upright and at
one scale (Liu et al., ECCV 2008, with the triangular windows of VLFeat), their roots are assigned
to the nearest of 64 visual words, and the residuals of each word are summed, normalised word by
word (Arandjelović and Zisserman, CVPR 2013) and rotated to 256 dimensions.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import cv2
import numpy as np
import torch
import torch.nn.functional as nnf
from numpy.typing import NDArray
from scipy.cluster.vq import kmeans2
from torch import Tensor

from baselines.references.arrays import THUMBNAIL, VLAD, Vectors, write_arrays
from baselines.references.costs import write_costs
from synfeal.dataset.packed import read_packed
from synfeal.records.timing import Facts, timed

Frames = NDArray[np.uint8]
T = TypeVar("T", bound=np.generic)

THUMBNAIL_PX = 8
ORIENTATIONS, CELLS = 8, 4
WORDS, DIMENSIONS = 64, 256
# Frames and descriptors that the vocabulary and the axes are learned from.
SAMPLE_FRAMES, SAMPLE_DESCRIPTORS, ITERATIONS = 2000, 10_000, 10
CHUNK = 100  # frames at a time
# A cell of a descriptor has a 16th of the image's side: 4 px at 64 px, the best of 3 to 8 there.
CELLS_PER_SIDE = 16


def thumbnails(frames: Frames) -> Vectors:
    """Shrink frames (N, S, S, 3) to 8 x 8 pixels, as unit vectors (N, 192) without their mean."""
    side = (THUMBNAIL_PX, THUMBNAIL_PX)
    small = [cv2.resize(f, side, interpolation=cv2.INTER_AREA).ravel() for f in frames]
    vectors = np.array(small, dtype=np.float32)
    return unit(vectors - vectors.mean(axis=1, keepdims=True))


def unit(vectors: NDArray[np.floating]) -> Vectors:
    """Scale vectors (N, D) to length 1; one of zeros stays as it is."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-12), dtype=np.float32)


def dense_sift(frames: Frames) -> Tensor:
    """Compute RootSIFT descriptors (N, G, 128) on a grid over frames (N, S, S, 3), upright.

    Cells are S / 16 pixels wide and the grid's step is one cell. The roots of a descriptor of
    L1 norm 1 make Euclidean distances those of Hellinger (Arandjelović and Zisserman, CVPR 2012).
    """
    cell_px = max(2, round(frames.shape[1] / CELLS_PER_SIDE))
    cells = _windowed(_oriented_gradients(torch.from_numpy(np.array(frames))), cell_px)
    span = (CELLS - 1) * cell_px + 1
    for axis in (2, 3):
        cells = cells.unfold(axis, span, cell_px)[..., ::cell_px]
    vectors = cells.permute(0, 2, 3, 4, 5, 1).reshape(len(frames), -1, CELLS**2 * ORIENTATIONS)
    vectors = nnf.normalize(vectors, dim=-1).clamp(max=0.2)  # strong edges count less, as in SIFT
    return nnf.normalize(vectors, p=1.0, dim=-1).sqrt()


def _oriented_gradients(frames: Tensor) -> Tensor:
    """Compute gradient magnitudes (N, 8, S, S), shared linearly by the two nearest directions."""
    grey = nnf.pad(frames.float().mean(dim=-1)[:, None], (1, 1, 1, 1), mode="replicate")[:, 0]
    dx = grey[:, 1:-1, 2:] - grey[:, 1:-1, :-2]
    dy = grey[:, 2:, 1:-1] - grey[:, :-2, 1:-1]
    place = torch.atan2(dy, dx)[:, None] * (ORIENTATIONS / (2 * torch.pi))
    off = place - torch.arange(ORIENTATIONS, dtype=torch.float32)[None, :, None, None]
    off = (off - ORIENTATIONS * torch.round(off / ORIENTATIONS)).abs()
    return torch.hypot(dx, dy)[:, None] * (1 - off).clamp(min=0)


def _windowed(maps: Tensor, cell_px: int) -> Tensor:
    """Sum maps (N, 8, S, S) under triangular windows of two cells' width, where they fit."""
    window = 1 - torch.arange(1 - cell_px, cell_px).abs() / cell_px
    kernel = window.float().expand(ORIENTATIONS, 1, -1)
    rows = nnf.conv2d(maps, kernel[:, :, None, :], groups=ORIENTATIONS)
    return nnf.conv2d(rows, kernel[:, :, :, None], groups=ORIENTATIONS)


@dataclass(frozen=True)
class Vlad:
    """A learned DenseVLAD.

    Attributes:
        words: Visual words (64, 128).
        mean: Mean (64 * 128,) over the training frames.
        axes: Principal axes (64 * 128, D), each over the root of its singular value; D <= 256.
    """

    words: Tensor
    mean: Vectors
    axes: Vectors

    @classmethod
    def learn(cls, frames: Frames, seed: int) -> Vlad:
        """Learn vocabulary and axes from training frames (N, S, S, 3), at most 2,000 of them drawn.

        Dividing by the root of a singular value halves what full whitening does; on 1,500 frames it
        was the best of none, half and full.
        """
        rng = np.random.default_rng(seed)
        count = min(len(frames), SAMPLE_FRAMES)
        sample = frames[np.sort(rng.choice(len(frames), count, replace=False))]
        sifts = np.concatenate([dense_sift(part).numpy() for part in parts_of(sample)])
        every = sifts.reshape(-1, sifts.shape[-1])
        chosen = every[rng.choice(len(every), min(len(every), SAMPLE_DESCRIPTORS), replace=False)]
        found, _ = kmeans2(chosen, WORDS, iter=ITERATIONS, minit="++", rng=rng, missing="warn")
        words = torch.from_numpy(found.astype(np.float32))
        sums = np.concatenate([residuals(part, words) for part in parts_of(sifts)])
        mean = sums.mean(axis=0)
        _, spread, axes = np.linalg.svd(sums - mean, full_matrices=False)
        kept = slice(min(DIMENSIONS, int((spread > 1e-4 * spread[0]).sum())))
        scaled = axes[kept].T / np.sqrt(spread[kept])
        return cls(words, mean, scaled.astype(np.float32))

    def describe(self, frames: Frames) -> Vectors:
        """Compute the unit vectors (N, D) of frames (N, S, S, 3)."""
        sums = (residuals(dense_sift(part).numpy(), self.words) for part in parts_of(frames))
        return np.concatenate([unit((part - self.mean) @ self.axes) for part in sums])


def residuals(sifts: Vectors, words: Tensor) -> Vectors:
    """Compute VLAD (N, W * 128) of descriptors (N, G, 128): residuals from their nearest words."""
    parts = torch.from_numpy(np.ascontiguousarray(sifts))
    nearest = (2 * parts @ words.T - words.square().sum(dim=1)).argmax(dim=2)
    belongs = nnf.one_hot(nearest, len(words)).float()  # (N, G, W)
    sums = belongs.transpose(1, 2) @ parts - belongs.sum(dim=1)[..., None] * words
    return nnf.normalize(nnf.normalize(sums, dim=2).flatten(1), dim=1).numpy()


def parts_of(values: NDArray[T]) -> Iterator[NDArray[T]]:
    """Yield rows, ``CHUNK`` at a time."""
    return (values[start : start + CHUNK] for start in range(0, len(values), CHUNK))


def write_descriptors(
    files: Mapping[str, Path],
    learned_from: int,
    seed: int,
    out_descriptors: Path,
    counts: Mapping[str, int] | None = None,
    out_costs: Path | None = None,
) -> None:
    """Describe packed frames as wholes.

    Args:
        files: Packed frames by name; the vocabulary and the axes come from those of ``train``.
        learned_from: Number of them: those of the smallest size, so that no size sees frames that
            are not its own.
        seed: Seed of the samples and of k-means.
        out_descriptors: Arrays to write, ``<descriptor>_<name>`` (N, D).
        counts: Number of frames of each, if not all.
        out_costs: JSON to write: processor seconds per frame of ``test``, by descriptor.

    Raises:
        InputError: packed frames cannot be read.
    """
    torch.set_num_threads(1)
    counts = counts or {}
    frames = {name: read_packed(path)[: counts.get(name)] for name, path in files.items()}
    vlad = Vlad.learn(frames["train"][:learned_from], seed)
    methods = {THUMBNAIL: thumbnails, VLAD: vlad.describe}
    vectors: dict[str, Vectors] = {}
    spent: Facts = {}
    for descriptor, work in methods.items():
        for name, part in frames.items():
            with timed(spent, f"{descriptor}_{name}"):
                vectors[f"{descriptor}_{name}"] = work(part)
    write_arrays(out_descriptors, vectors)
    if out_costs:
        of_test = {descriptor: spent[f"{descriptor}_test"] for descriptor in methods}
        write_costs(out_costs, of_test, len(frames["test"]))
