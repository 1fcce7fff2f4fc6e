"""Fisheye lenses and panoramas: pixels as OpenCV and COLMAP have them, depth as Open3D casts it."""

import functools
import os
from pathlib import Path

import cv2
import numpy as np
import open3d as o3d
import pycolmap
import pytest
import trimesh

from synfeal.camera.fisheye import largest_angle_rad
from synfeal.camera.projection import (
    depth_of_points,
    horizontal_fov_rad,
    pixel_offset,
    pixels_of_points,
    rays_of_pixels,
)
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.geometry.poses import pose_matrix
from synfeal.geometry.rotations import rotation_from_rpy
from synfeal.mesh.load import load_mesh
from synfeal.mesh.model import TexturedMesh
from synfeal.render import open_renderer
from synfeal.render.cube import CubeRenderer
from tests.support.collected import painted
from tests.support.small_room import BACKENDS, PYOPENGL_WARNS, furnished_room, room_poses

# Of a real lens: camera 1 of the TUM VI benchmark, resized.
REAL_K = (0.0034823894, 0.0007150348, -0.0020532361, 0.0002029367)
FISHEYE = CameraConfig(
    projection="fisheye",
    width=128,
    height=120,
    fx=47.8,
    fy=47.7,
    cx=63.7,
    cy=60.2,
    fisheye_k=REAL_K,
)
ALL_ROUND = CameraConfig(projection="fisheye", width=100, height=100, horizontal_fov_deg=220.0)
PANORAMA = CameraConfig(projection="equirectangular", width=160)
CAMERAS = {"fisheye": FISHEYE, "all round": ALL_ROUND, "panorama": PANORAMA}
each_camera = pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS)
# Share of the pixels whose depth is one of those within the pixel: in the scan leaves and struts
# are thinner than that.
WITHIN = {"room": 0.998, "balls": 0.998, "greenhouse": 0.98}
AROUND_PX = 0.5 * np.array([[x, y] for x in (-1, 0, 1) for y in (-1, 0, 1) if x or y])
AHEAD = pose_matrix(rotation_from_rpy([0.0, 0.0, 0.0]), [0.0, 0.0, 0.0])


def pixel_centres(camera):
    column, row = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    return np.stack([column, row], axis=-1)


def rays_by_others(camera):
    """Rays (H, W, 3) of unit length: OpenCV's up to 80 degrees, COLMAP's of panoramas; else NaN."""
    pixel = pixel_centres(camera).reshape(-1, 2)
    if camera.projection == "equirectangular":
        size = (camera.width, camera.height)
        theirs = pycolmap.Camera(
            model="EQUIRECTANGULAR", width=size[0], height=size[1], params=list(size)
        )
        rays = theirs.cam_ray_from_img(pixel)
    else:
        matrix = camera.intrinsics.matrix(centre_shift_px=-0.5)
        lens = np.array(camera.fisheye_k or (0.0,) * 4)
        slope = cv2.fisheye.undistortPoints(pixel[:, None] - 0.5, matrix, lens)[:, 0]
        rays = np.column_stack([slope, np.ones(len(slope))])
        rays /= np.linalg.norm(rays, axis=1, keepdims=True)
        near = np.linalg.norm((pixel - matrix[:2, 2] - 0.5) / camera.intrinsics[0], axis=1) < 1.35
        rays[~near] = np.nan
    return rays.reshape(camera.height, camera.width, 3)


@each_camera
def test_pixels_look_where_opencv_and_colmap_say(camera):
    theirs = rays_by_others(camera)
    ours = rays_of_pixels(camera, pixel_centres(camera))
    known = np.isfinite(theirs).all(axis=-1)
    assert known.mean() > 0.25
    np.testing.assert_allclose(ours[known], theirs[known], atol=1e-8)


@pytest.mark.parametrize("camera", [FISHEYE, ALL_ROUND], ids=["fisheye", "all round"])
def test_points_ahead_appear_where_opencv_projects_them(camera):
    points = np.random.default_rng(0).uniform([-3, -3, 0.3], [3, 3, 4], (200, 3))
    matrix = camera.intrinsics.matrix(centre_shift_px=-0.5)
    lens = np.array(camera.fisheye_k or (0.0,) * 4)
    theirs = cv2.fisheye.projectPoints(points[:, None], np.zeros(3), np.zeros(3), matrix, lens)[0]
    np.testing.assert_allclose(pixels_of_points(camera, points), theirs[:, 0] + 0.5, atol=1e-9)


