"""Declarations of methods: what tables, figures, rules and training need to know.

Each is a decorator of the class or function that does the work::

    @LocalizerKind(name="posenet", title="PoseNet", halve_every=(60, 300))
    class PoseNet(Localizer): ...

Arguments must be literals: :mod:`baselines.registry.declarations` reads them from the source, so
that a table of titles loads neither torch nor Open3D. Names stand in paths of results and never
change.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, TypeVar

T = TypeVar("T")
# Reference methods that one job answers by; see :class:`ReferenceMethod`.
Group = Literal["images", "structure", "adjusted", "coordinates"]


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A declared method.

    Attributes:
        name: Name in configurations and paths; lower-case letters and digits.
        title: Name in tables and figures.
        rank: Place in tables and figures; those that are declared elsewhere come last.
        place: Place of the class or function, ``module:name``; filled in by the registry.
        room: Package whose modules may declare methods of the kind.
        entry_points: Group of entry points by which other packages name modules that do.
        names: Pattern of their names, and what it allows in words.
    """

    room: ClassVar[str]
    entry_points: ClassVar[str] = "synfeal.methods"
    names: ClassVar[tuple[str, str]] = (
        "[a-z][a-z0-9-]*",
        "lower-case letters, digits and -",
    )
    name: str
    title: str
    rank: int = 1000
    place: str = ""

    def __call__(self, declared: T) -> T:
        """Attach the declaration to a class or function, as its attribute ``kind``."""
        place = f"{declared.__module__}:{declared.__qualname__}"  # type: ignore[attr-defined]
        declared.kind = replace(self, place=place)  # type: ignore[attr-defined]
        return declared


@dataclass(frozen=True, kw_only=True)
class LocalizerKind(Kind):
    """A localizer: a class, built from ``NetworkConfig`` and its hyper-parameters.

    Attributes:
        halve_every: With ``protocol: published``, epochs after which the learning rate is halved,
            and epochs of a training run.
        backbone: Its backbone where it is not the configured Inception network.
        hyper: Model of its hyper-parameters, ``module:name``, a subclass of ``LocalizerConfig``.
            It is imported whenever a configuration is read, so its module should not import torch.
        style: Line in figures: ``color``, ``marker`` and ``linestyle`` of Matplotlib.
    """

    room: ClassVar[str] = "baselines.localizers"
    halve_every: tuple[int, int]
    backbone: Literal["resnet34"] | None = None
    hyper: str = "baselines.config.learning:LocalizerConfig"
    style: Mapping[str, Any] | None = None


@dataclass(frozen=True, kw_only=True)
class LabelMethod(Kind):
    """A method that re-estimates labels, batch by batch.

    Attributes:
        works_on: Its input, which decides the rule that runs it and what it is called with:
            ``frames``: ``(color_paths, depth_paths, camera, settings, seed)``;
            ``graph``: ``(graph, cfg)``, the pose graph of RGB-D odometry and ``PoseGraphConfig``;
            ``rule``: a rule of its own, named like the method.
        settings: Key below ``estimation`` whose settings a method on frames is given.
        unused: Times among the facts of its stages that it would not have spent.
        published_assisted: Batches in which section 4.1 says that it needed assistance.
    """

    room: ClassVar[str] = "baselines.labels"
    works_on: Literal["frames", "graph", "rule"]
    settings: str = ""
    unused: tuple[str, ...] = ()
    published_assisted: int | None = None


@dataclass(frozen=True, kw_only=True)
class LabelError(Kind):
    """An error put into true poses: a function ``(table, train, noise_m, noise_deg, rng)``.

    Attributes:
        of_space: It belongs to space: both splits have the same one, drawn by the same seed.
        turns: It turns cameras, too; without it ``noise_deg`` must be 0.
    """

    room: ClassVar[str] = "baselines.labels"
    of_space: bool = False
    turns: bool = True


@dataclass(frozen=True, kw_only=True)
class ReferenceMethod(Kind):
    """A reference method: a function from ``Evidence`` to poses (N, 4, 4), NaN where it has none.

    Attributes:
        group: Methods that one job answers by. ``images`` looks at the frames that localizers see,
            of every data set; ``structure`` at frames with depth, where some label set of the data
            set is estimated from them. ``adjusted`` and ``coordinates`` do, too, for label sets of
            the paper alone, the latter for the true ones and the noisiest: they take longer.
        query: Work on a test frame that is done before, once for all label sets, and that an answer
            has to wait for: ``thumbnail`` or ``vlad`` (its descriptor), ``features``, ``matches``
            (retrieval and matching), ``views``.
    """

    room: ClassVar[str] = "baselines.references"
    group: Group
    query: tuple[str, ...] = ()
