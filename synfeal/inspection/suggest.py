"""Suggestion of a ``synfeal collect`` command, planned and looked at without writing anything.

What is suggested has been tried: paths were planned in its boxes as ``synfeal collect`` plans them,
rays counted what of the images would be empty, and some of the images were drawn.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from synfeal.config.collect import SCENE, TEST_PATHS, CollectConfig, checked
from synfeal.config.collection import Box, CollectionConfig, SceneConfig
from synfeal.config.dataset import CameraConfig, RenderConfig, Shade
from synfeal.config.flags import as_options, flag_of
from synfeal.dataset.images import is_of_one_color
from synfeal.dataset.pose_table import PoseTable
from synfeal.dataset.sevenscenes import Split
from synfeal.errors import InputError
from synfeal.inspection.boxes import share_inside, suggest_boxes
from synfeal.inspection.freespace import SLACK, FreeSpace, Survey, find_free_spaces, together
from synfeal.mesh.ambient import with_ambient_light
from synfeal.mesh.clearance import Clearance
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.planning.coverage import MOSTLY, empty_shares
from synfeal.planning.plan import box_array, plan_split
from synfeal.records.provenance import generator_of
from synfeal.render import open_renderer

Array = NDArray[np.float64]

COUNTS: dict[Split, int] = {"train": 300, "test": 60}
SPACING_M = 0.1  # so that as many frames show all of a place
SLACKS = (SLACK, 2 * SLACK, 1.0)  # the last leaves out only what is outside
NARROW_M = 0.6  # least path and view in a space too narrow for the defaults
CLEARANCES_M = (0.2, 0.0)
MIN_SEEN = (None, 0.7, 0.9, 0.97)
MAX_EMPTY = 0.1  # share of the pixels: more than windows let through
MAX_MOSTLY_EMPTY = 0.1  # share of the frames; validate refuses a quarter
ENOUGH_BOXES = 0.75  # share of the boxes' space in which paths were found
TRIAL_FRAMES, TRIAL_TRIES = 30, 300  # to tell whether there are paths in a box
N_LOOKED_AT = 80  # frames that are drawn
LOOK_CAMERA = CameraConfig(width=160, height=120)
MAX_PLAIN = 0.5  # share of the surface
MAX_OF_ONE_COLOR = 0.02  # share of the frames; validate refuses a twentieth


@dataclass(frozen=True)
class Emptiness:
    """Shares of the images that would show nothing.

    Attributes:
        share: Share of all pixels.
        mostly_empty_frames: Share of the frames of which more than half is empty.
    """

    share: float
    mostly_empty_frames: float

    @property
    def is_little(self) -> bool:
        """Check whether a data set may show this much of nothing."""
        return self.share <= MAX_EMPTY and self.mostly_empty_frames <= MAX_MOSTLY_EMPTY


@dataclass(frozen=True)
class Suggestion:
    """A planned collection, and its outcome.

    Attributes:
        scene: With the boxes that cameras may be in, and what is asked of poses.
        collection: How the camera moves.
        shade: Light that the frames need, if any.
        empty: What of the images would show nothing.
        one_color: Share of the frames that would be of one colour.
        covered: Share of the places for cameras that the boxes hold.
        world_from_cam: Poses (N, 4, 4) of the frames, training and test.
    """

    scene: SceneConfig
    collection: CollectionConfig
    empty: Emptiness
    covered: float
    world_from_cam: Array
    shade: Shade | None = None
    one_color: float = 0.0

    @property
    def boxes_m(self) -> Array:
        """Return the sampling boxes (B, 2, 3), the largest first."""
        assert self.scene.sampling_box is not None
        boxes = (self.scene.sampling_box, *self.scene.further_boxes)
        return np.stack([box_array(box) for box in boxes])

    @property
    def is_narrow(self) -> bool:
        """Check whether the defaults would leave out much, or all, of the space."""
        return self.collection.min_path_m == NARROW_M

    def command(self, out: str) -> str:
        """Return the complete line that collects what was planned, ready for a shell."""
        settings = self.settings
        mesh, *options = as_options(settings)[1:]  # an argument without its flag
        return shlex.join(["synfeal", "collect", mesh, *options, flag_of("out"), out])

    @property
    def settings(self) -> CollectConfig:
        """Settings of the collection that was planned; those that are the default are not given."""
        scene, movement = self.scene, self.collection
        chosen: dict[str, Any] = {
            "mesh": scene.path,
            "up_axis": scene.up_axis,
            "unit_m": scene.unit_m,
            "box": [tuple(float(f"{m:z.2f}") for m in box.T.ravel()) for box in self.boxes_m],
            "min_path_m": movement.min_path_m,
            "min_view_distance_m": scene.min_view_distance_m,
            "min_clearance_m": scene.min_clearance_m or None,
            "min_seen": scene.min_seen or None,
            "shade": self.shade,
            "spacing_m": movement.frame_spacing_m,
            "frames": COUNTS["train"],
            "test_frames": COUNTS["test"],
            "depth": True,
        }
        return checked(CollectConfig, chosen)


def suggest(
    mesh: TexturedMesh,
    caster: RayCaster,
    searched: RayCaster,
    found: Survey,
    scene: SceneConfig,
    plain: float,
) -> tuple[FreeSpace, Suggestion | None]:
    """Find the free space of a mesh and a collection in it whose images show something.

    Args:
        mesh: World frame.
        caster: Rays against it.
        searched: Rays against what of it counts as in the way between places.
        found: What rays tell of points in it.
        scene: Its settings; boxes, and what is asked of poses, are replaced.
        plain: Share of its surface that has one plain colour, or no colour.

    Returns:
        The free space, and a collection in it; None if no path was found. What is only just inside
        is considered where nothing better is.
    """
    places = [_Places.of(find_free_spaces(searched, found, slack)) for slack in SLACKS]
    for some in (places[:-1], places[-1:]):
        best = _best_covering(_attempts(mesh, caster, scene, some))
        if best is not None:
            return best[0], lit(mesh, best[1], plain)
    return places[0].space, None


def _best_covering(
    attempts: Iterator[tuple[_Planner, _Places]],
) -> tuple[FreeSpace, Suggestion] | None:
    """Take the first attempt with paths in most of its boxes, else the one that covers most."""
    best: tuple[FreeSpace, Suggestion] | None = None
    for planner, where in attempts:
        suggestion = planner.suggestion(where)
        if suggestion is None or (best and suggestion.covered <= best[1].covered):
            continue
        best = (where.space, suggestion)
        if suggestion.covered >= ENOUGH_BOXES * where.share_inside(where.boxes_m):
            break
    return best


@dataclass(frozen=True)
class _Places:
    """Places where cameras may be, as far as the mesh tells.

    Attributes:
        space: The free space.
        boxes_m: Boxes (B, 2, 3) that hold most of it at camera heights, the largest first.
        points_m: Points (N, 3) that they are to hold.
    """

    space: FreeSpace
    boxes_m: Array
    points_m: Array

    @classmethod
    def of(cls, spaces: list[FreeSpace]) -> Self:
        """Find boxes in some spaces."""
        boxes_m, points_m = suggest_boxes(spaces)
        return cls(together(spaces), boxes_m, points_m)

    def share_inside(self, boxes_m: Array) -> float:
        """Return the share of the points that some boxes hold."""
        return share_inside(self.points_m, boxes_m) if len(boxes_m) else 0.0


def _attempts(
    mesh: TexturedMesh, caster: RayCaster, scene: SceneConfig, places: Sequence[_Places]
) -> Iterator[tuple[_Planner, _Places]]:
    """Yield ways to collect, the best first, each with where it is to be tried.

    Paths of the default length come before shorter ones, the most enclosed part of the space before
    more of it, and cameras that keep off surfaces before others.
    """
    keeping = {
        clearance_m: Clearance(*mesh.merged(), clearance_m) if clearance_m else None
        for clearance_m in CLEARANCES_M
    }
    for narrow in (False, True):
        asked = {"min_path_m": NARROW_M} if narrow else {}
        collection = CollectionConfig(frame_spacing_m=SPACING_M, test_paths=TEST_PATHS, **asked)
        for where in places:
            for clearance_m, clearance in keeping.items():
                update: dict[str, object] = {"min_clearance_m": clearance_m}
                if narrow:
                    update["min_view_distance_m"] = NARROW_M
                own = scene.model_copy(update=update)
                yield _Planner(caster, own, collection, clearance), where


@dataclass(frozen=True)
class _Planner:
    """Plans as ``synfeal collect`` does, in boxes that are tried."""

    caster: RayCaster
    scene: SceneConfig
    collection: CollectionConfig
    clearance: Clearance | None

    def with_paths(self, boxes_m: Array) -> Array:
        """Return those of some boxes (B, 2, 3) in which there are paths."""
        quick = self.collection.model_copy(update={"max_tries": TRIAL_TRIES})
        trial = replace(self, collection=quick)
        plans = [trial.plan(box_m[None], "train", TRIAL_FRAMES) for box_m in boxes_m]
        kept: Array = boxes_m[np.array([plan is not None for plan in plans], dtype=np.bool_)]
        return kept

    def suggestion(self, where: _Places) -> Suggestion | None:
        """Return the collection in as many boxes as paths are found in; None where in none."""
        boxes_m = self.with_paths(where.boxes_m)
        while len(boxes_m):
            found = self._least_empty(boxes_m, where.share_inside(boxes_m))
            if found is not None:
                return found
            boxes_m = boxes_m[:-1]  # long walks may end in a dead end where short ones did not
        return None

    def _least_empty(self, boxes_m: Array, covered: float) -> Suggestion | None:
        """Ask that poses see as much of the mesh as is needed; None without a plan."""
        best: Suggestion | None = None
        for min_seen in MIN_SEEN:
            scene = self.scene.model_copy(update={"min_seen": min_seen})
            asking = replace(self, scene=scene)
            plans = [asking.plan(boxes_m, split, count) for split, count in COUNTS.items()]
            if any(plan is None for plan in plans):
                break
            poses = np.concatenate([plan.world_from_cam for plan in plans if plan is not None])
            empty = self.emptiness(poses)
            if best is None or empty.share < best.empty.share:
                best = Suggestion(
                    scene=with_boxes(scene, boxes_m),
                    collection=self.collection,
                    empty=empty,
                    covered=covered,
                    world_from_cam=poses,
                )
            if empty.is_little:
                break
        return best

    def emptiness(self, world_from_cam: Array) -> Emptiness:
        """Measure what of the images of poses (N, 4, 4) is empty."""
        shares = empty_shares(self.caster, world_from_cam, CameraConfig())
        return Emptiness(
            share=round(float(shares.mean()), 6),
            mostly_empty_frames=round(float(np.mean(shares > MOSTLY)), 6),
        )

    def plan(self, boxes_m: Array, split: Split, n_frames: int) -> PoseTable | None:
        """Plan a split in boxes (B, 2, 3); None where no path is found."""
        rng = generator_of(0, "plan", SCENE, split)
        try:
            return plan_split(
                caster=self.caster,
                boxes=boxes_m,
                scene=self.scene,
                collection=self.collection,
                n_frames=n_frames,
                rng=rng,
                split=split,
                clearance=self.clearance,
            )
        except InputError:
            return None


def with_boxes(scene: SceneConfig, boxes_m: Array) -> SceneConfig:
    """Return a scene with sampling boxes (B, 2, 3)."""
    first, *others = (Box(x=x, y=y, z=z) for x, y, z in boxes_m.swapaxes(1, 2).tolist())
    return scene.model_copy(update={"sampling_box": first, "further_boxes": tuple(others)})


def lit(mesh: TexturedMesh, suggestion: Suggestion, plain: float) -> Suggestion:
    """Return a suggestion with the light that its frames need to show something.

    A mesh of mostly plain colours gets ambient light, which belongs to the place, and the lamp at
    the camera only where frames would still be of one colour.

    Args:
        mesh: The mesh.
        suggestion: The suggestion without light.
        plain: Share of the mesh's surface, 0 to 1, that has plain colours.
    """
    shades: list[Shade | None] = ["ambient", "headlight"]
    if plain <= MAX_PLAIN:
        shades.insert(0, None)
    tried = []
    for shade in shades:
        share = one_color_share(mesh, suggestion.world_from_cam, shade)
        tried.append(replace(suggestion, shade=shade, one_color=share))
        if share <= MAX_OF_ONE_COLOR:
            break
    return min(tried, key=lambda each: each.one_color)


def one_color_share(mesh: TexturedMesh, poses: Array, shade: Shade | None) -> float:
    """Measure the share of frames that are of one colour, by drawing some of them, small.

    Args:
        mesh: The mesh.
        poses: Poses (N, 4, 4); at most ``N_LOOKED_AT`` are drawn, spread evenly.
        shade: Light to draw them in; None for colours as they are.
    """
    shown = with_ambient_light(mesh) if shade == "ambient" else mesh
    index = np.linspace(0, len(poses) - 1, min(N_LOOKED_AT, len(poses))).round().astype(int)
    with open_renderer(shown, LOOK_CAMERA, RenderConfig(shade=shade)) as renderer:
        return float(np.mean([is_of_one_color(renderer.render(pose)) for pose in poses[index]]))