def test_a_lens_may_see_behind_itself():
    """Radii of an equidistant lens are angles: 135 degrees are 3/4 pi focal lengths."""
    focal = 50.0 / np.radians(110.0)
    behind = np.array([[1.0, 0.0, -1.0], [0.0, -1.0, -1.0], [0.0, 0.0, 1.0]])
    reach = focal * 0.75 * np.pi
    expected = [[50.0 + reach, 50.0], [50.0, 50.0 - reach], [50.0, 50.0]]
    np.testing.assert_allclose(pixels_of_points(ALL_ROUND, behind), expected, atol=1e-12)
    assert np.isclose(horizontal_fov_rad(ALL_ROUND), np.radians(220.0))
    assert np.isclose(horizontal_fov_rad(PANORAMA), 2 * np.pi)


@each_camera
def test_pixels_and_rays_are_inverse_to_each_other(camera):
    pixel = pixel_centres(camera)
    rays = rays_of_pixels(camera, pixel)
    shown = np.isfinite(rays).all(axis=-1)
    np.testing.assert_allclose(pixels_of_points(camera, 2.5 * rays)[shown], pixel[shown], atol=1e-9)
    np.testing.assert_allclose(depth_of_points(camera, 2.5 * rays)[shown], 2.5, atol=1e-12)


def test_a_panorama_goes_round():
    left, right = np.array([1.0, 40.0]), np.array([159.0, 40.0])
    np.testing.assert_allclose(pixel_offset(PANORAMA, left, right), [-2.0, 0.0])
    np.testing.assert_allclose(pixel_offset(FISHEYE, left, right), [158.0, 0.0])


def test_beyond_its_fold_a_lens_shows_the_background():
    """Slope 1 - 0.6 t² vanishes at t = 1.291, shown at 2/3 of it."""
    lens = {"projection": "fisheye", "fisheye_k": (-0.2, 0.0, 0.0, 0.0)}
    camera = CameraConfig(width=96, height=96, fx=40, fy=40, cx=48, cy=48, **lens)
    assert np.isclose(largest_angle_rad(camera.fisheye_k), np.sqrt(1 / 0.6))
    edge_px = 40 * np.sqrt(1 / 0.6) * 2 / 3
    radius = np.hypot(*np.moveaxis(pixel_centres(camera) - 48.0, -1, 0))
    rays = rays_of_pixels(camera, pixel_centres(camera))
    np.testing.assert_array_equal(np.isnan(rays).any(axis=-1), radius >= edge_px)
    room = painted(trimesh.creation.box((4.0, 4.0, 4.0)), (200, 200, 200))
    with open_renderer(room, camera, RenderConfig(background_rgb=(10, 20, 30))) as renderer:
        seen, depth_m = renderer.render_rgbd(AHEAD)
    outside = radius > edge_px + 1.0
    np.testing.assert_array_equal(seen[outside], np.tile([10, 20, 30], (outside.sum(), 1)))
    assert np.isinf(depth_m[outside]).all()
    inside = radius < edge_px - 1.0
    assert (np.abs(seen[inside].astype(int) - 200) <= 1).all()
    assert np.isfinite(depth_m[inside]).all()


@functools.cache
def scene_of(name):
    """A furnished room, a room of balls, and a scan as its author published it."""
    if name == "room":
        return furnished_room((4.0, 12.0)), room_poses(2, 5)
    if name == "balls":
        rng = np.random.default_rng(3)
        balls = [painted(trimesh.creation.box((6.0, 5.0, 3.0)))]
        for place in rng.uniform([-2.5, -2, -1], [2.5, 2, 1], (12, 3)):
            ball = trimesh.creation.icosphere(subdivisions=3, radius=0.3)
            ball.apply_translation(place + 0.8 * place / np.linalg.norm(place))
            balls.append(painted(ball))
        mesh = TexturedMesh(tuple(part for ball in balls for part in ball.parts))
        return mesh, room_poses(2, 5) @ pose_matrix(np.eye(3), [0.0, 0.0, 0.0])
    folder = os.environ.get("SYNFEAL_TEST_MESHES")
    path = Path(folder or ".") / "botanists-greenhouse" / "scene.gltf"
    if not path.is_file():
        pytest.skip("SYNFEAL_TEST_MESHES has no botanists-greenhouse")
    mesh = load_mesh(path)
    middle = mesh.bounds_m.mean(axis=0)
    poses = [pose_matrix(rotation_from_rpy([0.1, 0.2, yaw]), middle) for yaw in (0.4, 2.5)]
    return mesh, np.stack(poses)


