"""Data sets of fisheye lenses and panoramas through every command, and through COLMAP."""

import json
import shutil

import numpy as np
import pandas as pd
import pycolmap
import pytest
from PIL import Image

import synfeal
from synfeal.camera.projection import pixels_per_radian, rays_of_pixels
from synfeal.cli import main
from synfeal.config.dataset import CameraConfig
from synfeal.exporting.run import export
from synfeal.geometry.poses import umeyama_sim3
from synfeal.geometry.rotations import quat_wxyz_from_matrix, rotation_angle_rad
from synfeal.mesh.save import save_glb
from tests.support.collected import collect, refused, save_room
from tests.support.small_room import furnished_room

BOX = (0.8, 4.2, 0.8, 3.2, 1.0, 1.8)
OPTIONS = {
    "fisheye": {"projection": "fisheye", "fov_deg": 150.0, "width": 240, "height": 180},
    "panorama": {"projection": "equirectangular", "width": 320},
}


@pytest.fixture(scope="module", params=OPTIONS)
def dataset(request, tmp_path_factory):
    """Ten frames of a furnished room, training and test."""
    folder = tmp_path_factory.mktemp(request.param)
    save_glb(folder / "room.glb", furnished_room((1.5, 4.0, 12.0)))
    return synfeal.collect(
        folder / "room.glb",
        folder / request.param,
        8,
        test_frames=2,
        depth=True,
        spacing_m=0.15,
        box=[BOX],
        **OPTIONS[request.param],
    )


def test_the_manifest_says_what_the_camera_is_and_depth_along_what(dataset):
    manifest = json.loads((dataset.path / "manifest.json").read_text())
    assert manifest["format"] == "7-Scenes; depth along the ray, millimetres, 65535 invalid"
    camera = manifest["camera"]
    assert camera["projection"] == OPTIONS[dataset.path.name]["projection"]
    assert ("fx" in camera) == (camera["projection"] == "fisheye")
    assert dataset.camera.projection == camera["projection"]
    assert len(dataset.train.images) == len(dataset.train.depths) == 8


def test_validate_finds_nothing_wrong_and_what_is(dataset):
    assert synfeal.validate(dataset.path) == []
    pose = dataset.path / "seq-01" / "frame-000003.pose.txt"
    sound = pose.read_text()
    rows = np.loadtxt(pose)
    rows[0, 3] += 0.05
    try:
        np.savetxt(pose, rows, delimiter="\t", fmt="%.10e")
        failed = {line.partition(":")[0] for line in synfeal.validate(dataset.path)}
    finally:
        pose.write_text(sound)
    assert {"depth", "alignment"} & failed


def test_validate_finds_depth_along_the_axis(dataset):
    """As a pinhole's: z, which is less than the distance."""
    rays = rays_of_pixels(
        dataset.camera,
        np.stack(
            np.meshgrid(
                np.arange(dataset.camera.width) + 0.5, np.arange(dataset.camera.height) + 0.5
            ),
            axis=-1,
        ),
    )
    before = {file: file.read_bytes() for file in (*dataset.train.depths, *dataset.test.depths)}
    try:
        for file in before:
            depth_mm = np.asarray(Image.open(file)).astype(float)
            Image.fromarray(np.round(depth_mm * np.abs(rays[..., 2])).astype(np.uint16)).save(file)
        failed = {line.partition(":")[0] for line in synfeal.validate(dataset.path)}
    finally:
        for file, content in before.items():
            file.write_bytes(content)
    assert "depth" in failed


def test_validate_finds_another_lens(dataset):
    if dataset.camera.projection != "fisheye":
        pytest.skip("a panorama has no parameters")
    manifest = dataset.path / "manifest.json"
    written = manifest.read_text()
    values = json.loads(written)
    values["camera"]["fx"] *= 1.02
    values["camera"]["fy"] *= 1.02
    try:
        manifest.write_text(json.dumps(values))
        failed = {line.partition(":")[0] for line in synfeal.validate(dataset.path)}
    finally:
        manifest.write_text(written)
    assert failed & {"camera", "alignment", "depth"}


def test_evaluate_returns_the_injected_error(dataset, tmp_path):
    table = pd.read_csv(dataset.path / "test.csv")
    table["tz"] += 0.03
    table.to_csv(tmp_path / "poses.csv", index=False)
    found = synfeal.evaluate(dataset.path, tmp_path / "poses.csv")
    np.testing.assert_allclose(found.errors["position_m"], 0.03, atol=1e-9)
    dcre = found.errors["dcre"]
    assert ((dcre > 1e-4) & (dcre < 0.05)).all()
    table["tz"] -= 0.03
    table.to_csv(tmp_path / "true.csv", index=False)
    np.testing.assert_allclose(
        synfeal.evaluate(dataset.path, tmp_path / "true.csv").errors["dcre"], 0.0, atol=1e-6
    )


