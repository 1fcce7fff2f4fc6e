"""Effects of camera and light against the physics they stand for."""

from itertools import pairwise

import numpy as np
import pandas as pd
import pytest
import yaml

from synfeal.cli import main
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.config.effects import EffectsConfig
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.dataset.render_sequence import drawn
from synfeal.dataset.sevenscenes import frame_paths, read_split
from synfeal.effects import light as effects
from synfeal.records.files import file_sha256, read_json
from synfeal.render.surface import Layers
from tests.support.collected import collect, save_room

CAMERA = CameraConfig(width=120, height=16, horizontal_fov_deg=60.0)
FOCAL = 60 / np.tan(np.radians(30))
WALL_M, PERIOD_M, STEP_M = 2.0, 0.1, 0.03


def along_x(count, per_path=100):
    """A camera that looks along world y at a wall and moves along x, upright."""
    index = np.arange(count)
    position = np.column_stack([STEP_M * index, 0 * index, 0 * index]).astype(float)
    quat = np.tile([np.sqrt(0.5), -np.sqrt(0.5), 0.0, 0.0], (count, 1))  # z forward to world y
    return PoseTable(index, index // per_path, position, quat)


class Wall:
    """A wall at y = 2 m whose light is a sine along x; counts the frames it draws."""

    def __init__(self, mean=0.4, depth=0.3, brighter_at=10**9):
        self.mean, self.depth, self.brighter_at, self.drawn = mean, depth, brighter_at, 0

    def light(self, x_m):
        column = np.arange(CAMERA.width) + 0.5 - CAMERA.width / 2
        at = np.asarray(x_m)[..., None] + WALL_M * column / FOCAL
        light = self.mean + self.depth * np.sin(2 * np.pi * at / PERIOD_M)
        return light * np.where(np.asarray(x_m)[..., None] >= self.brighter_at * STEP_M, 2.0, 1.0)

    def render(self, world_from_cam):
        self.drawn += 1
        row = effects.rgb_of(self.light(world_from_cam[0, 3]).astype(np.float32))
        return np.broadcast_to(row[None, :, None], (CAMERA.height, CAMERA.width, 3)).copy()

    def render_rgbd(self, world_from_cam):
        shape = CAMERA.height, CAMERA.width
        return self.render(world_from_cam), np.full(shape, WALL_M, np.float32)


def frames(renderer, poses, **effects):
    config = EffectsConfig.model_validate(effects)
    return [frame.rgb for frame in drawn(renderer, poses, Layers(), (CAMERA, config))]


def test_every_level_survives_the_way_to_light_and_back():
    levels = np.arange(256, dtype=np.uint8)
    assert (effects.rgb_of(effects.light_of(levels)) == levels).all()
    # IEC 61966-2-1: mid grey reflects 18 % at level 118, and half the light is level 188.
    assert effects.light_of(np.uint8(118)) == pytest.approx(0.18, abs=2e-3)
    assert effects.rgb_of(np.float32(0.5)) == 188


def test_blur_is_the_integral_of_the_light_over_the_exposure():
    # 30 mm and 0.06 s between frames; 0.06 s of exposure is 30 mm of the wall's sine of 0.1 m.
    wall = Wall()
    blur = {"motion_blur": {"exposure_s": 0.06, "subframes": 16}, "speed_m_s": 0.5}
    found = frames(wall, along_x(3), **blur)
    half = np.pi * 0.06 * 0.5 / PERIOD_M
    for index, rgb in enumerate(found):
        sine = wall.light(index * STEP_M) - wall.mean
        expected = wall.mean + sine * np.sin(half) / half
        np.testing.assert_allclose(effects.light_of(rgb[0, :, 0]), expected, atol=4e-3)
    assert wall.drawn == 3 * 16


@pytest.mark.parametrize("constant_s", [0.1, 1.0])
def test_auto_exposure_lags_by_its_time_constant(constant_s):
    config = EffectsConfig.model_validate({"exposure": {"time_constant_s": constant_s}}).exposure
    meter, frame_s = effects.AutoExposure(config), 0.05
    grey = [np.full((2, 2, 3), level, np.float32) for level in (0.18, 0.36)]
    assert meter.next_ev(grey[0], frame_s) == pytest.approx(0.0, abs=1e-6)
    meter.next_ev(grey[1], frame_s)  # metered now, acts from the next frame on
    found = [meter.next_ev(grey[1], frame_s) for _ in range(10)]
    elapsed = frame_s * np.arange(1, 11)
    np.testing.assert_allclose(found, np.exp(-elapsed / constant_s) - 1, atol=1e-6)


@pytest.mark.parametrize("level", [0.05, 0.3, 0.7])
def test_noise_has_the_mean_and_variance_of_the_photon_transfer_curve(level):
    config = EffectsConfig.model_validate({"noise": {"full_well_e": 2000, "read_e": 12}}).noise
    light = np.full((500, 500, 1), level, np.float32)
    electrons = 2000 * effects.with_noise(light, config, np.random.default_rng(1)).astype(
        np.float64
    )
    variance = 2000 * level + 12**2
    assert electrons.mean() == pytest.approx(2000 * level, abs=4 * np.sqrt(variance / 250_000))
    assert electrons.var() == pytest.approx(variance, rel=4 * np.sqrt(2 / 250_000))


def test_white_balance_and_exposure_are_factors_on_light():
    wall = Wall(0.2, 0.1)
    ideal = effects.light_of(wall.render(along_x(1).world_from_cam[0]))
    (brighter,) = frames(wall, along_x(1), exposure={"ev": 1})
    np.testing.assert_allclose(effects.light_of(brighter), 2 * ideal, atol=4e-3)
    np.testing.assert_allclose(effects.channel_gains(6500), 1, atol=1e-6)
    # IEC 61966-2-1: XYZ of linear sRGB; the locus at 6500 K is at x 0.3135, y 0.3237; CIE
    # illuminant A, 2856 K, at 0.4476, 0.4074.
    xyz_from_rgb = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    daylight = np.linalg.solve(xyz_from_rgb, [0.3135 / 0.3237, 1, 0.3628 / 0.3237])
    tristimulus = xyz_from_rgb @ (effects.channel_gains(2856) * daylight)
    np.testing.assert_allclose(tristimulus[:2] / tristimulus.sum(), [0.4476, 0.4074], atol=2e-3)
    (blue,) = frames(wall, along_x(1), white_balance_k=3200)
    assert blue[..., 2].mean() > blue[..., 0].mean() + 20


def test_light_differs_from_path_to_path_and_stays_within_its_bounds():
    light = {"ev": [-2, 1], "temperature_k": [2700, 7500], "field_ev": 0.5}
    config = EffectsConfig.model_validate({"light": light}).light
    states = [effects.drawn_light(config, np.random.default_rng(seed)) for seed in range(400)]
    ev, kelvin = np.array([(s.ev, s.temperature_k) for s in states]).T
    assert ev.min() < -1.9 < 0.9 < ev.max()
    assert (ev >= -2).all() & (ev <= 1).all() & (kelvin >= 2700).all() & (kelvin <= 7500).all()
    field = [np.log2(s.field(np.zeros((1, 3), np.float32))) for s in states]
    assert np.std(field) == pytest.approx(0.5, rel=0.12)


ALL = {
    "share": 0.7,
    "light": {"ev": [-1, 1], "temperature_k": [3000, 8000], "field_ev": 0.4},
    "motion_blur": {"exposure_s": 0.02, "subframes": 3},
    "exposure": {"time_constant_s": 0.2},
    "noise": {},
    "white_balance_k": 5000,
    "jpeg_quality": 60,
}  # fmt: skip


@pytest.mark.parametrize("cuts", [[0, 1, 2, 30], [0, 13, 17, 30], [0, 9, 10, 11, 12, 29, 30]])
def test_shards_agree_to_the_byte(cuts):
    poses = along_x(30, per_path=11)
    whole = frames(Wall(brighter_at=15), poses, **ALL)
    parts = [poses.between(a, b) for a, b in pairwise(cuts)]
    again = [rgb for part in parts for rgb in frames(Wall(brighter_at=15), part, **ALL)]
    np.testing.assert_array_equal(whole, again)
    assert len({rgb.tobytes() for rgb in whole}) == 30


def test_without_effects_nothing_is_recorded_or_drawn_anew():
    assert set(RenderConfig().model_dump()) == {
        "backend",
        "supersampling",
        "detail",
        "background_rgb",
    }
    wall, poses = Wall(), along_x(4)
    ideal = [frame.rgb for frame in drawn(wall, poses, Layers(), None)]
    assert wall.drawn == 4
    np.testing.assert_array_equal(ideal, [wall.render(pose) for pose in poses.world_from_cam])
    np.testing.assert_array_equal(frames(wall, poses, light={}), ideal)


def test_collected_with_effects_the_same_in_other_shards_and_workers(tmp_path):
    mesh, settings = save_room(tmp_path / "room.glb"), tmp_path / "effects.yaml"
    settings.write_text(yaml.safe_dump({**ALL, "share": 1.0}))
    one, other = tmp_path / "one", tmp_path / "other"
    assert collect(mesh, one, "--effects", str(settings), "--depth") == 0
    apart = ("--sequence-frames", "7", "--cores", "2")
    assert collect(mesh, other, "--effects", str(settings), "--depth", *apart) == 0
    found, again = ([path.read_bytes() for path in color_files(out)] for out in (one, other))
    assert found == again
    assert len(set(found)) == 32
    table = pd.read_csv(one / "train.effects.csv")
    poses = read_pose_table(one / "train.csv")
    assert table.frames.sum() == len(poses)
    assert (table.ev.abs() <= 1).all()
    manifest = read_json(one / "manifest.json")
    assert manifest["render"]["effects"]["motion_blur"]["subframes"] == 3
    assert manifest["effects_sha256"]["train.effects.csv"] == file_sha256(one / "train.effects.csv")
    assert main(["validate", str(one)]) == 0


def color_files(dataset):
    sequences = [at for split in ("train", "test") for at in read_split(dataset, split)]
    return frame_paths(sequences, "color.png")
