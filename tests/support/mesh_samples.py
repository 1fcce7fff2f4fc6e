"""Small meshes for tests, and glTF and OBJ files written by hand: readers are not tested with our
own writer."""

import copy
import json
import struct
from typing import Any

import numpy as np
import trimesh
from PIL import Image

from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.triangles import Triangles, save_collision_mesh

TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 3]])
FACE = np.array([[0, 1, 2]])
UV = np.array([[0.0, 0.0], [1.0, 0.0], [0.25, 0.75]])

# Numbers of glTF's specification.
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
COMPONENTS = {"u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}

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


class Gltf:
    """A glTF of one primitive in one node, put together attribute by attribute."""

    def __init__(self):
        self.binary = b""
        self.header: Json = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {}}]}],
            "buffers": [{"uri": "data.bin", "byteLength": 0}],
            "bufferViews": [],
            "accessors": [],
        }

    @property
    def primitive(self):
        return self.header["meshes"][0]["primitives"][0]

    def view(self, content, **more):
        """The number of a view of bytes that are put at the end."""
        place = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(content)}
        self.header["bufferViews"].append({**place, **more})
        self.binary += content + b"\0" * (-len(content) % 4)
        self.header["buffers"][0]["byteLength"] = len(self.binary)
        return len(self.header["bufferViews"]) - 1

    def accessor(self, values, **more):
        """The number of an accessor to values (N, C) that have no view yet, or are in one."""
        kind = {"componentType": COMPONENTS[values.dtype.str[1:]], "count": len(values)}
        shape = {"type": TYPES[values.shape[1]]}
        self.header["accessors"].append({**kind, **shape, **more})
        return len(self.header["accessors"]) - 1

    def add(self, name, values, stride=None, **more):
        """An attribute, or the indices; with a stride, of the first numbers of each row."""
        strided = {"byteStride": stride} if stride else {}
        number = self.accessor(values, bufferView=self.view(values.tobytes(), **strided), **more)
        holder = self.primitive if name == "indices" else self.primitive["attributes"]
        holder[name] = number

    def store(self, folder):
        (folder / "data.bin").write_bytes(self.binary)
        path = folder / "scene.gltf"
        path.write_text(json.dumps(self.header))
        return path

    def store_glb(self, folder):
        header = copy.deepcopy(self.header)
        header["buffers"][0].pop("uri", None)
        text = json.dumps(header).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(self.binary), b"BIN\0") + self.binary
        path = folder / "scene.glb"
        path.write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)
        return path


def triangle_gltf(material, images):
    """TRIANGLE with UV, moved by a node; images are files beside it."""
    gltf = Gltf()
    gltf.add("POSITION", TRIANGLE.astype("<f4"), min=[0, 0, 0], max=[1, 2, 3])
    gltf.add("TEXCOORD_0", UV.astype("<f4"))
    gltf.primitive["material"] = 0
    gltf.header["nodes"][0] |= {"translation": [10.0, 20.0, 30.0], "scale": [2.0, 2.0, 2.0]}
    gltf.header |= {
        "materials": [{"name": "Paint", **material}],
        "textures": [{"source": index} for index in range(len(images))],
        "images": [{"uri": uri} for uri in images],
    }
    return gltf


def write_gltf(folder, material, images):
    """A one-triangle glTF."""
    return triangle_gltf(material, images).store(folder)


def write_obj(folder, mtl="Kd 0.2 0.4 0.6\nmap_Kd wall.png\n"):
    """A one-triangle OBJ with one material."""
    (folder / "scene.mtl").write_text("newmtl wall\n" + mtl)
    vertices = "".join(f"v {x} {y} {z}\n" for x, y, z in TRIANGLE)
    uv = "".join(f"vt {u} {v}\n" for u, v in UV)
    path = folder / "scene.obj"
    path.write_text("mtllib scene.mtl\n" + vertices + uv + "usemtl wall\nf 1/1 2/2 3/3\n")
    return path


def write_painted_obj(path):
    """A scene, its material and its texture, where one of the three is to lie."""
    Image.new("RGB", (4, 4), (9, 99, 199)).save(path.parent / "wall.png")
    write_obj(path.parent)


def write_painted_gltf(path):
    Image.new("RGB", (4, 4), (9, 99, 199)).save(path.parent / "wall.png")
    write_gltf(path.parent, textured(), ["wall.png"])


def write_ply(path):
    colors = np.full((3, 4), 99, np.uint8)
    mesh = trimesh.Trimesh(TRIANGLE, FACE, vertex_colors=colors)
    path.write_bytes(mesh.export(file_type="ply", encoding="ascii"))


def write_collision(path):
    (part,) = box_mesh().parts
    save_collision_mesh(path, Triangles(part.vertices_m, part.faces))


def is_sound_triangles(mesh):
    in_range = mesh.faces.min() >= 0 and mesh.faces.max() < len(mesh.vertices_m)
    return bool(len(mesh.faces) and in_range and np.isfinite(mesh.vertices_m).all())


def is_sound(mesh):
    return bool(mesh.parts) and all(map(is_sound_triangles, mesh.parts))


def paint_halves(path, left, right, turned=False):
    """A texture whose left half is of one colour, its right half of another; turned, top to bottom.

    In glTF, the top is where texture coordinates begin.
    """
    pixels = np.zeros((16, 16, 3), np.uint8)
    pixels[:, :8], pixels[:, 8:] = left, right
    Image.fromarray(pixels.transpose(1, 0, 2) if turned else pixels).save(path)
