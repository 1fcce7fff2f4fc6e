"""Files that would load into something wrong are refused by name, with what to do instead."""

from __future__ import annotations

from pathlib import Path

from synfeal.errors import InputError
from synfeal.mesh.compressed import LIBRARIES
from synfeal.mesh.extensions import listed, primitives_of, stand_alone
from synfeal.mesh.gltf import Json

EXTRA = "synfeal[meshes]"
SUFFIXES = (".glb", ".gltf", ".obj", ".ply")

# Required extensions that change nothing here, or that are read.
READ = {
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
}
TRANSFORM = "with glTF-Transform (npm install --global @gltf-transform/cli):"
REMEDIES = {
    "KHR_draco_mesh_compression": f"decode it {TRANSFORM} gltf-transform copy IN OUT.glb",
    "EXT_meshopt_compression": f"decode it {TRANSFORM} gltf-transform dequantize IN OUT.glb",
    "KHR_meshopt_compression": f"decode it {TRANSFORM} gltf-transform dequantize IN OUT.glb,"
    " or export it without compression",
    "KHR_texture_basisu": f"turn its KTX2 textures into PNG {TRANSFORM}"
    " gltf-transform ktxdecompress IN OUT.glb (which needs the ktx command of KTX-Software)",
    "EXT_mesh_gpu_instancing": "export it with one node per instance",
}


def refuse_kind(path: Path) -> None:
    """Check by its name that the file is of a kind that can hold a scene with colours.

    Raises:
        InputError: an STL, or an unknown kind.
    """
    suffix = path.suffix.lower()
    if suffix == ".stl":
        raise InputError(
            f"{path}: an STL file holds shape without colour, so every image would be blank; export"
            " the scene as GLB, as OBJ with MTL and textures, or as PLY with vertex colours"
        )
    if suffix not in SUFFIXES:
        raise InputError(
            f"{path}: unknown kind of mesh '{path.suffix}'; convert it to one of"
            f" {', '.join(SUFFIXES)}"
        )


def refuse_extensions(path: Path, header: Json) -> None:
    """Check that nothing in a glTF is stored in a form that is not read.

    Compressed forms pass where the file holds the plain form too.

    Raises:
        InputError: naming the extension and how to convert the file.
    """
    for name in header.get("extensionsRequired", []):
        if name not in READ and not name.startswith("KHR_materials_"):
            raise _refusal(path, name)
    if any(
        "EXT_mesh_gpu_instancing" in node.get("extensions", {}) for node in listed(header, "nodes")
    ):
        raise _refusal(path, "EXT_mesh_gpu_instancing")
    for name in stand_alone(header):
        raise _refusal(path, name)
    if any("sparse" in accessor for accessor in _used_accessors(header)):
        raise InputError(
            f"{path}: stores vertices in sparse accessors, which are not read;"
            " export it again without morph targets or as OBJ"
        )


def _refusal(path: Path, name: str) -> InputError:
    remedy = REMEDIES.get(name, "export it without this extension")
    if name in LIBRARIES:
        remedy = f"pip install '{EXTRA}', or {remedy}"
    return InputError(f"{path}: needs the glTF extension {name}, which is not read; {remedy}")


def _used_accessors(header: Json) -> list[Json]:
    """Accessors that hold what is read: positions, triangles, colours, texture coordinates."""
    used = []
    for primitive in primitives_of(header):
        attributes = primitive["attributes"]
        used += [attributes[key] for key in attributes if key.startswith(("POS", "TEX", "COL"))]
        used += [primitive["indices"]] if "indices" in primitive else []
    return [header["accessors"][index] for index in used]
