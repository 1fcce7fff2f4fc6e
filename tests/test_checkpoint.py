"""Checkpoints say what they are, and files that are none are refused in one line."""

import math
import re

import pytest
import torch

from baselines.training.checkpoint import read_checkpoint
from baselines.training.description import frame_camera
from baselines.training.predict import predict
from synfeal.config.models import MODELS, CameraConfig, NetworkConfig
from synfeal.dataset.manifest import camera_record
from synfeal.errors import InputError
from synfeal.files import write_json
from tests.trained_localizers import HYPER, NETWORK, save, untrained

CPU = torch.device("cpu")


@pytest.fixture
def model(tmp_path):
    return save(tmp_path / "model.pt", untrained())


def changed(model, **values):
    """The checkpoint with other entries; None takes one out."""
    content = torch.load(model, weights_only=True) | values
    torch.save({key: value for key, value in content.items() if value is not None}, model)
    return model


CONCATENATION = HYPER.model_copy(update={"skip": "concatenation"})
INCEPTION_V3 = NetworkConfig(input_px=75, width=0.125, backbone="inception_v3")
VARIANTS = [
    *((name, NETWORK, HYPER) for name in MODELS),
    ("hourglass", NETWORK, CONCATENATION),
    ("poselstm", INCEPTION_V3, HYPER),
]


@pytest.mark.parametrize(("name", "network", "hyper"), VARIANTS)
def test_a_checkpoint_is_all_that_prediction_needs(name, network, hyper, tmp_path):
    trained = untrained(name, network, hyper)
    found = read_checkpoint(save(tmp_path / "model.pt", trained), CPU)
    assert found.description == trained.description
    assert (found.description.localizer, found.description.network) == (name, network)
    assert found.description.hyper == hyper
    px = network.input_px
    images = torch.randint(0, 256, (3, 3, px, px), dtype=torch.uint8)
    for ours, theirs in zip(predict(found, images), predict(trained, images), strict=True):
        assert (ours == theirs).all()


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"description": None}, "does not say which localizer it is .*train it again"),
        ({"description": 3}, "its description cannot be used"),
        ({"description": {"localizer": "posenet3"}}, "its description cannot be used .*localizer"),
        ({"images": None}, "holds no trained localizer"),
        ({"images": {"mean": 1.0, "deviation": 2.0}}, "not those of the posenet2"),
        ({"localizer": {}}, "not those of the posenet2 it describes.*train it again"),
    ],
)
def test_a_damaged_checkpoint_is_one_line(model, values, message):
    with pytest.raises(InputError, match=rf"model\.pt: .*{message}"):
        read_checkpoint(changed(model, **values), CPU)


def test_a_key_that_this_version_does_not_know_is_named(model):
    description = torch.load(model, weights_only=True)["description"]
    description["network"]["attention"] = True
    with pytest.raises(InputError, match=r"network\.attention: unknown key"):
        read_checkpoint(changed(model, description=description), CPU)


@pytest.mark.parametrize(("width", "height"), [(128, 96), (96, 128)])
def test_the_field_of_view_is_that_of_the_short_side(tmp_path, width, height):
    """60 degrees across; the focal length follows, and from it what the short side sees."""
    camera = CameraConfig(width=width, height=height, horizontal_fov_deg=60.0)
    write_json(tmp_path / "train.json", {"camera": camera_record(camera), "frames": 3})
    found = frame_camera(tmp_path / "train.npy")
    expected = 2 * math.degrees(math.atan(math.tan(math.radians(30)) * min(1, height / width)))
    assert found is not None
    assert found.short_side_fov_deg == pytest.approx(expected, rel=1e-12)


def test_a_field_of_view_off_the_centre_is_the_sum_of_both_parts(tmp_path):
    camera = CameraConfig(width=90, height=40, fx=30.0, fy=30.0, cx=45.0, cy=10.0)
    write_json(tmp_path / "train.json", {"camera": camera_record(camera)})
    found = frame_camera(tmp_path / "train.npy")
    assert found is not None
    expected = math.degrees(math.atan(1 / 3)) + 45.0  # 10 pixels above the axis, 30 below it
    assert found.short_side_fov_deg == pytest.approx(expected, rel=1e-12)


def test_frames_without_a_record_have_no_known_camera(tmp_path):
    assert frame_camera(tmp_path / "train.npy") is None


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"camera": 3}', '{"camera": {"width": 1}}'])
def test_a_damaged_record_is_named(tmp_path, text):
    (tmp_path / "train.json").write_text(text)
    with pytest.raises(InputError, match=re.escape("train.json: cannot be read as the record")):
        frame_camera(tmp_path / "train.npy")
