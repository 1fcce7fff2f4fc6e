"""glTF and GLB containers: their JSON, checked and simplified for the parser.

trimesh parses the geometry. Of what glTF allows it silently drops or misreads a part: texture
transforms, second sets of texture coordinates, colours that are not 8-bit, exact factors. So the
JSON is read here, simplified before trimesh sees it, and kept for the materials.
"""

from __future__ import annotations

import copy
import json
import re
import struct
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from synfeal.errors import InputError, why

GLB_MAGIC = b"glTF"
JSON_CHUNK, BIN_CHUNK = b"JSON", b"BIN\0"
BIN_URI = "synfeal-glb-binary-chunk"  # the name under which a resolver is asked for the BIN chunk
DECODED_URI = "synfeal-decoded"  # the same for what was decompressed
# Numbers of its specification: how textures go on beyond 0 and 1, and what vertices make up.
CLAMP_TO_EDGE, MIRRORED_REPEAT, REPEAT = 33071, 33648, 10497
NEAREST = 9728
TRIANGLES, TRIANGLE_STRIP, TRIANGLE_FAN = 4, 5, 6
NODE_VISIBILITY = "KHR_node_visibility"
SPECULAR_GLOSSINESS = "KHR_materials_pbrSpecularGlossiness"

Json = dict[str, Any]


@dataclass(frozen=True)
class Gltf:
    """A glTF file: its JSON, the BIN chunk of a GLB (empty in a .gltf), and what was decoded."""

    header: Json
    binary: bytes = b""
    decoded: bytes = b""


def read_gltf(path: Path) -> Gltf:
    """Read the container.

    Raises:
        InputError: the file is cut short, is no glTF 2.0, or its JSON is broken.
    """
    content = path.read_bytes()
    if path.suffix.lower() == ".gltf":
        return Gltf(_parse_json(path, content))
    if content[:4] != GLB_MAGIC or len(content) < 20:
        raise InputError(path, "cannot be read as a mesh (not a GLB file, whatever its name)")
    version, size = struct.unpack_from("<II", content, 4)
    if version != 2:
        raise InputError(path, f"is glTF {version}", "convert it to glTF 2.0")
    if len(content) < size:
        raise InputError(
            path, f"ends after {len(content)} of {size} bytes", "download or export it again"
        )
    chunks: dict[bytes, bytes] = {}
    start = 12
    while start + 8 <= len(content):
        length, kind = struct.unpack_from("<I4s", content, start)
        chunks.setdefault(kind, content[start + 8 : start + 8 + length])  # the first counts
        start += 8 + length
    if JSON_CHUNK not in chunks:
        raise InputError(path, "the GLB holds no JSON", "export it again")
    return Gltf(_parse_json(path, chunks[JSON_CHUNK]), chunks.get(BIN_CHUNK, b""))


def glb_extras(path: Path) -> Json:
    """Read what a program has noted in a GLB of its own; nothing is read of the geometry.

    Returns:
        ``extras`` of the file's ``asset``; empty where it has none, or is no GLB.
    """
    if path.suffix.lower() != ".glb" or not path.is_file():
        return {}
    with path.open("rb") as file:
        begin = file.read(20)  # magic, version, size, then length and kind of the first chunk
        if len(begin) < 20 or begin[:4] != GLB_MAGIC or begin[16:] != JSON_CHUNK:
            return {}
        (length,) = struct.unpack_from("<I", begin, 12)
        text = file.read(length)
    try:
        asset = json.loads(text)["asset"]
    except (ValueError, TypeError, KeyError, RecursionError):
        return {}  # whoever reads the mesh says so
    extras = asset.get("extras") if isinstance(asset, dict) else None
    return extras if isinstance(extras, dict) else {}


def _parse_json(path: Path, text: bytes) -> Json:
    try:
        header = json.loads(text)
    except (ValueError, RecursionError) as error:  # also what is not UTF-8
        raise InputError(
            path, f"cannot be read as a mesh (its JSON is broken: {why(error)})", "export it again"
        ) from error
    if not isinstance(header, dict) or not isinstance(header.get("asset"), dict):
        raise InputError(path, "cannot be read as a mesh (its JSON is not that of a glTF)")
    version = str(header["asset"].get("version", "2.0"))
    if not version.startswith("2"):
        raise InputError(path, f"is glTF {version}", "convert it to glTF 2.0")
    try:
        _check_kinds(header, "")
    except (ValueError, RecursionError) as error:
        raise InputError(
            path, f"cannot be read as a mesh ({why(error)})", "export it again"
        ) from error
    return header


