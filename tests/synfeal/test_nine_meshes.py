"""Meshes of different origin: inspect, the command it prints, validate, evaluate; nobody helps."""

import contextlib
import json
import shlex
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from PIL import Image

from synfeal.cli import main
from synfeal.config.collection import Angles
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.pose_table import read_pose_table
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.save import save_glb
from synfeal.planning.coverage import empty_shares
from synfeal.planning.path import poses_of
from synfeal.planning.space import pose_bounds, sample_poses
from tests.support.bare_places import (
    CELLA,
    ROOMS,
    SCANNED,
    TEMPLE_FLOOR_M,
    write_apartment,
    write_scan,
    write_temple,
)
from tests.support.mesh_conversions import write_colored_ply, write_obj_scene
from tests.support.small_room import SIDES, TWO, paint

Corners = tuple[float, float, float]
TILE_M = 2.5


@dataclass(frozen=True)
class Varied:
    """One mesh.

    Attributes:
        path: the file.
        rooms_m: (R, 2, 3) its rooms in the world, metres, z up: where people walk, a little off
            walls. Cameras must be in them, and in all of them but ``rooms_left_out``.
        unit_m, up_axis: what the command must find out.
    """

    path: Path
    rooms_m: NDArray[np.float64]
    unit_m: float = 1.0
    up_axis: str = "auto"
    rooms_left_out: int = 0


PAINTS = [paint(np.random.default_rng(seed), (2.0, 8.0, 24.0)) for seed in range(5)]


def block(low, high, seed=0):
    """The six sides of a box, each with a texture that repeats every 2.5 m."""
    corners = np.asarray(low) + SIDES * (np.asarray(high) - np.asarray(low))
    parts = []
    for index, side in enumerate(corners):
        along, up = side[1] - side[0], side[3] - side[0]
        size = np.array([np.linalg.norm(along), np.linalg.norm(up)]) / TILE_M
        uv = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * size
        texture = PAINTS[(seed + index) % len(PAINTS)]
        parts.append(MeshPart("side", side, TWO[:, ::-1], uv, texture))
    return parts


