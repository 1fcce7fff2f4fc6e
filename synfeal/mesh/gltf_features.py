"""Features of a glTF that an unlit image of a scene at rest does not show, each in a sentence.

The list follows the glTF 2.0 specification (Khronos, 3.5 to 3.12) and the extension registry
(https://github.com/KhronosGroup/glTF/tree/main/extensions), gone through in 2026. What is not named
here is either followed or belongs to light and gloss, which are dropped on purpose.
"""

from __future__ import annotations

from collections import Counter

from synfeal.mesh.gltf import (
    BASISU,
    DRACO,
    MESHOPT,
    NEAREST,
    NODE_VISIBILITY,
    SPECULAR_GLOSSINESS,
    TEXTURE_TRANSFORM,
    TRIANGLES,
    WEBP,
    Json,
    drawn_meshes,
    hidden_nodes,
    is_lit_by_itself,
    listed,
    sampler_of,
)
from synfeal.mesh.model import Findings

MODES = ("points", "lines", "line loops", "line strips")
FOLLOWED = {*MESHOPT, BASISU, DRACO, NODE_VISIBILITY, SPECULAR_GLOSSINESS, TEXTURE_TRANSFORM, WEBP}
FOLLOWED |= {"KHR_mesh_quantization"}
# Of light and gloss, of what is not drawn, and of what says nothing about a picture.
WITHOUT_EFFECT = {
    *(f"KHR_materials_{name}" for name in ("anisotropy", "clearcoat", "dispersion", "ior")),
    *(f"KHR_materials_{name}" for name in ("iridescence", "sheen", "specular", "unlit")),
    *(f"KHR_{name}" for name in ("lights_punctual", "xmp", "xmp_json_ld", "interactivity")),
    *(f"KHR_{name}" for name in ("physics_rigid_bodies", "collision_shapes", "audio_emitter")),
    *(f"KHR_{name}" for name in ("implicit_shapes", "accessor_float64", "audio_graph")),
    *(f"KHR_node_{name}" for name in ("hoverability", "selectability")),
    *(f"EXT_{name}" for name in ("lights_image_based", "lights_ies", "mesh_manifold")),
    *(f"EXT_{name}" for name in ("mesh_features", "instance_features", "structural_metadata")),
    *(f"MSFT_{name}" for name in ("packing_occlusionRoughnessMetallic", "audio_emitter")),
    *(f"MSFT_{name}" for name in ("packing_normalRoughnessMetallic", "lod")),
    *(f"AGI_{name}" for name in ("articulations", "stk_metadata")),
    "CESIUM_primitive_outline",
    "CESIUM_RTC",
    "FB_geometry_metadata",
    "GRIFFEL_bim_data",
    "VRM",
    "VRMC_vrm",
    "VRMC_springBone",
    "VRMC_node_constraint",
    "OMI_collider",
}
# What an author sees and an image here does not, by extensions of materials.
SEEN_THROUGH = {
    "KHR_materials_transmission": "transmissionFactor",
    "KHR_materials_diffuse_transmission": "diffuseTransmissionFactor",
}


def report_features(header: Json, findings: Findings) -> None:
    """Name the features of a glTF that are present and not followed.

    Args:
        header: Its JSON, with strips and fans as lists of triangles.
        findings: Collects the sentences.
    """
    _report_scene(header, findings)
    _report_meshes(header, findings)
    for material in listed(header, "materials"):
        _report_material(header, material, findings)
    told = {"KHR_materials_variants", "KHR_gaussian_splatting", "KHR_materials_emissive_strength"}
    told |= {*SEEN_THROUGH, "KHR_materials_volume", "KHR_animation_pointer"}
    for name in dict.fromkeys(header.get("extensionsUsed", [])):
        if name not in FOLLOWED | WITHOUT_EFFECT | told:
            findings.note(f"extension {name} is not followed")
    if "KHR_materials_variants" in header.get("extensionsUsed", []):
        findings.note("has variants of materials (KHR_materials_variants); the default is drawn")