def test_preview_and_nerfstudio(dataset, tmp_path):
    assert main(["preview", str(dataset.path), "--out", str(tmp_path / "a.gif")]) == 0
    export(dataset.path, "nerfstudio", tmp_path / "ns", False, None)
    written = json.loads((tmp_path / "ns" / "transforms.json").read_text())
    camera = dataset.camera
    pixel = np.array([[30.25, 41.5], [200.0, 120.5]])
    x, y = ((pixel - [written["cx"], written["cy"]]) / [written["fl_x"], written["fl_y"]]).T
    # The rays of nerfstudio's `Cameras`, whose y is up and z backward.
    if camera.projection == "equirectangular":
        assert written["camera_model"] == "EQUIRECTANGULAR"
        theta, phi = -np.pi * x, np.pi * (0.5 + y)
        rays = [-np.sin(theta) * np.sin(phi), np.cos(phi), -np.cos(theta) * np.sin(phi)]
    else:
        assert written["camera_model"] == "OPENCV_FISHEYE"
        assert [written[f"k{n}"] for n in (1, 2, 3, 4)] == [0.0] * 4
        theta = np.hypot(x, y)
        rays = [x * np.sin(theta) / theta, -y * np.sin(theta) / theta, -np.cos(theta)]
    ours = rays_of_pixels(camera, pixel) * [1.0, -1.0, -1.0]
    np.testing.assert_allclose(np.transpose(rays), ours, atol=1e-12)


def test_formats_without_such_a_camera_refuse_in_one_line(dataset, tmp_path, capfd):
    kinds = ["ace", "tum", "rosbag"] + ["hloc"] * (dataset.camera.projection == "equirectangular")
    for kind in kinds:
        said = refused(capfd, "export", dataset.path, "--to", kind, "--out", tmp_path / kind)
        assert f"this one is {dataset.camera.projection}" in said
        assert not (tmp_path / kind).exists()


def reconstructed(exported, work):
    """COLMAP's model from the images alone, the camera known, on the true scale and place."""
    truth = pycolmap.Reconstruction(exported / "sparse" / "0")
    (camera,) = truth.cameras.values()
    reader = pycolmap.ImageReaderOptions()
    reader.camera_model = camera.model_name
    reader.camera_params = ",".join(map(repr, camera.params.tolist()))
    if (exported / "camera_mask.png").is_file():
        reader.camera_mask_path = exported / "camera_mask.png"
    extraction = pycolmap.FeatureExtractionOptions(num_threads=1, use_gpu=False)
    extraction.sift.max_num_features = 1000
    database, cpu = work / "database.db", pycolmap.Device.cpu
    pycolmap.extract_features(
        database,
        exported / "images",
        camera_mode=pycolmap.CameraMode.SINGLE,
        reader_options=reader,
        extraction_options=extraction,
        device=cpu,
    )
    matching = pycolmap.FeatureMatchingOptions(num_threads=1, use_gpu=False)
    pycolmap.match_exhaustive(database, matching_options=matching, device=cpu)
    options = pycolmap.IncrementalPipelineOptions(
        num_threads=1,
        random_seed=0,
        ba_refine_focal_length=False,
        ba_refine_principal_point=False,
        ba_refine_extra_params=False,
    )
    options.mapper.abs_pose_refine_focal_length = False
    options.mapper.abs_pose_refine_extra_params = False
    models = pycolmap.incremental_mapping(database, exported / "images", work, options=options)
    model = max(models.values(), key=lambda found: found.num_reg_images())
    return truth, model


def poses_by_name(model):
    return {
        image.name: image.cam_from_world().inverse().matrix()
        for image in model.images.values()
        if image.has_pose
    }


def test_colmap_reconstructs_the_exact_poses(dataset, tmp_path):
    export(dataset.path, "colmap", tmp_path / "exported", False, None)
    truth, model = reconstructed(tmp_path / "exported", tmp_path)
    expected, found = poses_by_name(truth), poses_by_name(model)
    assert len(found) == len(expected) == 10
    a = np.stack([found[name] for name in sorted(found)])
    b = np.stack([expected[name] for name in sorted(found)])
    scale, rotation, shift = umeyama_sim3(a[:, :, 3], b[:, :, 3])
    moved = scale * a[:, :, 3] @ rotation.T + shift
    error_m = np.linalg.norm(moved - b[:, :, 3], axis=1)
    assert np.ptp(b[:, :, 3], axis=0).max() > 0.5
    assert np.median(error_m) < 1.5e-3
    # Relative rotations: those of the whole are poorly known from centres on a line.
    turned = [np.swapaxes(p[:1, :, :3], 1, 2) @ p[1:, :, :3] for p in (a, b)]
    angle_rad = rotation_angle_rad(*map(quat_wxyz_from_matrix, turned))
    assert np.median(angle_rad) * min(pixels_per_radian(dataset.camera)) < 0.1  # of a pixel


