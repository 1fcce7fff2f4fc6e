from pathlib import Path

from synfeal.config.models import CameraConfig
from synfeal.dataset.pose_table import read_pose_table
from synfeal.evaluation.reprojection import cell_depth_m, write_cell_depth
from synfeal.job import job
from synfeal.mesh.rays import RayCaster
from synfeal.mesh.triangles import load_collision_mesh

with job(snakemake.log[0]):
    caster = RayCaster(*load_collision_mesh(Path(snakemake.input.collision)))
    poses = read_pose_table(Path(snakemake.input.plan)).world_from_cam
    camera = CameraConfig(**snakemake.params.camera)
    write_cell_depth(Path(snakemake.output.depth), cell_depth_m(caster, camera, poses))
