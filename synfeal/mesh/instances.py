"""Instance numbers of masks: parts of the mesh, and objects placed in it.

A part is a geometry of the file (a mesh of glTF, a group of OBJ) with one material. Parts are
numbered from 1 in the order of the mesh; an object, whatever it is made of, has one number after
those of all parts.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from synfeal.mesh.model import TexturedMesh

NOTHING = 0  # the number of pixels that show nothing


class Instance(NamedTuple):
    """Something that masks tell from the rest.

    Attributes:
        id: Value of its pixels, from 1.
        kind: ``part`` of the mesh, or ``object`` that was placed in it.
        name: As the file has it; of objects, the name of what was placed.
    """

    id: int
    kind: Literal["part", "object"]
    name: str


class Instances(NamedTuple):
    """The instances of a mesh.

    Attributes:
        listed: All of them, by number.
        of_parts: Number (P,) of each part of the mesh.
    """

    listed: tuple[Instance, ...]
    of_parts: NDArray[np.int32]

    def of_faces(self, mesh: TexturedMesh) -> NDArray[np.int32]:
        """Return the number (F + 1,) of each triangle of the mesh, and of nothing as the last."""
        counts = [len(part.faces) for part in mesh.parts]
        return np.append(np.repeat(self.of_parts, counts), NOTHING).astype(np.int32)


def number_instances(mesh: TexturedMesh, objects: Sequence[str] = ()) -> Instances:
    """Number the parts of a mesh and the objects in it.

    Args:
        mesh: A mesh, with the parts of objects last, named ``object-0`` and so on as
            :func:`synfeal.mesh.standing.standing` names them.
        objects: What was placed, in order.
    """
    number_of = {f"object-{number}": number for number in range(len(objects))}
    n_own = len(mesh.parts)
    while n_own and mesh.parts[n_own - 1].name in number_of:
        n_own -= 1
    own, added = mesh.parts[:n_own], mesh.parts[n_own:]
    parts = [Instance(number, "part", part.name) for number, part in enumerate(own, 1)]
    others = [Instance(number, "object", name) for number, name in enumerate(objects, n_own + 1)]
    placed = [n_own + 1 + number_of[part.name] for part in added]
    of_parts = np.array([*range(1, n_own + 1), *placed], np.int32)
    return Instances((*parts, *others), of_parts)
