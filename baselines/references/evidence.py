"""Inputs of the reference methods, read when a method asks for them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from baselines.references.arrays import Described, read_described
from baselines.references.correspondences import Correspondences, Tracks
from baselines.references.costs import read_costs
from baselines.references.features import Views
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.records.timing import Facts, timed


@dataclass(frozen=True)
class Evidence:
    """A data set as the reference methods see it.

    Methods answer from ``train`` and from what is computed of images and depth. The file of
    ``test_truth`` is for the oracle, whose use of it is the point.

    Attributes:
        files: Files by name: labels (``train``, ``test``), true poses (``train_truth``,
            ``test_truth``), and what the methods of a group need.
        camera: Camera of the frames that features were found in.
        seed: Seed of whatever is random.
        samples_seen: Images that a method that learns is shown.
        spent: Processor seconds: ``prepare_s``, in :meth:`preparing`.
    """

    files: Mapping[str, Path]
    camera: CameraConfig
    seed: int
    samples_seen: int = 0
    spent: Facts = field(default_factory=dict)

    @contextmanager
    def preparing(self) -> Iterator[None]:
        """Count what a block takes as learning or building a map, not as answering."""
        before, own = self.spent.get("prepare_s", 0.0), Facts()
        with timed(own, "prepare_s"):
            yield
        self.spent["prepare_s"] = before + own["prepare_s"]

    @cached_property
    def query_costs(self) -> dict[str, float]:
        """Processor seconds per test frame of what was done with it before, by name."""
        return read_costs(path for name, path in self.files.items() if name.endswith("_costs"))

    @cached_property
    def train(self) -> PoseTable:
        """Labels of the training frames."""
        return read_pose_table(self.files["train"])

    @cached_property
    def test_frames(self) -> PoseTable:
        """Test frames; the poses in the table are what methods are asked for."""
        return read_pose_table(self.files["test"])

    @cached_property
    def descriptors(self) -> Described:
        """Global descriptors of the training and test images, by name, unit length."""
        return read_described(
            self.files["descriptors"], n_train=len(self.train), n_test=len(self.test_frames)
        )

    @cached_property
    def correspondences(self) -> Correspondences:
        """Features of the test images matched with those of the training images."""
        return Correspondences.read(self.files["correspondences"])

    @cached_property
    def tracks(self) -> Tracks:
        """Features of the training images with usable labels that show the same point."""
        return Tracks.read(self.files["tracks"]).seen_by(self.train.usable_rows)

    @cached_property
    def views(self) -> tuple[Views, Views]:
        """Small training images with depth, and small test images."""
        return Views.read(self.files["train_views"]), Views.read(self.files["test_views"])
