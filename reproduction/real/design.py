"""Design of the profile ``real``: scans of parts of a scene, localizers and maps of each."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

from baselines.config.learning import ModelName
from reproduction.real.config import RealConfig, Tried
from reproduction.real.split import directions_of, split_frames

PHOTOGRAPHS, RENDERED, RANDOMISED, BOTH = "photographs", "rendered", "randomised", "both"
REFINED = "refined"
GIVEN, SFM = "given", "sfm"


@dataclass(frozen=True)
class Part:
    """Photographs that are scanned, others that are localized, and labels of both.

    Attributes:
        direction: Which photographs are which, see :mod:`reproduction.real.split`.
        labels: ``given`` with the sequence, or ``sfm``.
        photographs: How many are scanned, evenly spread; None for all.
    """

    direction: str
    labels: str = GIVEN
    photographs: int | None = None

    @property
    def name(self) -> str:
        """Name of its folder."""
        if self.photographs is not None:
            return f"{self.direction}-{self.photographs}"
        return self.direction if self.labels == GIVEN else f"{self.direction}-{self.labels}"


@dataclass(frozen=True)
class RealRun:
    """A localizer, trained once.

    Attributes:
        part: Whose photographs or renderings it is trained on.
        row: What it is shown.
        localizer: Which of the five.
        seed: Number of the repetition.
        frames: Rendered frames that it is shown; None for all.
    """

    part: Part
    row: str
    localizer: ModelName
    seed: int
    frames: int | None = None

    @property
    def directory(self) -> str:
        """Folder of the run, below that of all results."""
        shown = self.row if self.frames is None else f"{self.row}-{self.frames}"
        return f"{self.part.name}/runs/{shown}/{self.localizer}/seed{self.seed}"


@dataclass(frozen=True)
class PlaceMap:
    """A map for localization by structure.

    Attributes:
        part: Whose photographs are localized.
        of: What the map shows, ``rendered`` frames or ``photographs``; ``refined``: poses in that
            of rendered frames, found again on the scan drawn from them.
    """

    part: Part
    of: str

    @property
    def directory(self) -> str:
        """Folder of the map, below that of all results."""
        return f"{self.part.name}/maps/{self.of}"


@dataclass(frozen=True)
class RealDesign:
    """All that is made.

    Attributes:
        main: The direction that the finding is of.
        parts: Rows of the table are of these.
        fewer: Scans of fewer photographs, for the figure.
        runs: Runs of the table.
        fewer_frames: Runs on fewer rendered frames, for the figure.
        fewer_photographs: Runs on scans of fewer photographs and on these, for the figure.
        maps: Maps of the table.
    """

    main: str
    parts: tuple[Part, ...]
    fewer: tuple[Part, ...]
    runs: tuple[RealRun, ...]
    fewer_frames: tuple[RealRun, ...]
    fewer_photographs: tuple[RealRun, ...]
    maps: tuple[PlaceMap, ...]

    @property
    def every_run(self) -> tuple[RealRun, ...]:
        """Runs of table and figures."""
        return (*self.runs, *self.fewer_frames, *self.fewer_photographs)


def design_of(config: RealConfig) -> RealDesign:
    """Work out what a configuration asks for.

    Raises:
        InputError: The folder of the scene cannot be used.
    """
    directions = [name for name in directions_of(config.sequence) if name in config.directions]
    tried: list[tuple[Part, Tried]] = [(Part(name), config.directions[name]) for name in directions]
    main = directions[0]
    if config.sfm_labels:
        tried.append((Part(main, SFM), config.labels))
    fewer = tuple(Part(main, GIVEN, count) for count in config.curve_photographs)
    design = RealDesign(
        main=main,
        parts=tuple(part for part, _ in tried),
        fewer=fewer,
        runs=tuple(run for part, asked in tried for run in _runs(part, asked, config.seeds)),
        fewer_frames=tuple(
            RealRun(Part(main), RANDOMISED, "posenet2", 0, count) for count in config.curve_frames
        ),
        fewer_photographs=tuple(
            RealRun(part, row, "posenet2", 0)
            for part in fewer
            for row in (PHOTOGRAPHS, RANDOMISED)
            # All photographs are a row of the table.
            if row == RANDOMISED or not _is_all(part, config)
        ),
        maps=tuple(PlaceMap(part, of) for part, asked in tried for of in asked.maps),
    )
    return _only_there(design, config.results) if config.only_there else design


def _only_there(design: RealDesign, results: Path) -> RealDesign:
    """Leave out runs and maps that have no poses, and parts without any."""

    def there(made: RealRun | PlaceMap) -> bool:
        return (results / made.directory / "poses.csv").is_file()

    runs = tuple(filter(there, design.runs))
    maps = tuple(filter(there, design.maps))
    fewer_photographs = tuple(filter(there, design.fewer_photographs))
    of_runs = {run.part for run in runs} | {place.part for place in maps}
    of_fewer = {run.part for run in fewer_photographs}
    return replace(
        design,
        parts=tuple(part for part in design.parts if part in of_runs),
        fewer=tuple(part for part in design.fewer if part in of_fewer),
        runs=runs,
        fewer_frames=tuple(filter(there, design.fewer_frames)),
        fewer_photographs=fewer_photographs,
        maps=maps,
    )


def _runs(part: Part, asked: Tried, seeds: int) -> list[RealRun]:
    rows = product(range(seeds), asked.trained_on, asked.localizers)
    return [RealRun(part, row, localizer, seed) for seed, row, localizer in rows]


def _is_all(part: Part, config: RealConfig) -> bool:
    train, _ = split_frames(config.sequence, part.direction)
    return part.photographs is not None and part.photographs >= len(train)


def folder(config: RealConfig, part: Part) -> Path:
    """Return the folder of the files of a part."""
    return config.results / part.name