def centred(name):
    """The scene with its poses where they are inside."""
    mesh, poses = scene_of(name)
    if name == "balls":
        poses = poses.copy()
        poses[:, :3, 3] -= [2.5, 1.8, 1.5]
    return mesh, poses


def solid(mesh):
    """The parts that are drawn without holes, which a ray caster knows nothing of."""
    return TexturedMesh(tuple(p for p in mesh.parts if p.is_drawn and p.alpha_cutoff is None))


def cast(scene, world_from_cam, rays):
    """Distances along rays (..., 3) of unit length, by Open3D."""
    world = rays @ world_from_cam[:3, :3].T
    start = np.broadcast_to(world_from_cam[:3, 3], world.shape)
    six = np.concatenate([start, world], axis=-1).astype(np.float32)
    return scene.cast_rays(o3d.core.Tensor(six))["t_hit"].numpy()


@each_camera
@pytest.mark.parametrize("name", ["room", "balls", "greenhouse"])
def test_depth_is_the_distance_along_the_ray(name, camera):
    mesh, poses = centred(name)
    mesh = solid(mesh)
    vertices, faces = mesh.merged()
    shift = vertices.mean(axis=0)
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor((vertices - shift).astype(np.float32)),
        o3d.core.Tensor(faces.astype(np.uint32)),
    )
    ours, theirs = rays_of_pixels(camera, pixel_centres(camera)), rays_by_others(camera)
    neighbours = [rays_of_pixels(camera, pixel_centres(camera) + offset) for offset in AROUND_PX]
    with open_renderer(mesh, camera) as renderer:
        for pose in poses:
            found = renderer.render_rgbd(pose)[1]
            np.testing.assert_array_equal(renderer.render_depth(pose), found)
            moved = pose.copy()
            moved[:3, 3] -= shift
            # Where others have a ray, theirs; behind the lens, ours.
            rays = np.where(np.isfinite(theirs), theirs, ours)
            expected = cast(scene, moved, rays)
            around = [cast(scene, moved, neighbour) for neighbour in neighbours]
            low = np.minimum.reduce([*around, expected])
            high = np.maximum.reduce([*around, expected])
            seen = np.isfinite(expected) & (expected > 0.1) & np.isfinite(high)
            assert seen.mean() > 0.3
            # At an edge depth is that of one of the two surfaces within the pixel.
            between = (found >= low - 2e-3) & (found <= high + 2e-3)
            assert between[seen].mean() > WITHIN[name]
            smooth = np.where(seen, high, np.inf) < low + 0.02 * np.where(seen, expected, 0.0)
            error_m = np.abs(found[smooth] - expected[smooth])
            assert np.median(error_m) < 1e-5
            assert np.quantile(error_m, 0.95) < 0.01


class PaintedSky:
    """Colours that are a function of the direction in the world."""

    def __init__(self, camera, samples=4):
        self.camera, self.samples = camera, samples

    def render(self, world_from_cam):
        steps = (np.arange(self.samples) + 0.5) / self.samples - 0.5
        total = 0.0
        for offset in np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2):
            rays = rays_of_pixels(self.camera, pixel_centres(self.camera) + offset)
            total = total + sky(rays @ world_from_cam[:3, :3].T)
        return np.rint(total / self.samples**2).astype(np.uint8)

    def draw_only(self, window):
        """All is drawn."""


def sky(direction):
    """Colour (..., 3) of directions: waves some pixels long, without edges."""
    unit = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    waves = np.array([[9.0, 4.0, -5.0], [-3.0, 10.0, 6.0], [5.0, -7.0, 9.0]])
    return 127.5 + 100.0 * np.sin(unit @ waves.T)


