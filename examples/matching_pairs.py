"""Pairs of images with dense correspondences, for training a matcher with PyTorch.

    synfeal collect scan.glb --frames 2000 --depth --out mydata
    synfeal pairs mydata --min-overlap 0.2 --max-overlap 0.8 --per-frame 10 --out mydata-pairs
    python examples/matching_pairs.py mydata mydata-pairs

Flow is computed from depth and poses as a pair is loaded, in a few milliseconds, so that nothing
but the table of pairs has to be stored; with ``synfeal pairs --flow`` it can be read instead.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TypedDict

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.utils.data import DataLoader, Dataset

import synfeal


class Pair(TypedDict):
    """One example; images are float32, 0 to 1, channels first."""

    image_a: Tensor  # (3, H, W)
    image_b: Tensor  # (3, H, W)
    points_a: Tensor  # (M, 2) x and y of pixels of a, the centre of the first is (0.5, 0.5)
    points_b: Tensor  # (M, 2) where b shows the same points, for those that are visible in it
    visible: Tensor  # (M,) bool
    overlap: Tensor  # () of a with b


class MatchingPairs(Dataset[Pair]):
    """Pairs of a table of ``synfeal pairs``, with ``n_points`` random pixels of a found in b."""

    def __init__(self, dataset: Path, pairs: Path, n_points: int = 512, seed: int = 0) -> None:
        """Read the table and the poses; images are read when a pair is asked for."""
        self._table = synfeal.read_pairs(pairs)
        data = synfeal.open_dataset(dataset)
        self._camera = data.camera
        self._frames = {
            f"{file.parent.name}/{file.name}": (split, row)
            for split in (data.train, data.test)
            for row, file in enumerate(split.images)
        }
        self._n_points, self._seed = n_points, seed

    def __len__(self) -> int:
        """Return the number of pairs."""
        return len(self._table)

    def __getitem__(self, row: int) -> Pair:
        """Load a pair; the same row gives the same points."""
        split_a, a = self._frames[self._table["image_a"][row]]
        split_b, b = self._frames[self._table["image_b"][row]]
        flow = synfeal.flow_between(
            camera=self._camera,
            depth_a_m=split_a.depth_m(a),
            world_from_a=split_a.world_from_cam[a],
            depth_b_m=split_b.depth_m(b),
            world_from_b=split_b.world_from_cam[b],
        )
        rng = np.random.default_rng((self._seed, row))
        height, width = flow.is_visible.shape
        lines = rng.integers(0, height, self._n_points)
        columns = rng.integers(0, width, self._n_points)
        points_a = np.stack([columns, lines], axis=-1) + np.float32(0.5)
        visible = flow.is_visible[lines, columns]
        points_b = points_a + np.where(visible[:, None], flow.flow_px[lines, columns], 0.0)
        return Pair(
            image_a=channels_first(split_a.rgb(a)),
            image_b=channels_first(split_b.rgb(b)),
            points_a=torch.from_numpy(points_a.astype(np.float32)),
            points_b=torch.from_numpy(points_b.astype(np.float32)),
            visible=torch.from_numpy(visible),
            overlap=torch.tensor(self._table["overlap_ab"][row], dtype=torch.float32),
        )


def channels_first(rgb: NDArray[np.uint8]) -> Tensor:
    """Turn an image (H, W, 3), 0 to 255, into one (3, H, W), 0 to 1."""
    return torch.from_numpy(rgb).permute(2, 0, 1).float() / 255.0


def sample(image: Tensor, points: Tensor) -> Tensor:
    """Read images (B, 3, H, W) at points (B, M, 2) in pixels: (B, 3, M)."""
    height, width = image.shape[-2:]
    place = 2.0 * points / torch.tensor([width, height]) - 1.0
    read = torch.nn.functional.grid_sample(image, place[:, None], align_corners=False)
    return read[:, :, 0]


def main() -> None:
    """Load batches as training would, and compare the colours of corresponding points."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("dataset", type=Path)
    parser.add_argument("pairs", type=Path)
    parser.add_argument("--batch", type=int, default=4)
    options = parser.parse_args()
    loader = DataLoader(
        MatchingPairs(options.dataset, options.pairs), batch_size=options.batch, shuffle=True
    )
    visible, matching, shuffled = 0, [], []
    for batch in loader:
        color_a = sample(batch["image_a"], batch["points_a"])
        color_b = sample(batch["image_b"], batch["points_b"])
        seen = batch["visible"]
        other = color_b.roll(1, dims=-1)
        matching.append((color_a - color_b).abs().mean(1)[seen])
        shuffled.append((color_a - other).abs().mean(1)[seen])
        visible += int(seen.sum())
    levels = [255.0 * float(torch.cat(each).median()) for each in (matching, shuffled)]
    print(
        f"{len(loader.dataset)} pairs, {visible} correspondences: colours differ by"
        f" {levels[0]:.1f} levels (median), those of other points by {levels[1]:.1f}"
    )


if __name__ == "__main__":
    main()
