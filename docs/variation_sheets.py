"""The contact sheets of variation.md: python docs/variation_sheets.py results/mini [NAME ...]"""

import sys
from functools import cache
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from reproduction.config.load import load_config
from reproduction.rooms import large_room
from reproduction.rooms.bake import light_shares
from synfeal.collection.prepare import cluttered, save_cartons
from synfeal.config.collection import ClutterConfig
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.config.effects import EffectsConfig
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.dataset.render_sequence import drawn
from synfeal.effects.scene import SceneRenderer, open_scene
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.render.surface import Layers

CAMERA, RENDER = CameraConfig(width=320, height=240), RenderConfig(backend="opengl")
SHOWN = (3, 10, 30, 47)  # paths of the test set, their second frame
PATHS = (53, 118)  # four frames are shown from each, with its own objects
TITLE_PX = 14


def main(root: Path, wanted: list[str]) -> None:
    """One row without and two with each effect of `robustness`, into docs/images."""
    settings = load_config(Path("config/config.yaml")).robustness.effects
    plan = read_pose_table(root / "plans/large_room/test.csv")
    poses = [plan.between(row, row + 1) for path in SHOWN for row in second_of(plan, path)]
    mesh = load_mesh(root / "scenes/large_room/mesh.glb")
    names = list(dict.fromkeys(key.rpartition("_")[0] for key in settings))
    for name in [name for name in [*names, "clutter", "paths"] if not wanted or name in wanted]:
        rows = [("ideal", None), *((key, settings.get(key)) for key in (f"{name}_1", f"{name}_2"))]
        sheet = [row_of(mesh, poses, *row) for row in rows if row[1] or row[0] == "ideal"]
        if name == "clutter":  # on the floor and on tables
            down = np.argsort(plan.world_from_cam[:, 2, 2])
            rows = [down[plan.path[down] == path][0] for path in dict.fromkeys(plan.path[down])]
            poses = [plan.between(int(row), int(row) + 1) for row in rows[: len(SHOWN)]]
            sheet = [row_of(mesh, poses, "ideal", None)]
            bounds = np.array([[0.7, 0.7, 0.9], [4.3, 5.9, 2.1]])
            rng = np.random.default_rng(0)
            objects, _ = cluttered(mesh, bounds, ClutterConfig(count=14), rng, "clutter")
            sheet.append(row_of(TexturedMesh((*mesh.parts, *objects.parts)), poses, name, None))
        if name == "paths":  # objects of their own: four positions of two paths
            save_cartons(root / "scenes/large_room/mesh.glb")
            sheet = path_rows(root, plan)
        file = Path(__file__).parent / f"images/variation_{name}.jpg"
        Image.fromarray(np.concatenate(sheet)).save(file, quality=85)


def path_rows(root: Path, plan: PoseTable) -> list:
    """Frames along some paths with what stands there (H, W, 3)."""
    effects = EffectsConfig.model_validate({"clutter": {"count": 12}})
    render = RENDER.model_copy(update={"effects": effects})
    sheet = []
    with open_scene(root / "scenes/large_room/mesh.glb", CAMERA, render) as renderer:
        for path in PATHS:
            first = int(np.flatnonzero(plan.path == path)[0])
            poses = plan.between(first, first + 10)
            frames = list(drawn(renderer, poses, Layers(), (CAMERA, effects)))
            sheet.append(np.hstack([frame.rgb for frame in frames[::3]]))
    return sheet


def second_of(plan: PoseTable, path: int) -> list[int]:
    """The second row of a path, which has moved."""
    return [int(np.flatnonzero(plan.path == path)[1])]


def row_of(mesh: TexturedMesh, poses: list[PoseTable], title: str, effects: EffectsConfig | None):
    """The frames side by side under a title (H, W, 3)."""
    through = (CAMERA, effects) if effects else None
    switched = effects and effects.light and effects.light.states
    shares = shares_of_the_room() if switched else None
    with SceneRenderer(mesh, CAMERA, RENDER, shares) as renderer:
        frames = [f.rgb for pose in poses for f in drawn(renderer, pose, Layers(), through)]
    row = Image.new("RGB", (CAMERA.width * len(frames), CAMERA.height + TITLE_PX))
    row.paste(Image.fromarray(np.hstack(frames)), (0, TITLE_PX))
    ImageDraw.Draw(row).text((4, 1), title, "white")
    return np.asarray(row)


@cache
def shares_of_the_room() -> dict[str, TexturedMesh]:
    """Measure how much of a room's light comes from each source."""
    return light_shares(*large_room.ingredients(0))


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