def _report_scene(header: Json, findings: Findings) -> None:
    n_scenes = len(listed(header, "scenes"))
    if n_scenes > 1:
        findings.warn(f"holds {n_scenes} scenes; only the default one is read")
    n_hidden = sum("mesh" in listed(header, "nodes")[index] for index in hidden_nodes(header))
    if n_hidden:
        findings.note(f"{n_hidden} nodes are hidden by KHR_node_visibility; left out")
    if listed(header, "animations"):
        findings.note(f"holds {len(header['animations'])} animations; drawn at rest")
    n_skinned = sum("skin" in node and "mesh" in node for node in listed(header, "nodes"))
    if n_skinned:
        findings.warn(
            f"{n_skinned} nodes have a skin, which is not followed: they stand as they were"
            " modelled; apply the pose before exporting"
        )


def _report_meshes(header: Json, findings: Findings) -> None:
    meshes, nodes = listed(header, "meshes"), listed(header, "nodes")
    weights = [mesh.get("weights", []) for mesh in meshes]
    weights += [node.get("weights", []) for node in nodes]
    if any(any(each) for each in weights):
        findings.warn(
            "has morph targets with weights, which are not followed; apply them before exporting"
        )
    unseen: Counter[str] = Counter()
    for index in set(drawn_meshes(header)):
        for primitive in meshes[index]["primitives"]:
            mode = primitive.get("mode", TRIANGLES)
            if mode != TRIANGLES:
                unseen[MODES[mode] if 0 <= mode < len(MODES) else f"mode {mode}"] += 1
    for kind, count in unseen.items():
        findings.warn(f"{count} primitives of {kind} are not drawn")
    if not drawn_meshes(header) and meshes:
        findings.warn("has meshes that no node of its scene draws")


def _report_material(header: Json, material: Json, findings: Findings) -> None:
    owner = f"material '{material.get('name', 'unnamed')}'"
    extensions = material.get("extensions", {})
    for name, key in SEEN_THROUGH.items():
        if extensions.get(name, {}).get(key, 0.0):
            findings.warn(f"{owner}: lets light through ({name}); drawn opaque")
    if is_lit_by_itself(material):
        findings.note(f"{owner}: black but for what it emits, which is drawn")
    elif any(material.get("emissiveFactor", ())):
        findings.note(f"{owner}: what it emits is not added to its colour")
    if sampler_of(header, material).get("magFilter") == NEAREST:
        findings.note(f"{owner}: asks for unfiltered texels; its texture is filtered")


def declared_triangles(header: Json) -> int:
    """Count the triangles of all nodes of the scene, as the accessors declare them."""
    total, meshes = 0, listed(header, "meshes")
    for index in drawn_meshes(header):
        for primitive in meshes[index]["primitives"]:
            if primitive.get("mode", TRIANGLES) == TRIANGLES:
                source = primitive.get("indices", primitive["attributes"].get("POSITION"))
                if source is not None:
                    total += header["accessors"][source]["count"] // 3
    return total


def without_surface(header: Json) -> str | None:
    """Say what a glTF without triangles holds; None if that is nothing."""
    if "KHR_gaussian_splatting" in header.get("extensionsUsed", []):
        return (
            "is a Gaussian splat, which has no surface; export a mesh from the program that made"
            " it, or reconstruct one from its photographs"
        )
    meshes = listed(header, "meshes")
    modes = {
        primitive.get("mode", TRIANGLES)
        for index in drawn_meshes(header)
        for primitive in meshes[index]["primitives"]
    }
    if modes == {0}:
        return (
            "holds points and no faces; make a surface of them, as MeshLab's Screened Poisson"
            " reconstruction does"
        )
    if modes and TRIANGLES not in modes:
        return "holds lines or points and no faces; export the scene as a triangle mesh"
    return None