def test_colmap_projects_as_we_do(dataset, tmp_path):
    export(dataset.path, "colmap", tmp_path / "exported", False, None)
    (camera,) = pycolmap.Reconstruction(tmp_path / "exported" / "sparse" / "0").cameras.values()
    middle = np.array([dataset.camera.width, dataset.camera.height]) / 2
    pixel = middle + np.random.default_rng(0).uniform(-60, 60, (50, 2))
    ours = rays_of_pixels(dataset.camera, pixel)
    np.testing.assert_allclose(camera.cam_ray_from_img(pixel), ours, atol=1e-9)


def test_calibrations_of_fisheye_lenses_are_read(tmp_path):
    """The same lens as Kalibr, COLMAP and our own manifest write it."""
    k = [0.0034823894, 0.0007150348, -0.0020532361, 0.0002029367]
    (tmp_path / "lens.yaml").write_text(
        "image_width: 512\nimage_height: 512\ndistortion_model: equidistant\n"
        f"camera_matrix: {{rows: 3, cols: 3, data: [190.9, 0, 254.4, 0, 190.8, 256.4, 0, 0, 1]}}\n"
        f"distortion_coefficients: {{rows: 1, cols: 4, data: {k}}}\n"
    )
    coefficients = " ".join(map(repr, k))
    (tmp_path / "cameras.txt").write_text(
        f"1 OPENCV_FISHEYE 512 512 190.9 190.8 254.9 256.9 {coefficients}\n"
    )
    cameras = [
        CameraConfig.model_validate({"calibration": tmp_path / name, "width": 256, "height": 256})
        for name in ("lens.yaml", "cameras.txt")
    ]
    assert cameras[0] == cameras[1]
    assert cameras[0].projection == "fisheye"
    assert cameras[0].fisheye_k == tuple(k)
    np.testing.assert_allclose(cameras[0].intrinsics, [95.45, 95.4, 127.45, 128.45])
    (tmp_path / "own.json").write_text(json.dumps({"camera": cameras[0].record}))
    assert CameraConfig(calibration=tmp_path / "own.json") == cameras[0]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--projection", "equirectangular", "--width", 64, "--height", 64), "twice as wide"),
        (("--projection", "equirectangular", "--fov", 90), "--fov: an equirectangular image"),
        (("--fov", 170), "--fov: must be below 170"),
        (("--fisheye-k", 0, 0, 0, 0), "--fisheye-k: goes with the projection fisheye"),
        (("--projection", "fisheye", "--fisheye-k", -0.2, 0, 0, 0), "--fov: with these"),
        (("--projection", "fisheye", "--fov", 361), "--fov"),
        (("--projection", "fisheye", "--width", 8192, "--height", 4096, "--fov", 20), "smaller"),
    ],
)
def test_careless_cameras_are_refused_in_one_line(options, said, tmp_path, capfd):
    mesh = save_room(tmp_path / "room.glb")
    out = tmp_path / "out"
    assert said in refused(capfd, "collect", mesh, "--frames", 4, "--out", out, *options)
    assert not out.exists()


def test_a_fisheye_calibration_is_refused_where_a_pinhole_is_needed(dataset, tmp_path, capfd):
    if dataset.camera.projection != "fisheye":
        pytest.skip("a panorama has no calibration")
    copy = tmp_path / "sequence"
    shutil.copytree(dataset.path / "seq-01", copy)
    lens = dataset.path / "manifest.json"
    out = tmp_path / "scan.glb"
    said = refused(capfd, "scan", copy, "--out", out, "--color-camera", lens)
    assert "a perspective one is needed" in said


def test_effects_act_on_wide_images_too(tmp_path):
    mesh = save_room(tmp_path / "room.glb")
    effects = tmp_path / "effects.yaml"
    effects.write_text("share: 1.0\nlight: {ev: [-1, 1], field_ev: 0.5}\nnoise: {}\n")
    wide = ("--projection", "equirectangular", "--width", "80", "--height", "40")
    assert collect(mesh, tmp_path / "out", *wide, "--effects", str(effects), "--depth") == 0
    assert len(synfeal.open_dataset(tmp_path / "out").train) == 24
