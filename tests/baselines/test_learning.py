"""Every localizer learns a batch by heart; Muon steps as torch's own."""

import numpy as np
import pytest
import torch
from PIL import Image
from scipy.spatial.transform import Rotation

from baselines.config.learning import LocalizerConfig, NetworkConfig
from baselines.localizers.registry import build_localizer
from baselines.training.checkpoint import ModelDescription, TrainedLocalizer
from baselines.training.data import image_statistics
from baselines.training.optimizer import WARM_UP, Muon, Schedule, optimisation_of
from baselines.training.predict import predict
from synfeal.dataset.pose_table import PoseTable
from synfeal.evaluation.metrics import pose_errors

BATCH, PX = 8, 32
STEPS, FROZEN_STEPS = 100, 200
LEARNING_RATE = 3e-3
VARIANTS = [
    ("posenet", {}, {}),
    ("poselstm", {}, {}),
    ("hourglass", {}, {"skip": "sum"}),
    ("hourglass", {}, {"skip": "concatenation"}),
    ("posenet2resnet", {}, {}),
    ("posenet2", {}, {}),
    ("posenet2", {"backbone": "inception_v3", "input_px": 75}, {}),
]


def views(px):
    """Pictures (BATCH, 3, px, px) uint8 of soft patches with fine detail, unlike one another."""
    rng = np.random.default_rng(0)
    patches = rng.integers(0, 256, (BATCH, 6, 6, 3), np.uint8)
    soft = [Image.fromarray(p).resize((px, px), Image.Resampling.BICUBIC) for p in patches]
    detail = rng.normal(scale=8.0, size=(BATCH, px, px, 3))
    pixels = (np.array([np.asarray(image) for image in soft]) + detail).clip(0, 255)
    return torch.from_numpy(pixels.astype(np.uint8)).permute(0, 3, 1, 2)


def poses():
    """Anywhere in a room of 4 x 4 x 4 m, turned in any way."""
    rng = np.random.default_rng(1)
    quat = Rotation.random(BATCH, rng=rng).as_quat(canonical=True, scalar_first=True)
    frame = np.arange(BATCH)
    return PoseTable(frame, frame, rng.uniform(-2.0, 2.0, (BATCH, 3)), quat)


def learn(localizer, images, table):
    """Descend to the poses, the second half with the batch normalisation as prediction uses it.

    A running variance is that of a sample, n / (n - 1) times what the training step divides by.
    The deepest maps of a small image have one pixel, so n is 8, and evaluation differs by so much
    that no training step notices; with the statistics held, both are the same function.
    """
    position_m, quat_wxyz = (
        torch.as_tensor(values, dtype=torch.float32)
        for values in (table.position_m, table.quat_wxyz)
    )
    localizer.set_pose_prior(position_m.mean(0))
    steps = STEPS + FROZEN_STEPS
    optimizer = torch.optim.Adam(localizer.parameters(), LEARNING_RATE, fused=True)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, steps)
    for step in range(steps):
        localizer.train(step < STEPS)
        optimizer.zero_grad()
        localizer.loss(localizer(images), position_m, quat_wxyz).backward()
        optimizer.step()
        schedule.step()


@pytest.mark.parametrize(("name", "shape", "changes"), VARIANTS)
def test_a_batch_is_learned_by_heart(name, shape, changes):
    torch.set_num_threads(1)
    torch.manual_seed(0)
    network = NetworkConfig.model_validate({"input_px": PX, "width": 0.125} | shape)
    hyper = LocalizerConfig.model_validate(
        {"dropout": 0.0, "beta": 3.0, "s_orientation": -1.0} | changes
    )
    localizer = build_localizer(name, network, hyper)
    images, table = views(network.input_px), poses()
    statistics = image_statistics(images)
    learn(localizer, statistics.normalise(images), table)
    description = ModelDescription(localizer=name, network=network, hyper=hyper)
    found = predict(TrainedLocalizer(description, localizer.eval(), statistics), images)
    errors = pose_errors(PoseTable(table.frame, table.path, *found), table)
    assert errors["position_m"].max() < 0.01
    assert errors["orientation_deg"].max() < 0.5