@each_camera
def test_colours_are_nearly_those_of_64_rays(camera):
    pose = room_poses(3, 1)[1]
    expected = PaintedSky(camera, samples=8).render(pose).astype(float)
    found = CubeRenderer(PaintedSky, camera, (0, 0, 0)).render(pose)
    error = found - expected
    assert np.sqrt((error**2).mean()) < 0.03 * expected.std()
    assert np.abs(error).max() < 0.15 * 255  # nowhere another face's colour
    assert abs(error.mean()) < 0.1


@each_camera
def test_faces_of_the_cube_leave_no_seam(camera):
    room = painted(trimesh.creation.box((4.0, 4.0, 4.0)), (200, 200, 200))
    with open_renderer(room, camera) as renderer:
        seen, depth_m = renderer.render_rgbd(AHEAD)
    assert (seen.shape, seen.dtype) == ((camera.height, camera.width, 3), np.uint8)
    assert (np.abs(seen.astype(int) - 200) <= 1).all()
    direction = np.abs(rays_of_pixels(camera, pixel_centres(camera)))
    inside = np.sort(direction, axis=-1)[..., 1] < 0.9 * direction.max(axis=-1)
    np.testing.assert_allclose(depth_m[inside], (2.0 / direction.max(axis=-1))[inside], atol=1e-3)


NARROW = CameraConfig(projection="fisheye", width=96, height=72, horizontal_fov_deg=120.0)


class Everything:
    """A renderer that draws all of every image."""

    def __init__(self, inner):
        self.inner = inner

    def __getattr__(self, name):
        return getattr(self.inner, name)

    def draw_only(self, window):
        """All is drawn."""


@pytest.mark.filterwarnings(PYOPENGL_WARNS)
@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize("camera", [NARROW, ALL_ROUND], ids=["narrow", "all round"])
def test_what_is_not_seen_of_a_face_is_not_drawn_and_changes_nothing(camera, backend):
    mesh, poses = furnished_room((4.0, 12.0)), room_poses(2, 5)
    render = RenderConfig(backend=backend, background_rgb=(9, 99, 199))

    def opened(face):
        return open_renderer(mesh, face, render)

    asked = []

    class Asked(Everything):
        def draw_only(self, window):
            asked.append((window, self.inner.render(AHEAD).shape))
            self.inner.draw_only(window)

    with (
        CubeRenderer(opened, camera, render.background_rgb) as windowed,
        CubeRenderer(lambda face: Everything(opened(face)), camera, render.background_rgb) as full,
    ):
        for pose in poses:
            for draw in ("render", "render_depth", "render_faces"):
                expected = getattr(full, draw)(pose)
                np.testing.assert_array_equal(getattr(windowed, draw)(pose), expected)
    with CubeRenderer(lambda face: Asked(opened(face)), camera, render.background_rgb) as counted:
        counted.render_depth(AHEAD)
    shares = [
        (window.right - window.left) * (window.bottom - window.top) / (shape[0] * shape[1])
        for window, shape in asked
    ]
    assert len(shares) == (5 if camera is NARROW else 6)
    if camera is NARROW:  # the whole face ahead, and four strips
        assert max(shares) == 1.0
        assert sum(shares) < 2.5


def test_antialiasing_is_that_of_perspective_images():
    """Mean error against 4 x 4 times the pixels, beside that of a perspective camera."""
    mesh, poses = furnished_room((4.0, 12.0)), room_poses(1, 0)
    errors = {}
    plain = CameraConfig(width=96, height=72, horizontal_fov_deg=80.0)
    for name, camera in {"plain": plain, "panorama": PANORAMA, "fisheye": FISHEYE}.items():
        larger = {"width": 4 * camera.width, "height": 4 * camera.height}
        if camera.projection != "equirectangular":
            larger |= {key: 4 * value for key, value in camera.intrinsics._asdict().items()}
        finer = camera.model_copy(update=larger)
        errors[name] = []
        with open_renderer(mesh, finer, RenderConfig(supersampling=2)) as fine:
            truth = [fine.render(pose) for pose in poses]
        with open_renderer(mesh, camera) as renderer:
            for pose, image in zip(poses, truth, strict=True):
                shape = (camera.height, 4, camera.width, 4, 3)
                mean = image.reshape(shape).mean(axis=(1, 3))
                errors[name].append(np.abs(renderer.render(pose) - mean).mean())
    assert np.mean(errors["panorama"]) < 2.0 * np.mean(errors["plain"])
    assert np.mean(errors["fisheye"]) < 2.0 * np.mean(errors["plain"])
