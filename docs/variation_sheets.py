"""The contact sheets of variation.md: python docs/variation_sheets.py results/mini"""

import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from synfeal.config import load_config
from synfeal.config.models import CameraConfig, EffectsConfig, RenderConfig
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.dataset.render_sequence import drawn
from synfeal.mesh.load import load_mesh
from synfeal.render import open_renderer

CAMERA = CameraConfig(width=320, height=240)
SHOWN = (3, 10, 30, 47)  # paths of the test set, their second frame
TITLE_PX = 14


def main(root: Path) -> None:
    """One row without and two with each effect of `robustness`, into docs/images."""
    settings = load_config(Path("config/config.yaml")).robustness.effects
    plan = read_pose_table(root / "plans/large_room/test.csv")
    starts = [int(np.flatnonzero(plan.path == path)[1]) for path in SHOWN]
    poses = [plan.between(row, row + 1) for row in starts]
    mesh = load_mesh(root / "scenes/large_room/mesh.glb")
    with open_renderer(mesh, CAMERA, RenderConfig(backend="opengl")) as renderer:
        ideal = row_of(renderer, poses, "ideal", None)
        for name in dict.fromkeys(key.rpartition("_")[0] for key in settings):
            varied = [f"{name}_{strength}" for strength in (1, 2)]
            rows = [row_of(renderer, poses, key, settings[key]) for key in varied]
            sheet = Image.fromarray(np.concatenate([ideal, *rows]))
            sheet.save(Path(__file__).parent / f"images/variation_{name}.jpg", quality=85)


def row_of(renderer, poses: list[PoseTable], title: str, effects: EffectsConfig | None):
    """The frames side by side under a title (H, W, 3)."""
    through = (CAMERA, effects) if effects else None
    frames = [rgb for pose in poses for rgb, _ in drawn(renderer, pose, False, through)]
    row = Image.new("RGB", (CAMERA.width * len(frames), CAMERA.height + TITLE_PX))
    row.paste(Image.fromarray(np.hstack(frames)), (0, TITLE_PX))
    ImageDraw.Draw(row).text((4, 1), title, "white")
    return np.asarray(row)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