def _check_kinds(value: Json, place: str) -> None:
    """Check that mappings, lists of mappings, and names of files stand where glTF has them.

    Args:
        value: A mapping of the JSON.
        place: Its keys, each with a slash after it.

    Raises:
        ValueError: Something else stands there.
    """
    in_extensions = place.endswith("extensions/")
    for key, inner in value.items():
        if key == "extras" or (in_extensions and key not in EXTENSIONS):
            continue  # other programs put there what they like
        if (key in MAPPINGS or in_extensions) and not isinstance(inner, dict):
            raise ValueError(f"{place}{key} of its JSON must be a mapping")
        if key == "uri" and not isinstance(inner, str):
            raise ValueError(f"{place}{key} of its JSON must be text")
        are_indices = key == "nodes" and place  # those of a scene are indices
        if key in LISTS and not are_indices:
            if not isinstance(inner, list) or not all(isinstance(part, dict) for part in inner):
                raise ValueError(f"{place}{key} of its JSON must be a list of mappings")
            for index, part in enumerate(inner):
                _check_kinds(part, f"{place}{key}/{index}/")
        elif isinstance(inner, dict):
            _check_kinds(inner, f"{place}{key}/")


def simplified(gltf: Gltf) -> Json:
    """Return a copy of the JSON that trimesh reads without losing anything.

    Every primitive has a material, whose name is its index; so trimesh keeps vertex colours as they
    are stored, and materials can be looked up. Nodes are named by their index, which tells their
    order. Base colours come from one place and use the first set of texture coordinates. The BIN
    chunk has a URI.
    """
    header = copy.deepcopy(gltf.header)
    if gltf.binary and header.get("buffers"):
        header["buffers"][0].setdefault("uri", BIN_URI)
    nodes = header.get("nodes", [])
    for index in hidden_nodes(header):
        nodes[index].pop("mesh", None)
    for index, node in enumerate(nodes):
        node["name"] = f"{index:09d}"
    if not header.get("scenes"):  # then all nodes are meant
        children = {child for node in nodes for child in node.get("children", [])}
        header["scenes"] = [{"nodes": [i for i in range(len(nodes)) if i not in children]}]
    materials = header.setdefault("materials", [])
    for index, material in enumerate(materials):
        materials[index] = {"name": str(index), "pbrMetallicRoughness": base_color(material)}
    materials.append({"name": str(len(materials))})
    header.setdefault("bufferViews", [])  # without, trimesh leaves no materials to refer to
    header.setdefault("accessors", [])
    for mesh in header.get("meshes", []):
        for primitive in mesh["primitives"]:
            index = primitive.setdefault("material", len(materials) - 1)
            _use_one_uv_set(primitive["attributes"], materials[index])
    return header


def hidden_nodes(header: Json) -> set[int]:
    """Return the nodes that KHR_node_visibility hides, with all below them."""
    nodes = listed(header, "nodes")
    pending = [
        index
        for index, node in enumerate(nodes)
        if node.get("extensions", {}).get(NODE_VISIBILITY, {}).get("visible", True) is False
    ]
    hidden: set[int] = set()
    while pending:
        index = pending.pop()
        if index not in hidden:
            hidden.add(index)
            pending += nodes[index].get("children", [])
    return hidden


def drawn_meshes(header: Json) -> list[int]:
    """Return the index of the mesh of each node of the scene that is drawn; repeats are instances.

    The scene is the default one, else the first, else all nodes.
    """
    nodes, scenes = listed(header, "nodes"), listed(header, "scenes")
    children = {child for node in nodes for child in node.get("children", [])}
    roots = [index for index in range(len(nodes)) if index not in children]
    if scenes:
        roots = scenes[header.get("scene", 0)].get("nodes", [])
    hidden, seen, found, pending = hidden_nodes(header), set(), [], list(roots)
    while pending:
        index = pending.pop()
        if index in seen:
            continue
        seen.add(index)
        pending += nodes[index].get("children", [])
        if "mesh" in nodes[index] and index not in hidden:
            found.append(nodes[index]["mesh"])
    return found


def sampler_of(header: Json, material: Json) -> Json:
    """Return the sampler of a material's base colour; empty if it has none."""
    slot = base_color(material).get("baseColorTexture")
    if slot is None:
        return {}
    texture = header["textures"][slot["index"]]
    return header["samplers"][texture["sampler"]] if "sampler" in texture else {}


def base_color(material: Json) -> Json:
    """Reduce ``pbrMetallicRoughness`` to colour: texture and factor, if any.

    Of the older specular-glossiness materials it is the diffuse colour.
    """
    source = material.get("pbrMetallicRoughness", {})
    if is_lit_by_itself(material):
        emitted = {"baseColorTexture": material["emissiveTexture"]}
        alpha = source.get("baseColorFactor", [1.0] * 4)[3]
        factor = [*material.get("emissiveFactor", [1.0] * 3), alpha]
        return {**emitted, "baseColorFactor": factor}
    glossy = material.get("extensions", {}).get(SPECULAR_GLOSSINESS)
    if glossy is not None:
        renamed = {"diffuseTexture": "baseColorTexture", "diffuseFactor": "baseColorFactor"}
        source = {renamed.get(key, key): value for key, value in glossy.items()}
    return {key: source[key] for key in ("baseColorTexture", "baseColorFactor") if key in source}


