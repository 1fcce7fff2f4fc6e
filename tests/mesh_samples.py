"""Small meshes for tests, and glTF and OBJ files written by hand: readers are not tested with our
own writer."""

import copy
import json
import struct
from typing import Any

import numpy as np
import trimesh

from synfeal.mesh.model import MeshPart, TexturedMesh

TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 3]])
FACE = np.array([[0, 1, 2]])
UV = np.array([[0.0, 0.0], [1.0, 0.0], [0.25, 0.75]])

Json = dict[str, Any]


def part_of(mesh, **values):
    return MeshPart("part", np.asarray(mesh.vertices), np.asarray(mesh.faces), **values)


def box_mesh(extents=(2.0, 3.0, 4.0)):
    box = trimesh.creation.box(extents)
    return TexturedMesh((part_of(box, vertex_rgb=np.full((8, 3), 99, np.uint8)),))


def textured(material=None, **slot):
    """A glTF material with the first texture as its base colour."""
    return {
        "name": "Paint",
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, **slot}},
        **(material or {}),
    }


def triangle_gltf(material, images):
    """JSON and buffer of TRIANGLE with UV, moved by a node."""
    binary = TRIANGLE.astype("<f4").tobytes() + UV.astype("<f4").tobytes()
    header = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": [10.0, 20.0, 30.0], "scale": [2.0, 2.0, 2.0]}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}
        ],
        "materials": [{"name": "Paint", **material}],
        "textures": [{"source": index} for index in range(len(images))],
        "images": [{"uri": uri} for uri in images],
        "buffers": [{"uri": "data.bin", "byteLength": 60}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 24},
        ],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 3,
                "type": "VEC3",
                "min": [0, 0, 0],
                "max": [1, 2, 3],
            },
            {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
        ],
    }
    return header, binary


def add_attribute(header, binary, name, values, **accessor):
    """Give the first primitive another attribute; returns the longer buffer."""
    types = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
    components = {"u1": 5121, "u2": 5123, "u4": 5125, "f4": 5126, "i2": 5122}
    header["bufferViews"].append(
        {"buffer": 0, "byteOffset": len(binary), "byteLength": values.nbytes}
    )
    header["accessors"].append(
        {
            "bufferView": len(header["bufferViews"]) - 1,
            "componentType": components[values.dtype.str[1:]],
            "count": len(values),
            "type": types[values.shape[1]],
            **accessor,
        }
    )
    attributes = header["meshes"][0]["primitives"][0]["attributes"]
    attributes[name] = len(header["accessors"]) - 1
    binary += values.tobytes()
    binary += b"\0" * (-len(binary) % 4)
    header["buffers"][0]["byteLength"] = len(binary)
    return binary


def store_gltf(folder, header, binary):
    (folder / "data.bin").write_bytes(binary)
    path = folder / "scene.gltf"
    path.write_text(json.dumps(header))
    return path


def store_glb(folder, header, binary):
    header = copy.deepcopy(header)
    header["buffers"][0].pop("uri", None)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    path = folder / "scene.glb"
    path.write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)
    return path


def write_gltf(folder, material, images):
    """A one-triangle glTF."""
    return store_gltf(folder, *triangle_gltf(material, images))


def write_obj(folder, mtl="Kd 0.2 0.4 0.6\nmap_Kd wall.png\n"):
    """A one-triangle OBJ with one material."""
    (folder / "scene.mtl").write_text("newmtl wall\n" + mtl)
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in TRIANGLE)
    uv = "".join(f"vt {u} {v}\n" for u, v in UV)
    path = folder / "scene.obj"
    path.write_text("mtllib scene.mtl\n" + vertices + uv + "usemtl wall\nf 1/1 2/2 3/3\n")
    return path