def test_a_matrix_goes_where_torchs_own_muon_takes_it_and_kernels_step_as_matrices():
    torch.manual_seed(1)
    start, target = torch.randn(24, 40), torch.randn(24, 40)
    ours, theirs = (torch.nn.Parameter(start.clone()) for _ in range(2))
    settings = {"lr": 0.02, "momentum": 0.95, "weight_decay": 0.1}
    # Newton and Schulz' own coefficients converge to the orthogonal factor, slowly.
    exact = {"ns_coefficients": (1.875, -1.25, 0.375), "ns_steps": 20}
    optimizers = (Muon([ours], **settings), torch.optim.Muon([theirs], **settings, **exact))
    for _ in range(10):
        for parameter, optimizer in zip((ours, theirs), optimizers, strict=True):
            optimizer.zero_grad()
            (parameter - target).square().sum().backward()
            optimizer.step()
    moved = (ours - start).norm()
    # Our singular values end up to 0.08 away from 1, torch's within the three digits of bfloat16.
    assert (ours - theirs).norm() / moved < 0.1
    torch.manual_seed(2)
    kernels = [torch.nn.Parameter(torch.randn(6, 4, 3, 3)) for _ in range(3)]
    matrices = [torch.nn.Parameter(k.detach().reshape(6, 36).clone()) for k in kernels]
    together = Muon(kernels, lr=0.1, weight_decay=0.01)
    alone = [Muon([m], lr=0.1, weight_decay=0.01) for m in matrices]
    for _ in range(3):
        for kernel, matrix in zip(kernels, matrices, strict=True):
            kernel.grad = torch.randn(kernel.shape)
            matrix.grad = kernel.grad.reshape(6, 36)
        for optimizer in (together, *alone):
            optimizer.step()
    for kernel, matrix in zip(kernels, matrices, strict=True):
        torch.testing.assert_close(kernel.reshape(6, 36), matrix, rtol=1e-4, atol=1e-5)


def test_kernels_step_alike_however_they_lie_in_memory_and_after_they_were_saved():
    torch.manual_seed(3)
    shapes = [(6, 4, 3, 3), (40, 3, 1, 1), (12, 70, 1, 3)]
    plain = [torch.nn.Parameter(torch.randn(shape)) for shape in shapes]
    last = [
        torch.nn.Parameter(
            p.detach()
            .clone(memory_format=torch.contiguous_format)
            .to(memory_format=torch.channels_last)
        )
        for p in plain
    ]
    optimizers = Muon(plain, lr=0.1), Muon(last, lr=0.1)
    for step in range(4):
        for a, b in zip(plain, last, strict=True):
            a.grad = torch.randn(a.shape)
            b.grad = a.grad.clone()  # laid out otherwise than its parameter
        for optimizer in optimizers:
            optimizer.step()
        if step == 1:
            resumed = Muon(last, lr=0.1)
            resumed.load_state_dict(optimizers[1].state_dict())
            optimizers = optimizers[0], resumed
    for a, b in zip(plain, last, strict=True):
        torch.testing.assert_close(a, b, rtol=1e-4, atol=1e-5)


def test_rates_rise_then_fall_to_nothing_and_outputs_are_left_to_adamw():
    from baselines.training.pretrain import RoomsNetwork

    network = RoomsNetwork("googlenet", 0.125, 2)
    optimisation = optimisation_of("muon", network, Schedule(6400, 64, 0.3, 0.0))
    (muon, _), (adamw, _) = optimisation._parts
    in_muon = {id(p) for group in muon.param_groups for p in group["params"]}
    assert id(network.heads.poses.weight) not in in_muon
    assert id(network.feature[2].weight) in in_muon
    n_all = sum(len(g["params"]) for o in (muon, adamw) for g in o.param_groups)
    assert n_all == len(list(network.parameters()))
    rates = []
    for _ in range(100):
        rates.append(optimisation.learning_rate)
        optimisation.step(network.heads.poses.bias.sum())
    rise = round(100 * WARM_UP)
    assert rates[: rise + 1] == pytest.approx([0.3 * (k + 1) / rise for k in range(rise)] + [0.3])
    assert rates[rise:] == pytest.approx([0.3 * (100 - k) / (100 - rise) for k in range(rise, 100)])