def is_lit_by_itself(material: Json) -> bool:
    """Check whether a material is black but for a texture that it emits: a baked scene."""
    color = material.get("pbrMetallicRoughness", {})
    is_black = not any(color.get("baseColorFactor", [1.0] * 4)[:3])
    emits = "emissiveTexture" in material and any(material.get("emissiveFactor", [0.0] * 3))
    return is_black and emits and SPECULAR_GLOSSINESS not in material.get("extensions", {})


def _use_one_uv_set(attributes: Json, material: Json) -> None:
    """Make the set of texture coordinates that the base colour uses the first one."""
    slot = material.get("pbrMetallicRoughness", {}).get("baseColorTexture", {})
    transform = slot.get("extensions", {}).get(TEXTURE_TRANSFORM, {})
    chosen = int(transform.get("texCoord", slot.get("texCoord", 0)))
    if chosen == 0:
        return
    attributes.pop("TEXCOORD_0", None)
    if f"TEXCOORD_{chosen}" in attributes:
        attributes["TEXCOORD_0"] = attributes[f"TEXCOORD_{chosen}"]


def base_color_file(header: Json, material: Json) -> str | None:
    """Return the file of a base colour, WebP if offered, as trimesh chooses; None if embedded."""
    slot = base_color(material).get("baseColorTexture")
    if slot is None:
        return None
    stored = header["textures"][slot["index"]]
    webp = stored.get("extensions", {}).get(WEBP, {})
    source = webp.get("source", stored.get("source"))
    uri = None if source is None else header["images"][int(source)].get("uri")
    return None if uri is None or uri.startswith("data:") else str(uri)


MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
DRACO, BASISU = "KHR_draco_mesh_compression", "KHR_texture_basisu"
WEBP, TEXTURE_TRANSFORM = "EXT_texture_webp", "KHR_texture_transform"
# Extensions that are read, and keys of theirs and of glTF's by what stands there.
EXTENSIONS = {*MESHOPT, DRACO, BASISU, WEBP, TEXTURE_TRANSFORM, SPECULAR_GLOSSINESS}
EXTENSIONS |= {NODE_VISIBILITY}
MAPPINGS = {
    "attributes",
    "baseColorTexture",
    "diffuseTexture",
    "emissiveTexture",
    "extensions",
    "pbrMetallicRoughness",
    "sparse",
}
LISTS = {
    "accessors",
    "animations",
    "buffers",
    "bufferViews",
    "cameras",
    "images",
    "materials",
    "meshes",
    "nodes",
    "primitives",
    "samplers",
    "scenes",
    "skins",
    "textures",
}


def stand_alone(header: Json) -> list[str]:
    """List extensions without which something that is drawn cannot be read."""
    found = []
    for primitive in primitives_of(header):
        positions = header["accessors"][primitive["attributes"]["POSITION"]]
        if DRACO in primitive.get("extensions", {}) and "bufferView" not in positions:
            found.append(DRACO)  # no plain positions beside it
    for name, view in product(MESHOPT, listed(header, "bufferViews")):
        buffer = header["buffers"][view["buffer"]]
        is_placeholder = "uri" not in buffer and name in buffer.get("extensions", {})
        if name in view.get("extensions", {}) and is_placeholder:
            found.append(name)
    for material in listed(header, "materials"):
        slot = base_color(material).get("baseColorTexture")
        texture = {} if slot is None else header["textures"][slot["index"]]
        others = "source" in texture or "EXT_texture_webp" in texture.get("extensions", {})
        if BASISU in texture.get("extensions", {}) and not others:
            found.append(BASISU)
    return found


def listed(header: Json, key: str) -> list[Json]:
    """Return the entries under a key; none where it is missing."""
    found: list[Json] = header.get(key, [])
    return found


def primitives_of(header: Json) -> list[Json]:
    """List the primitives of all meshes."""
    return [primitive for mesh in listed(header, "meshes") for primitive in mesh["primitives"]]


# Names that exporters and download sites give to every file.
EVERYBODYS = ("scene", "model", "mesh", "index", "untitled", "textured", "object", "output")


def title_of(path: Path) -> str:
    """Return the title of a glTF, else the name of the file, or of its folder if that says more."""
    if path.suffix.lower() in (".gltf", ".glb"):
        extras = read_gltf(path).header["asset"].get("extras")
        title = extras.get("title") if isinstance(extras, dict) else None
        if isinstance(title, str) and title.strip():
            return " ".join(title.split())
    folder = path.resolve().parent.name
    return folder if path.stem.lower() in EVERYBODYS and folder else path.stem


def slug_of(title: str) -> str:
    """Turn a title into a name that configurations and shells take without quotes."""
    return re.sub(r"[^a-z0-9]+", "_", title.lower().replace("'", "")).strip("_")[:64] or "scene"
