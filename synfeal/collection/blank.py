"""What would make blank images is said before hours are spent on them, or refused."""

from __future__ import annotations

import logging
from collections.abc import Mapping

import numpy as np

from synfeal.config.models import CameraConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.dataset.sevenscenes import Split
from synfeal.errors import InputError
from synfeal.mesh.checks import shows_one_colour
from synfeal.mesh.model import TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.planning.seen_surface import empty_pixels

WARN_ABOVE = 0.1  # of all pixels: more than windows let through
REFUSE_ABOVE = 0.95  # of all pixels: nobody wants a data set of the background

log = logging.getLogger("synfeal")


def refuse_invisible(mesh: TexturedMesh, camera: CameraConfig, name: str) -> None:
    """Check that the mesh has colours and reaches beyond the near plane of a camera in it."""
    if shows_one_colour(mesh):
        raise InputError(
            f"{name}: is of one colour, and so would be every image; put its texture files (of an"
            " OBJ also the .mtl) where it names them, or export it with its texture"
        )
    diagonal_m = float(np.linalg.norm(mesh.bounds_m[1] - mesh.bounds_m[0]))
    if diagonal_m <= camera.near_m:
        raise InputError(
            f"{name}: the mesh is {diagonal_m:.3g} m across, and cameras see nothing nearer than"
            f" near_m ({camera.near_m:g} m); give the metres per unit of the file with --unit-m"
        )


def refuse_blank(
    caster: RayCaster, plans: Mapping[Split, PoseTable], camera: CameraConfig, name: str
) -> None:
    """Warn of plans whose images would show little; refuse those that would show nothing."""
    for split, plan in plans.items():
        share = empty_pixels(caster, plan, camera).share
        if share > REFUSE_ABOVE:
            size_m = " x ".join(f"{side:.3g}" for side in np.diff(caster.bounds_m, axis=0)[0])
            raise InputError(
                f"{name}: {share:.0%} of the pixels of the {split} frames would be empty: the"
                f" mesh spans {size_m} m, and cameras see nothing farther than far_m"
                f" ({camera.far_m:g} m) or outside; give --unit-m or --box"
                " (synfeal inspect suggests them)"
            )
        if share > WARN_ABOVE:
            log.warning(
                "%s: %.0f %% of the pixels of the %s frames will be empty: cameras look through"
                " holes or past the mesh; another --box may help (synfeal inspect suggests one)",
                *(name, 100 * share, split),
            )
