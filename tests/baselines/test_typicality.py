"""Pictures of another place are told by their features, against SciPy and counted shares."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from PIL import Image
from scipy.spatial.distance import cdist

from baselines.config.learning import MODELS
from baselines.training.checkpoint import read_checkpoint, save_checkpoint
from baselines.training.data import LabelledFrames
from baselines.training.localize import HEADER, localize, read_picture
from baselines.training.typicality import (
    FEWEST_FRAMES,
    MOST_FRAMES,
    OUTSIDE,
    Calibration,
    calibrate,
    features_of,
    nearest_distance,
    typicality,
)
from synfeal.cli import main
from synfeal.dataset.poses_in import read_pose_list
from synfeal.records.tables import read_records
from tests.support.collected import refused
from tests.support.colored_frames import CPU, PX, colored_frames, untrained


def unit(rng, *shape):
    values = rng.normal(size=shape)
    return torch.from_numpy(values / np.linalg.norm(values, axis=-1, keepdims=True)).float()


def labelled(images):
    """Frames (N, px, px, 3) as training runs hold them."""
    count = len(images)
    return LabelledFrames(
        torch.from_numpy(images).permute(0, 3, 1, 2),
        torch.zeros(count, 3),
        torch.tensor([[1.0, 0.0, 0.0, 0.0]]).repeat(count, 1),
        np.arange(count) // 10,
        torch.arange(count),
    )


@pytest.fixture(scope="module")
def place():
    """Frames of one place: learned from, held out, and further ones."""
    images, _ = colored_frames(420, np.random.default_rng(0))
    return labelled(images[:200]), labelled(images[200:300]), images[300:]


@pytest.fixture(scope="module")
def calibrated(place):
    """A localizer that knows what frames of the place look like to it."""
    trained, (learned, held_out, _) = untrained(), place
    found = calibrate(trained.network, trained.statistics, learned, held_out, None)
    description = trained.description.model_copy(
        update={"scene": "the lab", "bounds_m": ((-1.0, -1.0, -1.0), (1.0, 1.0, 1.0))}
    )
    return replace(trained, description=description, calibration=found)


def foreign_images(count, seed=1):
    """Noise: nothing that a frame of the place looks like."""
    rng = np.random.default_rng(seed)
    return rng.integers(0, 256, (count, PX, PX, 3)).astype(np.uint8)


def typicalities(trained, images):
    normalised = trained.statistics.normalise(labelled(images).images)
    return typicality(trained.calibration, features_of(trained.network, normalised))


def test_the_distance_is_the_cosine_distance_to_the_nearest():
    rng = np.random.default_rng(2)
    features, seen = unit(rng, 250, 16), unit(rng, 40, 16)
    expected = cdist(features.numpy(), seen.numpy(), "cosine").min(axis=1)
    np.testing.assert_allclose(nearest_distance(features, seen), expected, atol=1e-6)


def test_frames_of_one_path_are_not_compared():
    rng = np.random.default_rng(5)
    features, path = unit(rng, 130, 16), rng.integers(0, 7, 130)
    cosine = cdist(features.numpy(), features.numpy(), "cosine")
    cosine[path[:, None] == path] = np.inf
    found = nearest_distance(features, features, (path, path))
    np.testing.assert_allclose(found, cosine.min(axis=1), atol=1e-6)


def test_typicality_is_the_share_of_frames_that_are_as_far_or_farther():
    rng = np.random.default_rng(3)
    seen, held_out, pictures = unit(rng, 30, 8), unit(rng, 50, 8), unit(rng, 70, 8)
    pictures[0], pictures[1] = held_out[7], seen[3]
    distance = nearest_distance(held_out, seen)
    found = typicality(Calibration(seen, distance.sort().values), pictures)
    far = nearest_distance(pictures, seen)
    expected = [(int((distance >= d).sum()) + 1) / (len(distance) + 1) for d in far]
    np.testing.assert_array_equal(found, expected)
    assert found[1] == 1.0


def test_features_that_are_no_numbers_have_no_typicality():
    rng = np.random.default_rng(4)
    pictures = unit(rng, 3, 8)
    pictures[1] = torch.nan
    found = typicality(Calibration(unit(rng, 5, 8), torch.linspace(0, 1, 9)), pictures)
    assert np.isnan(found).tolist() == [False, True, False]


LAST_LAYERS = {
    "posenet": lambda backbone: backbone.inception5b,
    "poselstm": lambda backbone: backbone.inception5b,
    "posenet2": lambda backbone: backbone.inception5b,
    "hourglass": lambda backbone: backbone.layer4,
    "posenet2resnet": lambda backbone: backbone.layer4,
}


@pytest.mark.parametrize("name", MODELS)
def test_features_are_the_pooled_last_maps_of_any_localizer(name):
    trained = untrained(name)
    images = trained.statistics.normalise(labelled(foreign_images(7)).images)
    maps = []
    last = LAST_LAYERS[name](trained.network.backbone)
    last.register_forward_hook(lambda _, __, output: maps.append(output.numpy()))
    found = features_of(trained.network, images)
    pooled = maps[0].mean(axis=(2, 3))
    expected = pooled / np.linalg.norm(pooled, axis=1, keepdims=True)
    np.testing.assert_allclose(found, expected, atol=1e-6)


class Averaging(torch.nn.Module):
    """A backbone of another package, which returns maps or features and nothing beside them."""

    def __init__(self, keeps_maps):
        super().__init__()
        self.keeps_maps = keeps_maps

    def forward(self, images):
        return images if self.keeps_maps else images.mean((2, 3))


@pytest.mark.parametrize("keeps_maps", [True, False])
def test_a_backbone_may_return_one_tensor(keeps_maps):
    trained = untrained()
    images = trained.statistics.normalise(labelled(foreign_images(7)).images)
    trained.network.backbone = Averaging(keeps_maps)
    color = images.mean((2, 3))
    expected = color / color.norm(dim=1, keepdim=True)
    np.testing.assert_allclose(features_of(trained.network, images), expected, atol=1e-6)


def test_frames_of_the_place_are_called_outside_as_often_as_stated_and_others_nearly_always(
    calibrated, place
):
    own, foreign = typicalities(calibrated, place[2]), typicalities(calibrated, foreign_images(80))
    # Binomial, 120 frames and as many ways in which the calibration may have come out.
    assert (own <= OUTSIDE).mean() < 0.15
    assert 0.35 < own.mean() < 0.65
    assert (foreign <= OUTSIDE).mean() > 0.8


def test_a_large_training_set_is_thinned_evenly(place, calibrated):
    """Frames that are there a dozen times: each is kept as often, and on its own path."""
    trained, (learned, held_out, _) = untrained(), place
    chosen = np.arange(MOST_FRAMES + 500) * len(learned) // (MOST_FRAMES + 500)
    rows = torch.from_numpy(chosen)
    many = LabelledFrames(
        learned.images,
        learned.position_m[rows],
        learned.quat_wxyz[rows],
        learned.path[chosen],
        rows,
    )
    both = calibrate(trained.network, trained.statistics, many, held_out, None)
    found = calibrate(trained.network, trained.statistics, many, None, None)
    for thinned, count in ((both, MOST_FRAMES + len(held_out)), (found, MOST_FRAMES)):
        assert len(thinned.features) == MOST_FRAMES
        assert len(thinned.distance) == count
        assert (thinned.distance.diff() >= 0).all()
    once = calibrated.calibration.features.double()
    which = torch.cdist(found.features.double(), once).argmin(dim=1)
    times = torch.bincount(which, minlength=len(learned)).double() * len(learned) / MOST_FRAMES
    assert (times - 1).abs().max() < 0.2
    path = learned.path[which.numpy()]
    expected = nearest_distance(found.features, found.features, (path, path))
    torch.testing.assert_close(found.distance, expected.sort().values)


def test_frames_are_compared_under_the_light_that_they_were_learned_in(place):
    """Negatives made of the frames are as far from each other as frames that are negatives."""
    trained, (learned, held_out, _) = untrained(), place
    negatives = [replace(part, images=255 - part.images) for part in (learned, held_out)]
    expected = calibrate(trained.network, trained.statistics, *negatives, None)
    found = calibrate(trained.network, trained.statistics, learned, held_out, lambda i: 255 - i)
    for one, other in zip(found, expected, strict=True):
        assert torch.equal(one, other)
    plain = calibrate(trained.network, trained.statistics, learned, held_out, None)
    assert not torch.allclose(plain.distance, found.distance)


def test_a_network_that_was_just_trained_is_calibrated_as_it_will_answer(place, calibrated):
    """Without what it does in training alone: dropout, and statistics of the batch."""
    trained, (learned, held_out, _) = untrained(), place
    trained.network.train()
    found = calibrate(trained.network, trained.statistics, learned, held_out, None)
    for one, other in zip(found, calibrated.calibration, strict=True):
        assert torch.equal(one, other)


def test_too_few_frames_one_path_or_a_diverged_network_have_no_calibration(place):
    trained, (learned, held_out, _) = untrained(), place
    few = learned.part(np.arange(len(learned)) < FEWEST_FRAMES - 1)
    one_path = replace(learned, path=np.zeros(len(learned), np.int64))
    for part in (few, one_path):
        assert calibrate(trained.network, trained.statistics, part, held_out, None) is None
    for parameter in trained.network.parameters():
        parameter.detach().fill_(torch.nan)
    assert calibrate(trained.network, trained.statistics, learned, held_out, None) is None


def save(path, trained):
    save_checkpoint(
        path, trained.network, trained.statistics, trained.description, trained.calibration
    )
    return path


def test_a_checkpoint_keeps_the_calibration_and_an_older_one_has_none(calibrated, tmp_path):
    read = read_checkpoint(save(tmp_path / "model.pt", calibrated), CPU)
    assert read.description.scene == "the lab"
    for kept, written in zip(read.calibration, calibrated.calibration, strict=True):
        assert torch.equal(kept, written)
    older = save(tmp_path / "older.pt", replace(calibrated, calibration=None))
    assert read_checkpoint(older, CPU).calibration is None


@pytest.mark.parametrize(
    "values",
    [
        {"features": torch.ones(3, 4)},
        {"features": torch.full((3, 4), torch.nan), "distance": torch.ones(3)},
        {"features": torch.ones(3, 4), "distance": torch.tensor([1.0, 0.0])},
        {"features": torch.ones(3), "distance": torch.ones(3)},
    ],
)
def test_a_damaged_calibration_is_refused_in_one_line(calibrated, tmp_path, capsys, values):
    path = save(tmp_path / "model.pt", calibrated)
    content = torch.load(path, weights_only=True)
    torch.save(content | {"calibration": values}, path)
    Image.fromarray(foreign_images(1)[0]).save(tmp_path / "a.png")
    out = tmp_path / "poses.csv"
    assert "train it again" in refused(capsys, "localize", path, tmp_path / "a.png", "--out", out)


def pictures(folder, images):
    folder.mkdir()
    for index, image in enumerate(images):
        Image.fromarray(image).save(folder / f"frame-{index:06d}.color.png")
    return folder


def rows_of(model, folder, out):
    out.unlink(missing_ok=True)
    assert main(["localize", str(model), str(folder), "--out", str(out), "--device", "cpu"]) == 0
    return [row for _, row in read_records(out)]


def test_pictures_of_another_place_are_told(calibrated, place, tmp_path, caplog):
    model = save(tmp_path / "model.pt", calibrated)
    foreign = pictures(tmp_path / "foreign", foreign_images(30))
    rows = rows_of(model, foreign, tmp_path / "poses.csv")
    assert [*rows[0]] == [*HEADER] == [
        *("image", "tx", "ty", "tz", "qw", "qx", "qy", "qz", "status", "typicality", "outside_m")
    ]  # fmt: skip
    for row in rows:
        assert row["status"] == ("outside" if float(row["typicality"]) <= OUTSIDE else "inside")
    unlike = [row["status"] for row in rows].count("outside")
    assert unlike > 15  # noise that was made smaller is less unlike
    assert f"{unlike} of 30 pictures are unlike the frames that" in caplog.text
    assert "in 'the lab'" in caplog.text
    caplog.clear()
    own = pictures(tmp_path / "own", place[2][:40])
    rows = rows_of(model, own, tmp_path / "poses.csv")
    shown = np.stack([read_picture(path, PX) for path in sorted(own.iterdir())])
    expected = typicalities(calibrated, shown)
    np.testing.assert_allclose([float(row["typicality"]) for row in rows], expected, atol=0.01)
    assert [row["status"] for row in rows].count("inside") >= 34
    assert "are unlike" not in caplog.text
    assert len(read_pose_list(tmp_path / "poses.csv").names) == 40


def test_a_model_without_a_calibration_says_so_in_one_line(calibrated, tmp_path, caplog):
    model = save(tmp_path / "model.pt", replace(calibrated, calibration=None))
    rows = rows_of(model, pictures(tmp_path / "own", foreign_images(2)), tmp_path / "poses.csv")
    assert [(row["status"], row["typicality"]) for row in rows] == [("unknown", "nan")] * 2
    assert "cannot tell pictures of another place" in caplog.text
    assert len([r for r in caplog.records if r.levelname == "WARNING"]) == 1


def test_the_distance_to_the_box_of_the_training_positions_is_stated(calibrated, tmp_path):
    head = calibrated.network.regressor[-1].position
    with torch.no_grad():
        weight, bias = head.weight.clone(), head.bias.clone()
        head.weight.zero_()
        head.bias.copy_(torch.tensor([1.3, -1.4, 0.2]))
    try:
        model = save(tmp_path / "model.pt", calibrated)
        folder = pictures(tmp_path / "own", foreign_images(1))
        (row,) = rows_of(model, folder, tmp_path / "poses.csv")
        assert float(row["outside_m"]) == pytest.approx(0.5, abs=1e-6)
        done = localize(model, [folder], tmp_path / "again.csv", "cpu")
        assert done.n_beyond == 0
        assert done.n_unlike == (row["status"] == "outside")
    finally:
        with torch.no_grad():
            head.weight.copy_(weight)
            head.bias.copy_(bias)
