"""Benchmarks of trainings: the plain loop is the same mathematics, and rows are neither lost."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from PIL import Image
from scipy.spatial.transform import Rotation

from baselines.localizers.losses import DISTANCES
from baselines.localizers.registry import build_localizer
from baselines.training.data import image_statistics, read_labelled_frames
from baselines.training.optimizer import Schedule
from benchmarks import images_shown, learners, pretraining, protocols
from benchmarks.plain_training import ImageFiles
from benchmarks.rgbd_settings.results import append_row
from benchmarks.training_case import PUBLISHED, Case
from benchmarks.training_pages import chosen, with_range, write_page
from benchmarks.training_speed import largest_difference
from benchmarks.trainings import key_of, measure_missing, read_rows, training_of
from synfeal.config import load_config
from synfeal.config.models import MODELS, LocalizerConfig, NetworkConfig
from synfeal.dataset.packed import pack_frames
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from tests.report_results import CONFIG

N_FRAMES, INPUT_PX = 6, 32


@pytest.fixture(scope="module")
def config():
    return load_config(CONFIG / "config.yaml")


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """Frames of noise, as files and packed, and a narrow network."""
    folder, rng = tmp_path_factory.mktemp("frames"), np.random.default_rng(0)
    turns = Rotation.random(N_FRAMES, rng=rng)
    quat_wxyz = turns.as_quat(canonical=True, scalar_first=True)
    position_m = rng.uniform(0, 3, (N_FRAMES, 3))
    index = np.arange(N_FRAMES)
    table = PoseTable(index, index, position_m, quat_wxyz)
    for number, world_from_cam in enumerate(table.world_from_cam):
        stem = f"frame-{number:06d}"
        pixels = rng.integers(0, 256, (48, 64, 3), dtype=np.uint8)
        Image.fromarray(pixels).save(folder / f"{stem}.color.png")
        np.savetxt(folder / f"{stem}.pose.txt", world_from_cam, "%.17g")
    packed, labels = folder / "packed.npy", folder / "labels.csv"
    pack_frames([folder], INPUT_PX, packed)
    write_pose_table(labels, table)
    data = read_labelled_frames(packed, labels, INPUT_PX, torch.device("cpu"))
    statistics = image_statistics(data.images)
    torch.manual_seed(0)
    network = NetworkConfig(input_px=INPUT_PX, width=0.125)
    start = build_localizer("posenet2", network, LocalizerConfig(dropout=0.0))
    start.criterion.distance = PUBLISHED.distance
    files = ImageFiles(folder, INPUT_PX, statistics)
    return Case(start, data, files, statistics, 0.0, Schedule(6, 6, 1e-5, 1e-2, 0.5), 0)


def test_files_hold_what_is_packed(case):
    assert len(case.files) == N_FRAMES
    expected = case.statistics.normalise(case.data.images)
    for index in range(N_FRAMES):
        image, pose = case.files[index]
        torch.testing.assert_close(image, expected[index], rtol=0, atol=1e-5)
        torch.testing.assert_close(pose[:3], case.data.position_m[index])
        torch.testing.assert_close(pose[3:], case.data.quat_wxyz[index])


def test_the_plain_loop_has_our_losses(case):
    # A low rate: Adam makes whole steps of gradients that are nothing but rounding.
    ours, plain = case.ours(4), case.plain(4, 0)
    assert len(ours) == len(plain) == 4
    assert largest_difference(ours, plain) < 1e-3
    assert largest_difference(ours, case.ours(4)) == 0.0
    assert len(set(ours)) == 4


def test_another_optimiser_would_be_noticed(case):
    other = replace(case, epoch=case.epoch._replace(learning_rate=2e-5))
    assert largest_difference(case.ours(4), other.plain(4, 0)) > 1e-2


def test_differences_are_over_the_mean_size_of_the_loss():
    assert largest_difference([2.0, -4.0, 6.0], [2.0, -3.0, 6.5]) == pytest.approx(0.25)


def test_the_matched_weight_gives_orientation_its_share_with_norms():
    position_m, angle_deg, beta = 0.7, 14.0, 3.0
    true = torch.tensor([[1.0, 0.0, 0.0, 0.0]], dtype=torch.float64)
    half = np.radians(angle_deg) / 2
    turned = torch.tensor([[np.cos(half), 0.0, np.sin(half), 0.0]])
    origin, moved = torch.zeros(1, 3).double(), torch.tensor([[0.0, position_m, 0.0]]).double()
    share = {}
    for name, weight in (
        ("norm", beta),
        ("mse", protocols.matched_beta(beta, position_m, angle_deg)),
    ):
        position, orientation = DISTANCES[name]
        share[name] = float(weight * orientation(turned, true) / position(moved, origin))
    assert share["norm"] == pytest.approx(share["mse"], rel=1e-6)


def test_every_protocol_between_differs_in_one_part():
    corrected = protocols.VARIANTS["corrected"]
    for name, protocol in protocols.VARIANTS.items():
        parts = zip(protocol._fields, corrected, protocol, strict=True)
        exchanged = [f"{field}: {new}" for field, old, new in parts if old != new]
        assert exchanged == [name] or name in ("corrected", "published")
    assert all(a != b for a, b in zip(corrected, protocols.VARIANTS["published"], strict=True))


def options(tmp_path, **values):
    defaults = {"results": tmp_path, "repetitions": 2, "samples": None, "frames": tmp_path}
    return SimpleNamespace(**(defaults | values), out=tmp_path / "page", jobs=1)


def test_only_a_fixed_weight_is_matched(config, tmp_path):
    made = protocols.trainings(config, options(tmp_path))
    matched = {t.model for t in made if t.key["protocol"].endswith(protocols.MATCHED)}
    assert matched == {"posenet"}
    assert len(made) == 2 * (8 + 2 + 8)
    assert len({key_of(t.key, t.key) for t in made}) == len(made)


def test_pretraining_pairs_both_kinds_at_every_size(config, tmp_path):
    made = pretraining.trainings(config, options(tmp_path, repetitions=3))
    assert len(made) == 3 * 3 * 5 * 2
    by_size = {t.size: t.samples_seen for t in made}
    assert by_size == {size: config.training.samples_seen[size] for size in pretraining.SIZES}


def rows_of(made, error=lambda training: 1.0):
    """Rows as the benchmark writes them."""
    measured = {"train_cpu_s": 10.0, "train_wall_s": 11.0, "predict_ms_1": 2.0}
    measured |= {"predict_ms_100": 1.0, "orientation_deg": 10.0}
    return [{**t.key, **measured, "position_m": error(t)} for t in made]


def write_all(table, rows):
    for row in rows:
        append_row(table, row)


def test_a_table_that_is_complete_starts_nothing(config, tmp_path):
    table = tmp_path / "table.csv"
    base = training_of(config, tmp_path, "posenet2", "20k", "scratch", 0, 8000)
    made = [base._replace(key={"width": w, **base.key}) for w in (0.125, 0.5, 1 / 4)]
    assert read_rows(table) == []
    write_all(table, rows_of(made))
    # Nothing of these trainings exists: starting one would fail.
    assert measure_missing(made, config, tmp_path, table, 1) == read_rows(table)
    assert len(read_rows(table)) == 3
    assert measure_missing(made[1:2], config, tmp_path, table, 1) == read_rows(table)[1:2]


def test_changes_are_taken_seed_by_seed(config, tmp_path):
    errors = {("scratch", 0): 2.0, ("scratch", 1): 1.0, ("pretrained", 0): 1.0}
    errors |= {("pretrained", 1): 1.5}
    made = [training_of(config, tmp_path, "posenet", "6k", init, k, 100) for init, k in errors]
    write_all(tmp_path / "t.csv", rows_of(made, lambda t: errors[t.init, t.repetition]))
    rows = read_rows(tmp_path / "t.csv")
    assert pretraining.change_percent(rows, "position_m") == [-50.0, 50.0]
    assert pretraining.change_percent(rows[:3], "position_m") == [-50.0]
    assert pretraining.change_percent(chosen(rows, init="scratch"), "position_m") == []


@pytest.mark.parametrize("module", [protocols, pretraining, images_shown])
def test_pages_show_every_training(module, config, tmp_path):
    given = options(tmp_path)
    write_all(tmp_path / "t.csv", rows_of(module.trainings(config, given)))
    module.write(config, given, read_rows(tmp_path / "t.csv"))
    lines = (tmp_path / "page.md").read_text().splitlines()
    cells = [line.split(" | ") for line in lines if line.startswith("| ")][2:]
    expected = {protocols: 10 + 8, pretraining: 3 * len(MODELS)}
    assert len(cells) == expected.get(module, len(images_shown.SAMPLES))
    assert all("2" in line for line in cells)
    assert (tmp_path / "page.png").exists() == (module is not protocols)


def test_the_page_of_learners_marks_the_profiles_shape(config, tmp_path, monkeypatch):
    monkeypatch.setattr(learners, "frames_of", lambda *_: tmp_path)
    given = options(tmp_path, repetitions=1)
    made = learners.trainings(config, given)
    assert len(made) == 4 * 3 + 4
    write_all(tmp_path / "t.csv", rows_of(made))
    learners.write(config, given, read_rows(tmp_path / "t.csv"))
    page = (tmp_path / "page.md").read_text()
    shape = f"| **{config.network.input_px}** | **{config.network.width}** |"
    assert page.count(shape) == len(MODELS)
    assert (tmp_path / "page.png").stat().st_size > 1000


def test_frames_of_other_sides_are_as_many_as_are_labelled(config, tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(
        learners, "read_frames", lambda plan, *span: asked.append((plan.stem, *span))
    )
    for name in ("render_packed", "join_packed", "write_packed_record"):
        monkeypatch.setattr(learners, name, lambda *_: None)
    for split in learners.SPLITS:
        for file in (f"{split}-shard.npy", f"{split}-shard.json"):
            (tmp_path / file).touch()
        learners.render(config, tmp_path, split, 32, tmp_path)
    # Errors of every size are measured on the largest set's test frames.
    trained, tested = round(20_000 * config.scale), round(20_000 * config.scale)
    assert asked == [("train", 0, trained), ("test", 0, tested)]


def test_numbers_over_seeds(tmp_path):
    assert with_range([1.0], 2) == "1.00"
    assert with_range([1.0, 2.0, 6.0], 1) == "3.0 (1.0 – 6.0)"
    write_page(tmp_path / "a.md", "run me", "Why.", ("a", "b"), [("1", "2")])
    text = "# `run me`\n\nWhy.\n\n| a | b |\n| --- | --- |\n| 1 | 2 |\n"
    assert (tmp_path / "a.md").read_text() == text
