"""Light groups of stand-in rooms, which effects switch."""

from itertools import pairwise

import numpy as np
import pytest

from reproduction.rooms.bake import light_shares, scanned_mesh
from reproduction.rooms.lighting import Lamp, Lighting, received
from reproduction.rooms.scan import Scanner, surface_of
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.dataset.render_sequence import drawn, effects_of
from synfeal.effects import light as effects
from synfeal.effects.files import LIGHT_GROUPS
from synfeal.effects.scene import open_scene
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_matrix, quat_wxyz_of
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.save import save_glb
from synfeal.objects.patches import Item, Patch, level, upright
from synfeal.render.surface import Layers

CAMERA = CameraConfig(width=120, height=16, horizontal_fov_deg=60.0)


def test_lights_add_up_in_linear_light(tmp_path):
    corners = ((4, 0), (0, 0), (0, 4), (4, 4), (4, 0))
    walls = [upright(a, b, 0, 3) for a, b in pairwise(corners)]
    grey = np.full((8, 8, 3), 230, np.uint8)
    patches = [Patch(points, grey) for points in [*walls, level((0, 4), (0, 4), 0)]]
    lamps = [
        Lamp((1.0, 2.0, 2.9), (0, 0, -1), (1.0, 0.8, 0.5)),
        Lamp((0.1, 2.0, 1.5), (1, 0, 0), (0.4, 0.6, 1.0), "daylight"),
    ]
    ambient = np.full((2, 2, 2, 3), 0.2, np.float32)
    lighting = Lighting((0, 0, 0), (4, 4, 3), ambient, lamps, None)
    surface = surface_of(np.random.default_rng(0), patches, 0.4)
    count = len(surface.points_m)
    dull = np.full((count, 3), 0.5, np.float32), np.zeros(count, np.float32)
    parts = [received(surface, *dull, lighting.of_group(group)) for group in LIGHT_GROUPS]
    np.testing.assert_allclose(sum(parts), received(surface, *dull, lighting), rtol=1e-5)
    assert all(part.max() > 0.05 for part in parts)

    scanner = Scanner(0.4, np.array([[2.0, 2.0, 1.5]]), (0, 0, 0), (4, 4, 3))
    ingredients = Item(tuple(patches)), lighting, scanner
    save_glb(tmp_path / "mesh.glb", scanned_mesh(np.random.default_rng(0), *ingredients))
    for group, mesh in light_shares(np.random.default_rng(0), *ingredients).items():
        save_glb(tmp_path / f"light_{group}.glb", mesh)
    pose = pose_matrix(rotation_from_rpy([0, 0.3, 2.0]), [2.5, 1.5, 1.5])
    poses = PoseTable(np.array([0]), np.array([0]), pose[None, :3, 3], quat_wxyz_of(pose)[None])

    def light(state):
        settings = {"light": {"states": [state]}}
        render = RenderConfig.model_validate({"backend": "raycast", "effects": settings})
        with open_scene(tmp_path / "mesh.glb", CAMERA, render) as renderer:
            (frame,) = drawn(renderer, poses, Layers(), effects_of(CAMERA, render))
        return effects.light_of(frame.rgb)

    whole, lamp, day = (light(state) for state in ("all", "lamps", "daylight"))
    # Half a level of 8 bits in each, where a level is at most a hundredth of white.
    np.testing.assert_allclose(lamp + day, whole, atol=0.012)
    assert (lamp - day).max() > 0.05 < (day - lamp).max()
    (tmp_path / "light_ambient.glb").unlink()
    with pytest.raises(InputError, match=r"light_ambient.glb: missing.*temperature_k"):
        light("night")
