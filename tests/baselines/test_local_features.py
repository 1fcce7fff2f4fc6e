"""Local features: where they lie, and that photographs are found by the kind that a map holds."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from baselines.references.local_features import Sift
from baselines.references.photographs import Finder
from tests.support.bays import Bays


class Numbered:
    """Features that are known by a number, and match where it is the same."""

    def detect(self, grey):
        raise NotImplementedError("nothing is looked at")

    def vectors(self, descriptor):
        return descriptor.astype(np.float32)

    def match(self, own, other):
        _, rows, others = np.intersect1d(own.vector, other.vector, return_indices=True)
        return rows, others


def test_a_photograph_is_found_by_features_of_another_kind(monkeypatch):
    monkeypatch.setattr(Finder, "alike", lambda self, _, among: among)
    bays = Bays(0, n_bays=1)
    number = np.arange(len(bays.points))
    place = replace(
        bays.map,
        features=replace(
            bays.map.features, descriptor=np.tile(number, len(bays.map))[:, None].astype(np.uint16)
        ),
    )
    photograph = bays.seen_from_last()._replace(vector=number[:, None].astype(np.float32))
    answer = Finder(place, kind=Numbered()).find(photograph)
    assert answer.support.inliers == len(number)
    assert bays.error_m(answer.world_from_cam) < 1e-6


def test_positions_are_measured_from_the_corner_of_the_image():
    """In a mirror, a feature at x lies at W - x."""
    rng = np.random.default_rng(0)
    noise = rng.integers(0, 255, (30, 40), dtype=np.uint8)
    grey = cv2.resize(noise, (320, 240), interpolation=cv2.INTER_CUBIC)
    pixel, _ = Sift().detect(grey)
    mirrored, _ = Sift().detect(np.ascontiguousarray(grey[:, ::-1]))
    mirrored[:, 0] = 320 - mirrored[:, 0]
    apart = pixel[:, None] - mirrored[None]
    nearest = np.linalg.norm(apart, axis=2).argmin(axis=1)
    off = apart[np.arange(len(pixel)), nearest]
    assert len(pixel) > 100
    assert np.median(off[:, 0]) == pytest.approx(0, abs=0.05)
