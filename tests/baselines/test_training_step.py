"""The captured training step beside the plain one, on a processor."""

from contextlib import nullcontext
from dataclasses import fields, replace

import numpy as np
import pytest
import torch

import baselines.training.step as step_module
from baselines.config.learning import AugmentationConfig, LocalizerConfig
from baselines.localizers.registry import build_localizer
from baselines.training.data import BatchOrder, ImageStatistics, LabelledFrames
from baselines.training.optimizer import Muon, Optimisation, Schedule, optimisation_of
from baselines.training.photometric import PhotometricRandomisation
from baselines.training.rotation import RandomRotation
from baselines.training.step import (
    WARM_UP_STEPS,
    CapturedStep,
    CudaRecorder,
    PlainStep,
    training_step,
)
from synfeal.camera.projection import Intrinsics
from synfeal.config.photometric import PhotometricConfig
from tests.support.colored_frames import NETWORK, PX, read_split, statistics_of, write_split
from tests.support.op_tape import OneDevice, TapeRecorder

PROCESSOR = torch.device("cpu")
BATCH = 4
STEPS = 50
SCHEDULE = Schedule(STEPS * BATCH, BATCH, learning_rate=2e-3, weight_decay=0.01, halve_every=0.2)
HYPER = LocalizerConfig(dropout=0.2, beta=1.0)
CAMERA = Intrinsics(fx=PX, fy=PX, cx=PX / 2, cy=PX / 2)
TURNS = AugmentationConfig(tilt_deg=8.0, roll_deg=15.0)


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    return read_split(write_split(tmp_path_factory.mktemp("frames"), "train", 40, 0))


def plain_step(frames, name, optimiser="muon", device=PROCESSOR):
    """A step of a new run that draws all that can be drawn."""
    torch.manual_seed(3)  # of dropout, too
    localizer = build_localizer(name, NETWORK, HYPER)
    localizer.place_on(device)
    return PlainStep(
        localizer=localizer.train(),
        frames=frames,
        statistics=statistics_of(frames),
        optimisation=optimisation_of(optimiser, localizer, SCHEDULE),
        precision="float32",
        randomise=PhotometricRandomisation(PhotometricConfig(), 1, device),
        augment=RandomRotation(CAMERA, PX, TURNS, 2, device),
    )


def placed(frames, device):
    """Move frames to a device."""
    tensors = {field.name: getattr(frames, field.name) for field in fields(frames)}
    moved = {name: t.to(device) for name, t in tensors.items() if isinstance(t, torch.Tensor)}
    return replace(frames, **moved)


def rates_on_device(optimisation):
    """Give an optimisation the tensors of rates that it has on a GPU."""
    for group in groups_of(optimisation):
        group["lr"] = torch.tensor(group["lr"])


def groups_of(optimisation):
    return [group for optimizer, _ in optimisation._parts for group in optimizer.param_groups]


def losses_of(step, n_frames, steps):
    order = BatchOrder(n_frames, BATCH, seed=4)
    return [float(step(order.next_batch())) for _ in range(steps)]


@pytest.fixture
def blurs_every_image(monkeypatch):
    """Blurring those that are hit alone depends on how many they are, as no GPU does."""
    from baselines.training import photometric

    def blurred_where(hit, light, sigma_px):
        blurred = photometric.blurred(light, sigma_px)
        return torch.where(hit[:, None, None, None], blurred, light)

    monkeypatch.setattr(photometric, "blurred_where", blurred_where)


@pytest.mark.parametrize(
    ("name", "optimiser", "steps"),
    [("posenet2resnet", "muon", STEPS), ("posenet", "halving", 8), ("poselstm", "adamw", 8)],
)
@pytest.mark.usefixtures("blurs_every_image")
def test_a_recorded_step_learns_what_the_plain_step_learns(frames, name, optimiser, steps):
    plain = plain_step(frames, name, optimiser)
    rates_on_device(plain.optimisation)
    expected = losses_of(plain, len(frames), steps)

    twin, recorder = plain_step(frames, name, optimiser), TapeRecorder()
    rates_on_device(twin.optimisation)
    found = losses_of(CapturedStep(twin, recorder), len(frames), steps)

    assert recorder.recordings == 1
    assert found == expected
    before, after = plain.localizer.state_dict(), twin.localizer.state_dict()
    for key, value in before.items():
        assert torch.equal(after[key], value), key


