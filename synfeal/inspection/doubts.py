"""Doubts about a mesh: unit, up axis and other things that look wrong."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Self, cast

import numpy as np
from numpy.typing import NDArray

from synfeal.config.collection import SceneConfig
from synfeal.inspection.freespace import FreeSpace, survey, viewpoint
from synfeal.inspection.pieces import without_small_pieces
from synfeal.inspection.suggest import MAX_OF_ONE_COLOR, MAX_PLAIN, Suggestion, suggest
from synfeal.inspection.surface import SurfacePoints, area_by_color, triangle_areas_m2
from synfeal.mesh.checks import shows_one_color
from synfeal.mesh.load import is_y_up, load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.planning.plan import sampling_box_of
from synfeal.records.provenance import generator_of

Array = NDArray[np.float64]

EXTENTS_M = (1.0, 200.0)
UNITS_M = {0.001: "millimetres", 0.01: "centimetres", 0.0254: "inches", 10.0: "", 100.0: ""}
UNITS_M |= {1000.0: "kilometres"}
LEAST_ROOM_HEIGHT_M = 1.5  # what is flatter in a unit is no room in it
ALIGNED_COS = np.cos(np.deg2rad(15.0))
FLOOR_BIN_M = 0.1
FLOOR_RATIO = 1.5
MIN_ENCLOSURE = 0.9
MIN_COVERED = 0.6
MAX_ELSEWHERE = 0.1


def doubts_of(
    extents_m: Array, floors_m2: Array, space: FreeSpace, unit_m: float = 1.0
) -> list[str]:
    """Say in sentences what looks wrong, each with what to try; empty if nothing does.

    Args:
        extents_m: Size (3,) of the mesh as it was taken.
        floors_m2: What :func:`floor_areas_m2` found (3,) along x, y and z.
        space: Its free space.
        unit_m: Unit of the file as it was taken.
    """
    longest_m, axis = float(extents_m.max()), int(floors_m2.argmax())
    turn = "try the other `up_axis`" if axis == 1 else "turn the mesh before exporting it"
    can_stand = space.floor_m is not None
    return _that_hold(
        (
            not EXTENTS_M[0] <= longest_m <= EXTENTS_M[1],
            f"the mesh is {longest_m:.3g} m long: {_unit_advice(extents_m, unit_m)}",
        ),
        (
            axis != 2 and floors_m2[axis] >= FLOOR_RATIO * floors_m2[2],
            f"the up axis is probably wrong (a floor of {floors_m2[axis]:.3g} m^2 if {'xyz'[axis]}"
            f" were up, {floors_m2[2]:.3g} m^2 now); {turn}",
        ),
        (
            not can_stand,
            "no place to stand with walls around it was found, so no box is suggested: check unit"
            " and up axis, or give `box` where cameras shall go",
        ),
        (
            can_stand and space.enclosure < MIN_ENCLOSURE,
            f"the mesh is open: from half of its free points, more than {1 - space.enclosure:.0%}"
            " of the level and upward rays leave it; images will show its background",
        ),
        (
            can_stand and space.elsewhere > MAX_ELSEWHERE,
            f"{space.elsewhere:.0%} of the places to stand are in small rooms or nooks, which the"
            " suggested boxes leave out",
        ),
    )


def units_of_a_room(extents: Array) -> list[float]:
    """List the usual units, in metres, in which a mesh is as large as a room.

    Args:
        extents: Size (3,) of the mesh in units of its file.
    """
    low_m, high_m = EXTENTS_M
    longest, shortest = float(extents.max()), float(extents.min())
    return [
        unit_m
        for unit_m in sorted({1.0, *UNITS_M})
        if low_m <= longest * unit_m <= high_m
        # Terrain is long and flat: small enough in inches, it would be lower than a table.
        and (unit_m >= 1.0 or shortest * unit_m >= LEAST_ROOM_HEIGHT_M)
    ]


def _unit_advice(extents_m: Array, unit_m: float) -> str:
    """Say what to do about a mesh that is too long or too short in this unit."""
    units = [f"{unit:g}" for unit in units_of_a_room(extents_m / unit_m)]
    if units:
        named = " or ".join([", ".join(units[:-1]), units[-1]] if units[1:] else units)
        return f"the unit is probably wrong; try `unit_m` {named}"
    if extents_m.max() > EXTENTS_M[1]:
        return (
            "in no usual unit is that a room. If it is terrain or a town, all is well, but for"
            " depth, which is stored up to 65.5 m unless collect gets `depth_scale`; else remove"
            " what lies far away from the rest"
        )
    return "in no usual unit is that a room; measure it, and give `unit_m`"


def _that_hold(*doubts: tuple[bool, str]) -> list[str]:
    return [sentence for holds, sentence in doubts if holds]


def color_doubts(mesh: TexturedMesh, area_m2: dict[str, float]) -> list[str]:
    """Return doubts that there is anything to see.

    Args:
        mesh: World frame.
        area_m2: Its surface by what colours it.
    """
    plain, of_one = plain_share(area_m2), shows_one_color(mesh)
    light = "; the command below lights it (`shade`), which shows its shape"
    return _that_hold(
        (
            of_one,
            "the mesh is of one colour; if it should have a texture, put its files (of an OBJ also"
            f" the .mtl) where it names them{light}",
        ),
        (
            not of_one and plain > MAX_PLAIN,
            f"{plain:.0%} of the surface has one plain colour: little to localize by{light}",
        ),
    )


def plain_share(area_m2: dict[str, float]) -> float:
    """Return the share of a surface, given by what colours it, that has plain colours."""
    return area_m2["plain"] / max(sum(area_m2.values()), 1e-12)


def suggestion_doubts(suggestion: Suggestion) -> list[str]:
    """Return doubts about the data set that the suggested command makes."""
    empty, scene = suggestion.empty, suggestion.scene
    asked = f", although `min_seen={scene.min_seen:g}` refuses the worst" if scene.min_seen else ""
    return _that_hold(
        (
            suggestion.is_narrow,
            "the free space is too narrow for the default paths; the command below allows shorter"
            " ones (`min_path_m`) and nearer views (`min_view_distance_m`)",
        ),
        (
            suggestion.covered < MIN_COVERED,
            f"the suggested boxes hold {suggestion.covered:.0%} of the places for cameras; the rest"
            " is too narrow or too scattered for paths",
        ),
        (
            not empty.is_little,
            f"{empty.share:.0%} of the pixels that the command below makes will be empty, and"
            f" {empty.mostly_empty_frames:.0%} of its frames more than half: cameras look out where"
            f" the mesh is open{asked}",
        ),
        (
            suggestion.one_color > MAX_OF_ONE_COLOR,
            f"{suggestion.one_color:.0%} of its frames will be of one colour: there is little to"
            " see on these walls",
        ),
    )


def pieces_doubts(left_out: float) -> list[str]:
    """Return the doubt about small pieces.

    Args:
        left_out: Share of the faces of a mesh that are in pieces left out of the search.
    """
    return _that_hold(
        (
            left_out > 0.0,
            f"a place for cameras was found only without the small pieces that lie apart from the"
            f" rest, {left_out:.0%} of the faces: frames will show them; if they are dust or what a"
            " scanner saw through windows, remove them (in MeshLab: Remove Isolated Pieces)",
        ),
    )


def floor_areas_m2(normal: Array, position_m: Array, area_m2: float) -> Array:
    """Estimate the area of the largest floor if x, y or z pointed up.

    A floor is surface within 15 degrees of perpendicular to the axis, within 10 cm along it, in the
    lower half of the mesh.

    Args:
        normal: Unit normals (N, 3) of points spread evenly over the mesh.
        position_m: Positions (N, 3) of these points, metres.
        area_m2: Area of the whole mesh, square metres.

    Returns:
        Areas (3,) for x, y and z, square metres.
    """
    middle_m = (position_m.min(axis=0) + position_m.max(axis=0)) / 2.0
    areas = np.zeros(3)
    for axis in range(3):
        along = np.abs(normal[:, axis]) >= ALIGNED_COS
        heights = position_m[along & (position_m[:, axis] <= middle_m[axis]), axis]
        if len(heights):
            _, counts = np.unique(np.floor(heights / FLOOR_BIN_M), return_counts=True)
            areas[axis] = counts.max() * area_m2 / len(position_m)
    return areas


STOREY_M = 3.0  # rooms are about that high, and longer along the other axes
N_POINTS = 20_000


def load_as_meant(
    scene: SceneConfig, unit_is_given: bool
) -> tuple[SceneConfig, TexturedMesh, list[str]]:
    """Load the mesh in the unit and with the up axis that make a room of it.

    Nothing is changed that the person said, nor while the mesh makes sense as it is.

    Args:
        scene: Path, unit and up axis as they were given.
        unit_is_given: Whether the person gave the unit, which is then kept.

    Returns:
        The scene as it was taken, the mesh, and a sentence for each thing that was assumed.
    """
    mesh, notes = _load(scene), []
    main = mesh
    if not _is_of_a_size(mesh):
        rest = without_small_pieces(mesh)
        main = rest if _is_of_a_size(rest) else mesh
    extents_m = np.ptp(main.bounds_m, axis=0)
    is_odd = not _is_of_a_size(main)
    units = units_of_a_room(extents_m / scene.unit_m)
    if is_odd and units and not unit_is_given:
        # What makes the smallest extent most like the height of a room.
        height = max(extents_m.min(), 1e-9) / STOREY_M
        unit_m = min(units, key=lambda unit: abs(np.log(unit * height)))
        scene = scene.model_copy(update={"unit_m": unit_m})
        main = mesh = _load(scene)
        before, after = (" x ".join(f"{m:.3g}" for m in k * extents_m) for k in (1.0, unit_m))
        notes.append(
            f"the mesh spans {before}, which no room does in metres; taken as"
            f" {UNITS_M[unit_m] or f'units of {unit_m:g} m'} (`unit_m={unit_m:g}`), which makes it"
            f" {after} m; if that is wrong, give `unit_m`"
        )
    if scene.up_axis == "auto":
        points = SurfacePoints.of(main, np.random.default_rng(0), N_POINTS)
        area_m2 = sum(float(triangle_areas_m2(part).sum()) for part in main.parts)
        floors_m2 = floor_areas_m2(points.normal, points.position_m, area_m2)
        if floors_m2.argmax() == 1 and floors_m2[1] >= FLOOR_RATIO * floors_m2[2]:
            other = "z" if is_y_up(cast(Path, scene.path), "auto") else "y"
            scene = scene.model_copy(update={"up_axis": other})
            mesh = _load(scene)
            notes.append(
                f"taken with {other} up, where its largest floor is {floors_m2[1]:.3g} m^2 and not"
                f" {floors_m2[2]:.3g} m^2; if that is wrong, give `up_axis`"
            )
    return scene, mesh, notes


def _is_of_a_size(mesh: TexturedMesh) -> bool:
    """Tell whether a mesh is neither too long nor too short for a room or what rooms are in."""
    longest_m = float(np.ptp(mesh.bounds_m, axis=0).max())
    return EXTENTS_M[0] <= longest_m <= EXTENTS_M[1]


def _load(scene: SceneConfig) -> TexturedMesh:
    assert scene.path is not None
    return load_mesh(scene.path, scene.up_axis, scene.unit_m)


@dataclass(frozen=True)
class Inspection:
    """Findings about a mesh."""

    scene: SceneConfig  # path, axis and unit as they were taken
    mesh: TexturedMesh
    assumed: tuple[str, ...]  # sentences about what the file did not say
    searched: TexturedMesh  # the mesh, or what of it is in no small piece
    surface: SurfacePoints  # points spread over the mesh
    caster: RayCaster  # rays against it
    box_m: Array  # (2, 3) the box that was searched
    space: FreeSpace  # its free space
    suggestion: Suggestion | None  # a sampling box that works, if one was found

    @classmethod
    def of(cls, scene: SceneConfig, unit_is_given: bool) -> Self:
        """Load and look at a mesh; see :func:`synfeal.inspection.run.inspect_mesh`.

        Where no place is found, it is looked for among what of the mesh is in no small piece:
        dust fills the air, and what lies far outside makes the grid of places wide.
        """
        scene, mesh, assumed = load_as_meant(scene, unit_is_given)
        box_m = sampling_box_of(scene, mesh.bounds_m, str(scene.path))
        whole = cls._in(scene, mesh, tuple(assumed), mesh, box_m)
        if whole.suggestion is not None:
            return whole
        rest = without_small_pieces(mesh)
        if rest is mesh:
            return whole
        if scene.sampling_box is None:
            box_m = rest.bounds_m
        cleaned = cls._in(scene, mesh, tuple(assumed), rest, box_m)
        return whole if cleaned.suggestion is None else cleaned

    @classmethod
    def _in(
        cls,
        scene: SceneConfig,
        mesh: TexturedMesh,
        assumed: tuple[str, ...],
        searched: TexturedMesh,
        box_m: Array,
    ) -> Self:
        """Look for places in a box (2, 3), among what is searched of a mesh."""
        surface = SurfacePoints.of(mesh, generator_of(0, "inspect"))
        caster = RayCaster(*mesh.merged())
        near, in_the_way = surface, caster
        if searched is not mesh:
            near = SurfacePoints.of(searched, generator_of(0, "inspect"))
            in_the_way = RayCaster(*searched.merged())
        found = survey(in_the_way, near.position_m, box_m)
        plain = 1.0 if shows_one_color(mesh) else plain_share(area_by_color(mesh))
        space, suggestion = suggest(mesh, caster, in_the_way, found, scene, plain)
        return cls(
            scene=scene,
            mesh=mesh,
            assumed=assumed,
            searched=searched,
            surface=surface,
            caster=caster,
            box_m=box_m,
            space=space,
            suggestion=suggestion,
        )

    @property
    def left_out(self) -> float:
        """Share of the faces that are in small pieces and were left out of the search."""
        return 1.0 - self.searched.n_faces / self.mesh.n_faces

    @property
    def suggested_m(self) -> Array:
        """The suggested boxes (B, 2, 3), the largest first."""
        return np.empty((0, 2, 3)) if self.suggestion is None else self.suggestion.boxes_m

    @property
    def viewpoint_m(self) -> Array:
        """Place (3,) the pictures are taken from: in the free space if there is any."""
        boxes_m = self.suggested_m
        found_m = viewpoint(self.space, boxes_m[0] if len(boxes_m) else None)
        return self.searched.bounds_m.mean(axis=0) if found_m is None else found_m
