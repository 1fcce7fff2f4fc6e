"""A mesh looked at: what is found out once and used by text, picture and page."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from synfeal.config.models import SceneConfig
from synfeal.inspect.assume import load_as_meant
from synfeal.inspect.freespace import FreeSpace, survey, viewpoint
from synfeal.inspect.suggest import Suggestion, suggest
from synfeal.inspect.surface import SurfacePoints
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.planning.plan import sampling_box_of
from synfeal.seeds import generator_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Inspection:
    """What is known of a mesh.

    Attributes:
        scene: path, axis and unit as they were taken.
        mesh: the mesh.
        assumed: sentences about what the file did not say.
        surface: points spread over the mesh.
        caster: rays against it.
        box_m: (2, 3) the box that was searched.
        space: its free space.
        suggestion: a sampling box that works, if one was found.
    """

    scene: SceneConfig
    mesh: TexturedMesh
    assumed: tuple[str, ...]
    surface: SurfacePoints
    caster: RayCaster
    box_m: Array
    space: FreeSpace
    suggestion: Suggestion | None

    @classmethod
    def of(cls, scene: SceneConfig, unit_is_given: bool) -> Self:
        """Load and look at a mesh; see :func:`synfeal.inspect.run.inspect_mesh`."""
        scene, mesh, assumed = load_as_meant(scene, unit_is_given)
        box_m = sampling_box_of(scene, mesh.bounds_m, str(scene.path))
        surface = SurfacePoints.of(mesh, generator_of(0, "inspect"))
        caster = RayCaster(*mesh.merged())
        found = survey(caster, surface.position_m, box_m)
        space, suggestion = suggest(caster, found, scene)
        return cls(scene, mesh, tuple(assumed), surface, caster, box_m, space, suggestion)

    @property
    def suggested_m(self) -> Array | None:
        """The suggested box (2, 3)."""
        return None if self.suggestion is None else self.suggestion.box_m

    @property
    def viewpoint_m(self) -> Array:
        """Where the pictures are taken from, (3,): in the free space if there is any."""
        found_m = viewpoint(self.space, self.suggested_m)
        return self.mesh.bounds_m.mean(axis=0) if found_m is None else found_m
