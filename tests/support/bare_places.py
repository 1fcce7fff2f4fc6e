"""Meshes as people have them where no artist painted them: plain, without its texture, a scan."""

import numpy as np
import trimesh

from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.save import save_glb

WHITE, OAK, GREY = (236, 236, 232), (196, 180, 158), (150, 152, 158)
HEIGHT_M, DOOR_M = 2.6, 2.1
WALL_M = 0.12
# Rooms of the apartment: x0, x1, y0, y1.
LIVING, KITCHEN, HALL = (0.0, 5.0, 0.0, 3.6), (0.0, 5.0, 3.72, 7.0), (5.12, 6.4, 0.0, 7.0)
BEDROOM, STUDY = (6.52, 10.0, 0.0, 3.4), (6.52, 10.0, 3.52, 7.0)
ROOMS = (LIVING, KITCHEN, HALL, BEDROOM, STUDY)


def block_of(low, high):
    """A closed box between two corners."""
    return trimesh.creation.box(bounds=[low, high])


def wall_with_doors(x0, x1, length_m, doors):
    """A wall along y, with openings of 2.1 m height between pairs of y."""
    blocks, start = [], 0.0
    for near, far in doors:
        blocks.append(block_of((x0, start, 0), (x1, near, HEIGHT_M)))
        blocks.append(block_of((x0, near, DOOR_M), (x1, far, HEIGHT_M)))
        start = far
    return [*blocks, block_of((x0, start, 0), (x1, length_m, HEIGHT_M))]


def plain_part(meshes, rgb):
    """Boxes as one part of one plain colour."""
    whole = trimesh.util.concatenate(meshes)
    color = np.array([*rgb, 255], np.uint8)
    return MeshPart("plain", np.asarray(whole.vertices), np.asarray(whole.faces), base_color=color)


def apartment():
    """Four rooms on a hall, 10 x 7 m: plain colours, no light, no texture."""
    t = WALL_M
    walls = [
        block_of((-t, -t, 0), (0, 7 + t, HEIGHT_M)),
        block_of((10, -t, 0), (10 + t, 7 + t, HEIGHT_M)),
        block_of((0, -t, 0), (10, 0, HEIGHT_M)),
        block_of((0, 7, 0), (10, 7 + t, HEIGHT_M)),
        block_of((0, 3.6, 0), (5, 3.72, HEIGHT_M)),
        block_of((6.52, 3.4, 0), (10, 3.52, HEIGHT_M)),
        block_of((-t, -t, HEIGHT_M), (10 + t, 7 + t, HEIGHT_M + t)),
    ]
    doors = [(1.4, 2.3), (4.6, 5.5)]
    for x0 in (5.0, 6.4):
        walls += wall_with_doors(x0, x0 + t, 7.0, doors)
    floor = [block_of((-t, -t, -t), (10 + t, 7 + t, 0))]
    furniture = [
        block_of((0.0, 0.4, 0), (0.9, 2.4, 0.8)),  # sofa
        block_of((2.0, 1.2, 0.35), (3.0, 1.8, 0.42)),  # table
        block_of((0.0, 6.4, 0), (3.6, 7.0, 0.9)),  # kitchen counter
        block_of((8.2, 0.0, 0), (10.0, 2.0, 0.5)),  # bed
        block_of((6.52, 6.4, 0), (8.4, 7.0, 2.0)),  # shelves
        block_of((8.9, 4.2, 0), (9.6, 5.4, 0.75)),  # desk
    ]
    parts = (plain_part(walls, WHITE), plain_part(floor, OAK), plain_part(furniture, GREY))
    return TexturedMesh(parts)


def write_apartment(folder):
    save_glb(folder / "apartment.glb", apartment())
    return folder / "apartment.glb"


CELLA = (-4.5, 4.5, -2.2, 2.2)  # x0, x1, y0, y1 of the room of the temple
TEMPLE_FLOOR_M = 0.6


def temple():
    """A room with a door behind columns, under a roof, on a platform on the ground."""
    x0, x1, y0, y1 = CELLA
    floor, top = TEMPLE_FLOOR_M, 4.6
    pieces = [
        block_of((-20, -15, -0.2), (20, 15, 0)),
        block_of((-8, -5, 0), (8, 5, floor)),
        block_of((-8, -5, top), (8, 5, top + 0.5)),
        block_of((x0 - 0.4, y0 - 0.4, floor), (x0, y1 + 0.4, top)),
        block_of((x0, y0 - 0.4, floor), (x1, y0, top)),
        block_of((x0, y1, floor), (x1, y1 + 0.4, top)),
        block_of((x1, y0 - 0.4, floor), (x1 + 0.4, -0.7, top)),
        block_of((x1, 0.7, floor), (x1 + 0.4, y1 + 0.4, top)),
        block_of((x1, -0.7, 3.2), (x1 + 0.4, 0.7, top)),
        block_of((-3.8, -0.6, floor), (-2.8, 0.6, 1.9)),  # altar
    ]
    for x in np.linspace(-7.2, 7.2, 7):
        for y in np.linspace(-4.2, 4.2, 4):
            if max(abs(x) / 7.2, abs(y) / 4.2) > 0.99:
                column = trimesh.creation.cylinder(0.4, top - floor, sections=16)
                pieces.append(column.apply_translation([x, y, (top + floor) / 2]))
    return trimesh.util.concatenate(pieces)


