"""Writing a scene as one self-contained GLB file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from synfeal.errors import InputError
from synfeal.mesh.gltf import CLAMP_TO_EDGE, REPEAT
from synfeal.mesh.load import WORLD_FROM_Y_UP
from synfeal.mesh.materials import SRGB_ATTRIBUTE, linear_from_srgb
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.records.files import atomic_path

FLOAT32_BITS = 24  # bits of the mantissa


def _png(pixels: NDArray[np.uint8]) -> Image.Image:
    """Make an image that trimesh stores as PNG with the fastest compression.

    A 4096 x 4096 texture takes 0.9 s instead of 3.8 s and is a quarter larger.
    """
    image = Image.fromarray(pixels)
    image.save = partial(image.save, compress_level=1)  # type: ignore[method-assign]
    return image


def save_glb(path: Path, mesh: TexturedMesh, extras: Mapping[str, Any] | None = None) -> None:
    """Write ``mesh`` as binary glTF: y-up, metres, textures inside as PNG (lossless).

    ``load_mesh(path)`` gives the same parts back, with colours exact and coordinates to about
    1e-7 of the mesh's extents; saving those again changes nothing.

    Args:
        path: File to write.
        mesh: The mesh.
        extras: Further values to keep in the file, ready for JSON; see
            :func:`synfeal.mesh.gltf.glb_extras`.

    Raises:
        InputError: ``path`` does not end in ``.glb``.
    """
    path = Path(path)
    if path.suffix.lower() != ".glb":
        raise InputError(path, "a scene is saved as binary glTF; the name must end in .glb")
    scene = trimesh.Scene()
    materials = _Materials()
    origin_m, step_m = storage_grid(mesh.bounds_m)
    for index, part in enumerate(mesh.parts):
        vertices = np.round(part.vertices_m / step_m) * step_m - origin_m
        # The index keeps the order and makes names unique; it is cut off again on loading.
        scene.add_geometry(
            _geometry(part, vertices, materials.of(part)),
            geom_name=f"{index:04d}:{part.name}",
            transform=trimesh.transformations.translation_matrix(WORLD_FROM_Y_UP.T @ origin_m),
        )

    def complete(tree: dict[str, Any]) -> None:
        materials.complete(tree)
        if extras:
            tree["asset"]["extras"] = dict(extras)

    with atomic_path(path) as temporary:
        exported = scene.export(file_type="glb", tree_postprocessor=complete)
        temporary.write_bytes(exported)


def storage_grid(bounds_m: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Choose the origin (3,) of the stored coordinates, and the grid they are rounded to.

    Coordinates are stored as float32, which is worth 6 cm a thousand kilometres from the origin.
    So a mesh is stored around its own centre, in nodes that move it there in float64. Coordinates
    and centre are rounded to a grid of which float32 holds every point between them exactly:
    reading and saving again is then without loss, wherever the next centre comes to lie.
    """
    largest_m = float(np.max(bounds_m[1] - bounds_m[0])) or 1.0
    step_m = 2.0 ** (math.ceil(math.log2(largest_m)) - FLOAT32_BITS)
    return np.round(bounds_m.mean(axis=0) / step_m) * step_m, step_m


class _Look(NamedTuple):
    """Properties that parts which look alike have in common."""

    texture: int
    base_color: bytes
    alpha_cutoff: float | None
    clamped_uv: tuple[bool, bool]


class _Materials:
    """The glTF materials of a mesh: one for all parts that look alike, with exact base colours."""

    def __init__(self) -> None:
        self._made: dict[_Look, PBRMaterial] = {}

    def of(self, part: MeshPart) -> PBRMaterial:
        """Return the material of a part."""
        base_color = part.base_color.tobytes()
        key = _Look(id(part.texture), base_color, part.alpha_cutoff, part.clamped_uv)
        if key not in self._made:
            self._made[key] = PBRMaterial(
                name=f"{len(self._made)}:{part.name}",
                baseColorTexture=None if part.texture is None else _png(part.texture),
                metallicFactor=0.0,
                roughnessFactor=1.0,
                doubleSided=True,
                alphaMode="OPAQUE" if part.alpha_cutoff is None else "MASK",
                alphaCutoff=part.alpha_cutoff,
            )
        return self._made[key]

    def complete(self, tree: dict[str, Any]) -> None:
        """Give the materials of an exported glTF what trimesh does not write.

        That is base colours, which it keeps in 8 linear bits, and samplers.
        """
        looks = list(self._made)
        for material in tree.get("materials", []):
            index, _, name = material["name"].partition(":")
            look = looks[int(index)]
            color = material.setdefault("pbrMetallicRoughness", {})
            base_color = np.frombuffer(look.base_color, np.uint8)
            color["baseColorFactor"] = linear_from_srgb(base_color).tolist()
            material["name"] = name
            if any(look.clamped_uv) and "baseColorTexture" in color:
                slot = color["baseColorTexture"]
                modes = [CLAMP_TO_EDGE if is_clamped else REPEAT for is_clamped in look.clamped_uv]
                samplers = tree.setdefault("samplers", [])
                texture = dict(tree["textures"][slot["index"]], sampler=len(samplers))
                samplers.append(dict(zip(("wrapS", "wrapT"), modes, strict=True)))
                color["baseColorTexture"] = {**slot, "index": len(tree["textures"])}
                tree["textures"].append(texture)


def _geometry(
    part: MeshPart, vertices: NDArray[np.float64], material: PBRMaterial
) -> trimesh.Trimesh:
    """Convert one part with ``vertices`` (V, 3) in world axes to trimesh geometry in glTF axes."""
    uv = np.zeros((len(vertices), 2)) if part.uv is None else part.uv
    geometry = trimesh.Trimesh(
        vertices=vertices @ WORLD_FROM_Y_UP,
        faces=part.faces,
        visual=TextureVisuals(uv=uv, material=material),
        process=False,
    )
    if part.vertex_rgb is not None:
        rgba = np.insert(part.vertex_rgb, 3, 255, axis=1)
        linear = np.round(255.0 * linear_from_srgb(rgba)).astype(np.uint8)
        geometry.visual.vertex_attributes["color"] = linear  # what other programs read
        geometry.vertex_attributes[SRGB_ATTRIBUTE] = rgba
    return geometry
