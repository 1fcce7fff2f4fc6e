# %% [markdown]
# # Synfeal in ten lines
# A notebook in the percent format (Jupyter with jupytext, VS Code, PyCharm); the tests run it.
# `MESH` may be your own scan; here it is a painted box, so that nothing has to be downloaded.

# %%
from pathlib import Path

import numpy as np
import trimesh

import synfeal

MESH, OUT = Path("room.glb"), Path("mydata")
if not MESH.exists():
    box = trimesh.creation.box((6.0, 5.0, 3.0)).subdivide().subdivide()
    rng = np.random.default_rng(0)
    box.visual.vertex_colors = rng.integers(0, 256, (len(box.vertices), 4), np.uint8) | [
        0,
        0,
        0,
        255,
    ]
    box.export(MESH)

# %% [markdown]
# What a mesh is, and what a camera sees from the first pose of a plan in it.

# %%
mesh = synfeal.load_mesh(MESH, up_axis="z")
print("from", mesh.bounds_m[0], "to", mesh.bounds_m[1], "m")
options = {"up_axis": "z", "spacing": 0.2, "width": 160, "height": 120}
plan = synfeal.plan(MESH, frames=40, **options)
with synfeal.Renderer(mesh, width=160, height=120) as renderer:
    rgb, depth_m = renderer.render_rgbd(plan.world_from_cam[0])
print(rgb.shape, f"nearest surface at {depth_m.min():.2f} m")

# %% [markdown]
# A data set; options are those of `synfeal collect`.

# %%
data = synfeal.collect(MESH, OUT, frames=40, test_frames=10, depth=True, **options)
print(len(data.train), "training frames,", len(data.test), "test frames, camera", data.camera.width)
print("wrong with it:", synfeal.validate(OUT) or "nothing")

# %% [markdown]
# Poses of any localizer against it; here the true ones, off by 10 cm.

# %%
rows = (OUT / "test.csv").read_text().splitlines()
moved = [line.split(",") for line in rows[1:]]
moved = [[*row[:2], str(float(row[2]) + 0.1), *row[3:]] for row in moved]
Path("estimates.csv").write_text("\n".join([rows[0], *map(",".join, moved)]) + "\n")
print(synfeal.evaluate(OUT, "estimates.csv").metrics)