@pytest.mark.parametrize("name", ["posenet", "poselstm", "hourglass"])
def test_no_operation_of_a_step_joins_the_processor_to_its_device(name, monkeypatch):
    """On torch's device without memory: it cannot be waited for, as in a recording."""
    device = torch.device("meta")
    monkeypatch.setattr(torch, "Generator", NoGenerator)
    monkeypatch.setattr(step_module, "autocast", lambda *_: nullcontext())
    with device:
        localizer = build_localizer(name, NETWORK, HYPER).train()
        frames = LabelledFrames(
            images=torch.empty(40, PX, PX, 3, dtype=torch.uint8).permute(0, 3, 1, 2),
            position_m=torch.empty(40, 3),
            quat_wxyz=torch.empty(40, 4),
            path=np.arange(40),
            rows=torch.arange(40),
        )
        statistics = ImageStatistics(torch.empty(1, 3, 1, 1), torch.empty(1, 3, 1, 1))
        chosen = torch.arange(BATCH)
    kernels = [p for p in localizer.parameters() if p.ndim > 1]
    muon = Muon(kernels, lr=0.1, weight_decay=0.1)
    step = PlainStep(
        localizer=localizer,
        frames=frames,
        statistics=statistics,
        optimisation=Optimisation((muon, lambda done: 1.0)),
        precision="float32",
        randomise=PhotometricRandomisation(PhotometricConfig(), 1, device),
        augment=RandomRotation(CAMERA, PX, TURNS, 2, device),
    )
    for _ in range(WARM_UP_STEPS):
        step.on_device(chosen)
    with OneDevice() as watched:
        assert step.on_device(chosen).device == device
    assert watched.joining == []


class NoGenerator:
    """Torch draws nothing on its device without memory, and has no generator for it."""

    def __init__(self, device):
        pass

    def manual_seed(self, seed):
        return None


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs a GPU")
@pytest.mark.parametrize("name", ["posenet", "poselstm", "hourglass", "posenet2resnet", "posenet2"])
def test_a_gpu_learns_to_the_bit_alike_from_captured_and_plain_steps(frames, name, monkeypatch):
    monkeypatch.setattr(torch.backends.cudnn, "benchmark", False)
    monkeypatch.setattr(torch.backends.cudnn, "deterministic", True)
    device = torch.device("cuda")
    weights = []
    for captured in (False, True):
        step = plain_step(placed(frames, device), name, device=device)
        recorder = CudaRecorder(device, step.generators)
        taken = CapturedStep(step, recorder) if captured else step
        torch.cuda.manual_seed_all(7)
        order = BatchOrder(len(frames), BATCH, seed=4)
        for _ in range(STEPS):
            taken(order.next_batch().to(device))
        weights.append(step.localizer.state_dict())
    for key, value in weights[0].items():
        assert torch.equal(weights[1][key], value), key


def test_a_processor_takes_plain_steps(frames):
    plain = plain_step(frames, "posenet2")
    assert training_step(plain) is plain


@pytest.mark.parametrize("shape", [(16, 24), (24, 16), (8, 3, 3, 3)])
def test_muon_moves_alike_by_a_rate_on_the_device(shape):
    torch.manual_seed(0)
    start, gradient = torch.randn(shape), torch.randn(shape)
    moved = []
    for rate in (0.03, torch.tensor(0.03)):
        parameter = torch.nn.Parameter(start.clone())
        parameter.grad = gradient.clone()
        muon = Muon([parameter], lr=0.03, weight_decay=0.1)
        muon.param_groups[0]["lr"] = rate
        muon.step()
        moved.append(parameter.detach())
    torch.testing.assert_close(*moved, rtol=1e-6, atol=1e-7)
    assert not torch.allclose(moved[0], start, atol=1e-3)


def test_an_optimisation_goes_on_with_the_rates_of_its_steps(frames):
    once, again = plain_step(frames, "posenet2"), plain_step(frames, "posenet2")
    losses_of(once, len(frames), 6)
    again.optimisation.load_state_dict(once.optimisation.state_dict())
    assert again.optimisation.learning_rate == once.optimisation.learning_rate
    once_groups, again_groups = (groups_of(step.optimisation) for step in (once, again))
    assert [g["lr"] for g in once_groups] == [g["lr"] for g in again_groups]