def write_temple(folder):
    """As OBJ, z up; its material names a texture that is not there."""
    mesh = temple()
    (folder / "temple.mtl").write_text("newmtl stone\nKd 0.8 0.8 0.8\nmap_Kd stone.png\n")
    lines = ["mtllib temple.mtl", "usemtl stone"]
    lines += ["v {:.6f} {:.6f} {:.6f}".format(*place) for place in mesh.vertices]
    lines += ["vt {:.6f} {:.6f}".format(*place[:2]) for place in mesh.vertices]
    lines += ["f " + " ".join(f"{i + 1}/{i + 1}" for i in face) for face in mesh.faces]
    (folder / "temple.obj").write_text("\n".join(lines) + "\n")
    return folder / "temple.obj"


# The room that was scanned: low and high corner.
SCANNED = np.array([[-2.6, -2.1, 0.0], [2.6, 2.1, 2.5]])


def fused_scan(spacing_m):
    """A room as depth fusion leaves it, colours at its vertices.

    Walls are 1 cm rough, with holes where nobody looked; most of the ceiling is missing, and part
    of a wall. With a spacing of 1.33 cm it has 640,000 faces.
    """
    low, high = SCANNED
    boxes = [trimesh.creation.box(bounds=SCANNED)]
    boxes += [
        block_of((-2.4, -1.9, 0), (-1.2, -1.2, 0.8)),
        block_of((1.5, 0.9, 0), (2.3, 1.9, 1.7)),
    ]
    sheets = []
    for number, box in enumerate(boxes):
        for axis, side in ((axis, side) for axis in range(3) for side in (0, 1)):
            if number and (axis, side) == (2, 0):
                continue  # nobody sees what furniture stands on
            sheets.append(_sheet(np.asarray(box.bounds), axis, side, spacing_m))
    mesh = trimesh.util.concatenate(sheets)
    place = np.asarray(mesh.vertices)
    waves = np.sin(place @ np.array([[17.0, 5.0, 9.0], [4.0, 19.0, 7.0], [8.0, 6.0, 21.0]]))
    centre = np.asarray(mesh.triangles_center)
    rng = np.random.default_rng(4)
    holes = rng.uniform(low, high, (25, 3))
    holes[np.arange(25), np.arange(25) % 3] = np.where(rng.random(25) < 0.5, low[0], high[0])
    is_hole = (np.linalg.norm(centre[:, None] - holes, axis=2) < 0.25).any(axis=1)
    is_hole |= (centre[:, 2] > high[2] - 1e-6) & (centre[:, 0] > -1.8)
    is_hole |= (centre[:, 0] > high[0] - 1e-6) & (centre[:, 1] < -0.6)
    rgb = np.clip(128 + 60 * waves + 45 * np.sin(6 * place[:, ::-1]), 0, 255).astype(np.uint8)
    colors = np.column_stack([rgb, np.full(len(rgb), 255, np.uint8)])
    scan = trimesh.Trimesh(place + 0.01 * waves, mesh.faces, vertex_colors=colors, process=False)
    scan.update_faces(~is_hole)
    scan.remove_unreferenced_vertices()
    return scan


def _sheet(bounds, axis, side, spacing_m):
    """A regular grid of triangles over one side of a box."""
    others = [k for k in range(3) if k != axis]
    sides = [np.linspace(*bounds[:, k], int(np.ptp(bounds[:, k]) / spacing_m) + 2) for k in others]
    places = np.empty((len(sides[0]), len(sides[1]), 3))
    places[..., axis] = bounds[side, axis]
    places[..., others[0]], places[..., others[1]] = np.meshgrid(*sides, indexing="ij")
    index = np.arange(places.shape[0] * places.shape[1]).reshape(places.shape[:2])
    corners = (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:])
    a, b, c, d = (corner.ravel() for corner in corners)
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    return trimesh.Trimesh(places.reshape(-1, 3), faces, process=False)


def write_scan(folder, spacing_m=0.08):
    (folder / "scan.ply").write_bytes(fused_scan(spacing_m).export(file_type="ply"))
    return folder / "scan.ply"
