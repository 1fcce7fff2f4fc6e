"""Frames whose poses can be read off: what localizers are trained on in tests."""

import numpy as np
import torch
from scipy.spatial.transform import Rotation

from baselines.config.learning import LocalizerConfig, NetworkConfig, TrainingConfig
from baselines.localizers.registry import build_localizer
from baselines.training.checkpoint import ModelDescription, TrainedLocalizer, save_checkpoint
from baselines.training.data import ImageStatistics, image_statistics, read_labelled_frames
from baselines.training.run import Job, train_localizer
from synfeal.dataset.pose_table import PoseTable, write_pose_table

NETWORK = NetworkConfig(input_px=32, width=0.125)
HYPER = LocalizerConfig(learning_rate=2e-3, dropout=0.0, beta=1.0, s_orientation=-1.0)
TRAINING = TrainingConfig(batch_size=16, samples_seen={}, device="cpu")
PX = NETWORK.input_px
CPU = torch.device("cpu")


def colored_frames(count, rng):
    """Frames whose colour is the position and whose gradient is the yaw, with a little noise."""
    position_m = rng.uniform(-1, 1, (count, 3))
    yaw = rng.uniform(-0.5, 0.5, count)
    ramp = np.linspace(-1, 1, PX)[None, None, :, None]
    images = 128 + 60 * position_m[:, None, None, :] + 80 * yaw[:, None, None, None] * ramp
    images = images + rng.normal(scale=2.0, size=(count, PX, PX, 3))
    quat = Rotation.from_euler("z", yaw[:, None]).as_quat(canonical=True, scalar_first=True)
    frame = np.arange(count)
    table = PoseTable(frame, frame // 10, position_m, quat)
    return images.clip(0, 255).astype(np.uint8), table


def write_split(folder, name, count, seed, spare=0):
    """Packed frames, ``spare`` of them without a label, and labels."""
    images, table = colored_frames(count + spare, np.random.default_rng(seed))
    np.save(folder / f"{name}.npy", images)
    write_pose_table(folder / f"{name}.csv", table.first(count))
    return folder / f"{name}.npy", folder / f"{name}.csv"


def read_split(split):
    """A split as training runs read it."""
    return read_labelled_frames(*split, PX, CPU)


def statistics_of(frames):
    """Image statistics of a split."""
    return image_statistics(frames.images)


def train(
    split, folder, *, samples=96, seed=1, weights=None, name="posenet2", hyper=HYPER,
    training=TRAINING, protocol=None, **further,
):  # fmt: skip
    """A short training; returns the paths of checkpoint and history."""
    model, history = folder / "model.pt", folder / "history.csv"
    job = Job(name, NETWORK, hyper, training, samples, seed, protocol)
    train_localizer(job, *split, model, history, weights=weights, **further)
    return model, history


class Jitter:
    """An augmentation with a generator of its own, which counts its calls and may act on one."""

    def __init__(self, at=0, act=None):
        self.calls, self._at, self._act = 0, at, act
        self._generator = torch.Generator().manual_seed(5)

    def __call__(self, images, quat_wxyz):
        self.calls += 1
        if self.calls == self._at:
            self._act()
        noise = torch.randn(len(images), 3, 1, 1, generator=self._generator)
        return images + 0.05 * noise, quat_wxyz

    def state_dict(self):
        return {"generator": self._generator.get_state()}

    def load_state_dict(self, state):
        self._generator.set_state(state["generator"])


def untrained(name="posenet2", network=NETWORK, hyper=HYPER, camera=None):
    """A localizer of random weights that looks at each image."""
    torch.manual_seed(0)
    built = build_localizer(name, network, hyper).eval()
    built.place_on(torch.device("cpu"))
    statistics = ImageStatistics(torch.full((1, 3, 1, 1), 128.0), torch.full((1, 3, 1, 1), 60.0))
    description = ModelDescription(localizer=name, network=network, hyper=hyper, camera=camera)
    return TrainedLocalizer(description, built, statistics)


def answering(position_m, quat_wxyz):
    """A localizer that gives every image this pose."""
    trained = untrained()
    head = trained.network.regressor[-1]
    with torch.no_grad():
        for layer, values in ((head.position, position_m), (head.quat, quat_wxyz)):
            layer.weight.zero_()
            layer.bias.copy_(torch.tensor(values))
    return trained


def save(path, trained):
    """Write its checkpoint."""
    save_checkpoint(path, trained.network, trained.statistics, trained.description)
    return path