def walls(low, high, sides, thick=0.3):
    """Hollow walls (wesn), floor (f) and roof (r) around a room."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    t = thick
    boxes = {
        "w": ((x0 - t, y0 - t, z0), (x0, y1 + t, z1)),
        "e": ((x1, y0 - t, z0), (x1 + t, y1 + t, z1)),
        "s": ((x0, y0 - t, z0), (x1, y0, z1)),
        "n": ((x0, y1, z0), (x1, y1 + t, z1)),
        "f": ((x0 - t, y0 - t, z0 - t), (x1 + t, y1 + t, z0)),
        "r": ((x0 - t, y0 - t, z1), (x1 + t, y1 + t, z1 + t)),
    }
    return [p for i, side in enumerate(sides) for p in block(*boxes[side], seed=i)]


def furniture(x, y, z=0.0):
    """A table-high block and a cupboard."""
    low = block((x, y, z), (x + 1.2, y + 0.7, z + 0.75), 2)
    return low + block((x + 1.6, y, z), (x + 2.2, y + 0.4, z + 1.9), 3)


def hollow_walls(folder):
    """Two walls and the ceiling missing; walls 40 cm thick, on a hollow slab of 90 cm."""
    parts = walls((0, 0, 0), (4.0, 3.2, 2.6), "ws", 0.4) + furniture(0.3, 0.3)
    parts += block((-0.4, -0.4, -0.9), (4.4, 3.6, 0.0), 4)
    save_glb(folder / "hollow walls.glb", TexturedMesh(tuple(parts)))
    return Varied(folder / "hollow walls.glb", inside((0, 0, 0), (4.0, 3.2, 2.6)))


def no_ceiling(folder):
    """A scan with vertex colours, as PLY."""
    mesh = TexturedMesh(tuple(walls((-3, -2, 0), (3, 2.5, 2.7), "wesnf", 0.1) + furniture(-2, -1)))
    write_colored_ply(folder / "no_ceiling.ply", mesh, 0.2)
    return Varied(folder / "no_ceiling.ply", inside((-3, -2, 0), (3, 2.5, 2.7)))


def millimetres(folder):
    """A CAD export: OBJ, y up, millimetres."""
    parts = walls((0, 0, 0), (7.0, 4.0, 2.8), "wesnfr") + furniture(1.0, 0.5)
    y_up = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])  # world from file
    stored = [replace(p, vertices_m=1000.0 * p.vertices_m @ y_up) for p in parts]
    path = write_obj_scene(folder, TexturedMesh(tuple(stored)))
    return Varied(path, inside((0, 0, 0), (7.0, 4.0, 2.8)), 0.001, "y")


def nested(folder):
    """glTF by another writer: centimetres in nodes that scale, turn and move, one in the other."""
    parts = walls((-2.5, -2, 0), (2.5, 2, 2.5), "wesnfr", 0.2) + furniture(-1, 0.8)
    scene = trimesh.Scene()
    turn = trimesh.transformations.rotation_matrix(np.pi / 2, [0, 0, 1])
    scale = trimesh.transformations.scale_matrix(0.01)
    y_up = trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0])
    scene.graph.update("scaled", "world", matrix=scale)
    scene.graph.update("y_up", "scaled", matrix=y_up)
    scene.graph.update("turned", "y_up", matrix=turn)
    for index, part in enumerate(parts):
        centre = part.vertices_m.mean(axis=0)
        material = trimesh.visual.material.PBRMaterial(
            baseColorTexture=Image.fromarray(part.texture), name=f"paint {index}"
        )
        visual = trimesh.visual.TextureVisuals(uv=part.uv, material=material)
        vertices = 100.0 * (part.vertices_m - centre)
        geometry = trimesh.Trimesh(vertices, part.faces, visual=visual, process=False)
        move = trimesh.transformations.translation_matrix(100.0 * centre)
        scene.add_geometry(geometry, parent_node_name="turned", transform=move)
    (folder / "nested.glb").write_bytes(scene.export(file_type="glb"))
    return Varied(folder / "nested.glb", inside((-2, -2.5, 0), (2, 2.5, 2.5)))


def two_floors(folder):
    """Two storeys that a stairwell joins; the lower one is the larger."""
    parts = walls((0, 0, 0), (6, 5, 2.5), "wesnf") + walls((0, 0, 2.8), (6, 3.5, 5.2), "wesnr")
    parts += block((0, 0, 2.5), (4.8, 5, 2.8)) + block((4.8, 0, 2.5), (6, 2, 2.8), 1)
    parts += block((4.8, 4.5, 2.5), (6, 5, 2.8), 2) + furniture(0.5, 0.5)
    save_glb(folder / "two_floors.glb", TexturedMesh(tuple(parts)))
    rooms = [inside((0, 0, 0), (6, 5, 2.5)), inside((0, 0, 2.8), (6, 3.5, 5.2))]
    return Varied(folder / "two_floors.glb", np.concatenate(rooms))


def outside(folder):
    """A house with a door and a window in a large garden with a hedge and a shed."""
    low, high = (0.0, 0.0, 0.0), (6.0, 5.0, 2.6)
    parts = walls(low, high, "wnr") + block((-15, -15, -0.2), (20, 18, 0.0), 3)
    # South with a door of 1 m, east with a window of 1.2 x 1.0 m.
    parts += block((0, -0.3, 0), (2.5, 0, 2.6)) + block((3.5, -0.3, 0), (6.3, 0, 2.6), 1)
    parts += block((2.5, -0.3, 2.1), (3.5, 0, 2.6), 2)
    parts += block((6, 0, 0), (6.3, 1.9, 2.6)) + block((6, 3.1, 0), (6.3, 5.3, 2.6), 1)
    parts += block((6, 1.9, 0), (6.3, 3.1, 0.9), 2) + block((6, 1.9, 1.9), (6.3, 3.1, 2.6), 3)
    parts += furniture(0.5, 3.5) + block((12, -10, 0), (15, -7, 2.4), 1)
    parts += block((-15, 17, 0), (20, 18, 1.6), 2) + block((-15, -15, 0), (-14.5, 17, 1.6), 4)
    save_glb(folder / "house.glb", TexturedMesh(tuple(parts)))
    return Varied(folder / "house.glb", inside(low, high))


def inside(low, high):
    """A room less 30 cm at its walls, at the heights of cameras in hands."""
    z = low[2] + np.array([0.8, 2.0])
    return np.array([[[low[0] + 0.3, low[1] + 0.3, z[0]], [high[0] - 0.3, high[1] - 0.3, z[1]]]])


def plain_apartment(folder):
    """Four rooms on a hall without any texture or light; the hall is narrow."""
    rooms = [inside((x0, y0, 0.0), (x1, y1, 2.6)) for x0, x1, y0, y1 in ROOMS]
    return Varied(write_apartment(folder), np.concatenate(rooms), rooms_left_out=1)


def temple_without_its_texture(folder):
    """The room behind its columns is what is enclosed."""
    x0, x1, y0, y1 = CELLA
    return Varied(write_temple(folder), inside((x0, y0, TEMPLE_FLOOR_M), (x1, y1, 4.6)))


def scanned(folder):
    """Vertex colours, holes, three quarters of a ceiling and a third of a wall missing."""
    return Varied(write_scan(folder), inside(*SCANNED))


MESHES = {
    "hollow_walls": hollow_walls,
    "no_ceiling": no_ceiling,
    "millimetres": millimetres,
    "nested": nested,
    "two_floors": two_floors,
    "outside": outside,
    "plain_apartment": plain_apartment,
    "temple": temple_without_its_texture,
    "scan": scanned,
}


# What is said last counts: the printed command with fewer, smaller frames, farther apart.
SMALLER = [
    *("--frames", "40", "--test-frames", "16", "--spacing", "0.25"),
    *("--width", "96", "--height", "72"),
]


def explained_by_holes(mesh, n_paths):
    """Share of empty pixels of cameras anywhere in the room that look anywhere.

    With three standard errors of a set of that many paths, the frames of each being alike.
    """
    loaded = load_mesh(mesh.path, mesh.up_axis, mesh.unit_m)
    rng, count = np.random.default_rng(0), 1000 // len(mesh.rooms_m)
    vectors = [sample_poses(pose_bounds(room_m, Angles()), count, rng) for room_m in mesh.rooms_m]
    poses = poses_of(np.concatenate(vectors))
    shares = empty_shares(RayCaster(*loaded.merged()), poses, CameraConfig())
    return float(shares.mean() + 3.0 * shares.std() / np.sqrt(n_paths))


@pytest.mark.slow
@pytest.mark.parametrize("make", MESHES.values(), ids=MESHES)
def test_from_a_mesh_to_a_data_set_without_help(make, tmp_path, capsys):
    mesh = make(tmp_path)
    with contextlib.chdir(tmp_path):
        assert main(["inspect", mesh.path.name]) == 0
        command = shlex.split(capsys.readouterr().out.splitlines()[-1])
        assert command[:2] == ["synfeal", "collect"]
        assert main([*command[1:], *SMALLER]) == 0
        out = tmp_path / command[command.index("--out") + 1]
        assert main(["validate", str(out)]) == 0
        capsys.readouterr()
        assert main(["evaluate", str(out), str(out / "test.csv")]) == 0
    assert "16 frames" in capsys.readouterr().out
    assert len(set(read_pose_table(out / "test.csv").path.tolist())) >= 8
    table = read_pose_table(out / "train.csv")
    positions = table.position_m
    low, high = np.moveaxis(mesh.rooms_m, 1, 0)[:, :, None]
    is_in = ((positions > low - 0.15) & (positions < high + 0.15)).all(axis=2)  # (R, N)
    assert is_in.any(axis=0).all()
    assert np.sum(~is_in.any(axis=1)) <= mesh.rooms_left_out
    empty = json.loads((out / "coverage.json").read_text())["train"]["empty_pixels"]["share"]
    assert empty <= explained_by_holes(mesh, int(table.path[-1]) + 1)
