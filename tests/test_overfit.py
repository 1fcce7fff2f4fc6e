"""Every localizer can learn a batch by heart, as it is used: in evaluation mode."""

import numpy as np
import pytest
import torch
from PIL import Image
from scipy.spatial.transform import Rotation

from baselines.localizers.registry import build_localizer
from baselines.training.checkpoint import ModelDescription, TrainedLocalizer
from baselines.training.data import image_statistics
from baselines.training.predict import predict
from synfeal.config.models import LocalizerConfig, NetworkConfig
from synfeal.dataset.pose_table import PoseTable
from synfeal.evaluation.metrics import pose_errors

BATCH, PX = 8, 32
STEPS, FROZEN_STEPS = 60, 120
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
