"""Checkpoints say what they are, and files that are none are refused in one line."""

import math

import pytest
import torch

from baselines.config.learning import MODELS, NetworkConfig
from baselines.localizers.base import Localizer
from baselines.training import checkpoint
from baselines.training.checkpoint import frame_camera, read_checkpoint
from baselines.training.predict import predict
from synfeal.config.dataset import CameraConfig
from synfeal.errors import InputError
from synfeal.records.files import write_json
from tests.support.colored_frames import HYPER, NETWORK, save, untrained

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
    ("name", "auxiliary"), [("posenet", True), ("poselstm", False), ("posenet2", False)]
)
def test_a_model_of_before_auxiliary_regressors_were_declared_is_what_it_was(
    name, auxiliary, tmp_path
):
    """PoseNet alone had them, and descriptions did not say so."""
    trained = untrained(name, NETWORK, HYPER.model_copy(update={"auxiliary": auxiliary}))
    file = save(tmp_path / "model.pt", trained)
    content = torch.load(file, weights_only=True)
    del content["description"]["hyper"]["auxiliary"]
    torch.save(content, file)
    found = read_checkpoint(file, CPU)
    assert found.description == trained.description
    images = torch.randint(0, 256, (3, 3, 32, 32), dtype=torch.uint8)
    for ours, theirs in zip(predict(found, images), predict(trained, images), strict=True):
        assert (ours == theirs).all()


UNKNOWN = {"localizer": "posenet2", "network": {"attention": True}}


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"description": None}, "does not say which localizer it is .*train it again"),
        ({"description": {"localizer": "posenet3"}}, "its description cannot be used .*localizer"),
        ({"description": UNKNOWN}, r"network\.attention: unknown key"),
        ({"images": None}, "holds no trained localizer"),
        ({"localizer": {}}, "not those of the posenet2 it describes.*train it again"),
    ],
)
def test_a_damaged_checkpoint_is_one_line(model, values, message):
    with pytest.raises(InputError, match=rf"model\.pt: .*{message}"):
        read_checkpoint(changed(model, **values), CPU)


GPU_IS_FULL = torch.OutOfMemoryError("CUDA out of memory. Tried to allocate 2.00 GiB.")
CPU_IS_FULL = RuntimeError(
    "[enforce fail at alloc_cpu.cpp:124] err == 0. DefaultCPUAllocator: can't allocate memory"
)
OUR_FAULT = AttributeError("'NoneType' object has no attribute 'shape'")
# Steps of reading a checkpoint, as the module or class and the function of it that takes the step.
STEPS = [
    (torch, "load"),
    (checkpoint, "build_localizer"),
    (Localizer, "place_on"),
    (Localizer, "load_state_dict"),
]


def fail_at(monkeypatch, step, error):
    def fail(*args, **kwargs):
        raise error

    monkeypatch.setattr(*step, fail)


@pytest.mark.parametrize("step", STEPS, ids=lambda step: step[1])
@pytest.mark.parametrize("error", [GPU_IS_FULL, CPU_IS_FULL], ids=["GPU", "CPU"])
def test_a_lack_of_memory_is_not_blamed_on_the_checkpoint(model, step, error, monkeypatch):
    fail_at(monkeypatch, step, error)
    with pytest.raises(MemoryError, match="memory") as caught:
        read_checkpoint(model, CPU)
    assert caught.value.__cause__ is error


@pytest.mark.parametrize("step", STEPS, ids=lambda step: step[1])
def test_a_fault_of_the_program_is_not_blamed_on_the_checkpoint(model, step, monkeypatch):
    fail_at(monkeypatch, step, OUR_FAULT)
    with pytest.raises(AttributeError, match="no attribute 'shape'"):
        read_checkpoint(model, CPU)


def test_a_changed_weight_is_noticed_and_its_cause_kept(model):
    content = model.read_bytes()
    weight = torch.load(model, weights_only=True)["images"]["mean"].numpy().tobytes()
    place = content.index(weight)
    model.write_bytes(content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :])
    with pytest.raises(InputError, match=r"model\.pt: is damaged") as caught:
        read_checkpoint(model, CPU)
    assert "damaged" in str(caught.value.__cause__)


OFF_CENTRE = {"width": 90, "height": 40, "fx": 30.0, "fy": 30.0, "cx": 45.0, "cy": 10.0}
HALF = math.tan(math.radians(30))  # of 60 degrees across


@pytest.mark.parametrize(
    ("camera", "short_side_deg"),
    [
        ({"width": 128, "height": 96}, 2 * math.degrees(math.atan(HALF * 96 / 128))),
        ({"width": 96, "height": 128}, 60.0),
        # Off the centre: 10 pixels above the axis, 30 below it.
        (OFF_CENTRE, math.degrees(math.atan(1 / 3)) + 45.0),
    ],
)
def test_the_field_of_view_is_that_of_the_short_side(tmp_path, camera, short_side_deg):
    assert frame_camera(tmp_path / "train.npy") is None
    record = CameraConfig(**camera).record
    write_json(tmp_path / "train.json", {"camera": record, "frames": 3})
    found = frame_camera(tmp_path / "train.npy")
    assert found is not None
    assert found.short_side_fov_deg == pytest.approx(short_side_deg, rel=1e-12)
