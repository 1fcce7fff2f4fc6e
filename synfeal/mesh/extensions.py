"""Which compressed forms a glTF holds without the plain form beside them."""

from __future__ import annotations

from synfeal.mesh.gltf import Json, base_color

MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
DRACO, BASISU = "KHR_draco_mesh_compression", "KHR_texture_basisu"


def stand_alone(header: Json) -> list[str]:
    """Extensions without which something that is drawn cannot be read."""
    found = (check(header) for check in (_draco_alone, _meshopt_alone, _basisu_alone))
    return [name for name in found if name is not None]


def listed(header: Json, key: str) -> list[Json]:
    """What stands under a key, if anything."""
    found: list[Json] = header.get(key, [])
    return found


def primitives_of(header: Json) -> list[Json]:
    """The primitives of all meshes."""
    return [primitive for mesh in listed(header, "meshes") for primitive in mesh["primitives"]]


def _draco_alone(header: Json) -> str | None:
    """Draco, if a primitive has no plain positions beside it."""
    for primitive in primitives_of(header):
        positions = header["accessors"][primitive["attributes"]["POSITION"]]
        if DRACO in primitive.get("extensions", {}) and "bufferView" not in positions:
            return DRACO
    return None


def _meshopt_alone(header: Json) -> str | None:
    """Meshopt, if a compressed view points to a buffer that is only a placeholder."""
    for name in MESHOPT:
        for view in listed(header, "bufferViews"):
            buffer = header["buffers"][view["buffer"]]
            is_placeholder = "uri" not in buffer and name in buffer.get("extensions", {})
            if name in view.get("extensions", {}) and is_placeholder:
                return name
    return None


def _basisu_alone(header: Json) -> str | None:
    """KTX2, if a base colour has no other image."""
    for material in listed(header, "materials"):
        slot = base_color(material).get("baseColorTexture")
        texture = {} if slot is None else header["textures"][slot["index"]]
        others = "source" in texture or "EXT_texture_webp" in texture.get("extensions", {})
        if BASISU in texture.get("extensions", {}) and not others:
            return BASISU
    return None
