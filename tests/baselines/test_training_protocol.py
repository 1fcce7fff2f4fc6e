"""The parts of the two protocols: order, held-out paths, selection, distances, schedules."""

import math

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from baselines.labels.injected import add_noise
from baselines.localizers.losses import PosePrediction
from baselines.localizers.registry import build_localizer
from baselines.training import selection
from baselines.training.data import BatchOrder, held_out_paths, held_out_stretch
from baselines.training.fit import PROTOCOLS, fit
from baselines.training.optimizer import Schedule, optimisation_of
from baselines.training.selection import HeldOutErrors, Selection, held_out_errors
from reproduction.design.experiments import Run
from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.errors import InputError
from synfeal.records.tables import read_records
from tests.support.colored_frames import (
    HYPER,
    NETWORK,
    TRAINING,
    Jitter,
    read_split,
    statistics_of,
    train,
    write_split,
)

PUBLISHED = TRAINING.model_copy(update={"protocol": "published"})


@pytest.fixture(scope="module")
def splits(tmp_path_factory):
    folder = tmp_path_factory.mktemp("splits")
    return write_split(folder, "train", 60, 0), write_split(folder, "test", 30, 1)


@pytest.mark.parametrize("shuffled", [True, False])
@pytest.mark.parametrize(("n_frames", "batch_size"), [(10, 4), (3, 8)])
def test_every_frame_is_shown_equally_often(n_frames, batch_size, shuffled):
    order = BatchOrder(n_frames, batch_size, 0, shuffled)
    batches = [order.next_batch() for _ in range(15)]
    assert [len(batch) for batch in batches] == [batch_size] * 15
    shown = torch.cat(batches)
    counts = torch.bincount(shown, minlength=n_frames)
    assert counts.max() - counts.min() <= 1
    in_order = torch.equal(shown, torch.arange(len(shown)) % n_frames)
    assert in_order == (not shuffled)


@pytest.mark.parametrize("n_paths", [1, 2, 3, 10, 25])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.1, 0.5, 0.99])
def test_whole_paths_are_held_out(n_paths, share):
    lengths = np.random.default_rng(3).integers(1, 9, n_paths)
    path = np.repeat(np.arange(n_paths) * 2 + 1, lengths)
    mask = held_out_paths(path, share, seed=4)
    held, learned = set(path[mask]), set(path[~mask])
    assert held.isdisjoint(learned)
    assert learned
    if share == 0.0 or n_paths == 1:
        assert not held
    else:
        assert len(held) == min(max(round(share * n_paths), 1), n_paths - 1)


def test_seeds_draw_paths_and_leave_out_labels():
    path = np.arange(20).repeat(3)
    drawn = {tuple(held_out_paths(path, 0.2, seed)) for seed in range(8)}
    assert len(drawn) > 5
    assert (held_out_paths(path, 0.2, 1) == held_out_paths(path, 0.2, 1)).all()
    seed = Run(**RUN).seed(0)
    assert Run(**RUN | {"labels": "sfm"}).seed(0) == seed
    others = [Run(**RUN | {key: value}).seed(0) for key, value in OTHERS.items()]
    others += [Run(**RUN | {"repetition": 1}).seed(0), Run(**RUN).seed(1)]
    assert len({seed, *others}) == len(others) + 1


def test_the_corrected_protocol_never_opens_the_test_set(splits, tmp_path):
    absent = (tmp_path / "absent.npy", tmp_path / "absent.csv")
    train(splits[0], tmp_path, samples=32, test=absent)
    with pytest.raises(InputError, match="absent"):
        train(splits[0], tmp_path, samples=32, test=absent, training=PUBLISHED)


@pytest.mark.parametrize("training", [TRAINING, PUBLISHED], ids=lambda t: t.protocol)
def test_the_best_weights_looked_at_are_kept(training, splits):
    frames, test = read_split(splits[0]), read_split(splits[1])
    statistics = statistics_of(frames)
    protocol = PROTOCOLS[training.protocol]
    localizer = build_localizer("posenet2", NETWORK, HYPER)
    rows = fit(
        localizer, frames, statistics, Schedule(480, 16, 2e-2, 0.0), 0,
        protocol=protocol, held_out=test,
    )  # fmt: skip
    looked_at = [HeldOutErrors(*row[3:]) for row in rows if row.held_out_loss is not None]
    scores = [errors.score(protocol.selection) for errors in looked_at]
    kept = held_out_errors(localizer, test, statistics, "float32")
    assert kept.score(protocol.selection) == pytest.approx(min(scores), rel=1e-6)
    assert len(scores) > 1


# Loss and product of the medians disagree about which is best; not a number never is.
COURSE = [
    HeldOutErrors(math.nan, math.nan, math.nan),
    HeldOutErrors(3.0, 2.0, 2.0),
    HeldOutErrors(1.0, 1.0, 5.0),
    HeldOutErrors(2.0, 1.0, 3.0),
    HeldOutErrors(math.nan, math.nan, math.nan),
]


@pytest.mark.parametrize(("kind", "best"), [("validation", 3), ("test", 2)])
def test_test_frames_choose_by_loss_and_validation_by_errors(kind, best, splits, monkeypatch):
    course = iter(COURSE)
    monkeypatch.setattr(selection, "held_out_errors", lambda *_: next(course))
    localizer = build_localizer("posenet2", NETWORK, HYPER)
    chosen = Selection(kind, localizer, None, read_split(splits[1]), "float32")
    for index in range(len(COURSE)):
        torch.nn.init.constant_(localizer.criterion.s_position, index)
        chosen.evaluate()
    assert [chosen.stale(p) for p in (None, 4 - best, 5 - best)] == [False, True, False]
    chosen.restore()
    assert localizer.criterion.s_position.item() == best


@pytest.mark.parametrize("n_held_out", [1, 30])
def test_validation_takes_five_percent_of_the_time(n_held_out, splits):
    frames = read_split(splits[1]).part(np.arange(30) < n_held_out)
    localizer = build_localizer("posenet2", NETWORK, HYPER)
    for samples in (400, 2000, 10_000):
        steps = samples // 16
        chosen = Selection("validation", localizer, None, frames, "float32")
        due = chosen.due_after(steps, samples)
        assert steps in due
        assert max(due) == steps
        assert len(due) == 20 or len(due) * n_held_out / 3 <= 0.05 * samples
        assert len(due) == 20 or (len(due) + 1) * n_held_out / 3 > 0.05 * samples
        gaps = np.diff([0, *sorted(due)])
        assert gaps.max() - gaps.min() <= 1
        assert len(Selection("test", localizer, None, frames, "float32").due_after(steps, 1)) == 20
    assert not Selection("last", localizer, None, frames, "float32").due_after(100, 1600)


def test_held_out_errors_are_those_of_another_implementation(splits, monkeypatch):
    frames = read_split(splits[1])
    rng = np.random.default_rng(2)
    position_m = frames.position_m.numpy() + rng.normal(size=(30, 3))
    turned = Rotation.from_rotvec(rng.normal(size=(30, 3)))
    quat_wxyz = -2.5 * turned.as_quat(scalar_first=True)  # neither sign nor length counts
    localizer = build_localizer("posenet2", NETWORK, HYPER)
    answer = PosePrediction(
        *(torch.tensor(v, dtype=torch.float32) for v in (position_m, quat_wxyz))
    )
    auxiliary = PosePrediction(answer.position_m + 9, -answer.quat_wxyz.roll(1, 1))
    monkeypatch.setattr(localizer, "forward", lambda images: [answer, auxiliary])
    found = held_out_errors(localizer, frames, statistics_of(frames), "float32")
    true = Rotation.from_quat(frames.quat_wxyz.numpy(), scalar_first=True)
    distance = np.linalg.norm(position_m - frames.position_m.numpy(), axis=1)
    angle = np.degrees((turned.inv() * true).magnitude())
    assert found.position_m == pytest.approx(np.median(distance), rel=1e-5)
    assert found.orientation_deg == pytest.approx(np.median(angle), rel=1e-4)
    assert localizer.training


def test_the_rate_is_halved_at_each_share():
    parameter = torch.nn.Linear(2, 2)
    optimisation = optimisation_of("halving", parameter, Schedule(1600, 16, 0.8, 0.0, 0.3))
    rates = []
    for _ in range(100):
        rates.append(optimisation.learning_rate)
        optimisation.step(parameter(torch.ones(2)).sum())
    assert rates == pytest.approx([0.8] * 30 + [0.4] * 30 + [0.2] * 30 + [0.1] * 10)


@pytest.mark.parametrize(("kind", "decays"), [("muon", False), ("adamw", False), ("halving", True)])
def test_biases_decay_in_the_published_protocol_alone(kind, decays):
    layer = torch.nn.Linear(2, 2)
    torch.nn.init.ones_(layer.weight)  # longer than a step
    torch.nn.init.ones_(layer.bias)
    optimisation = optimisation_of(kind, layer, Schedule(160, 16, 0.1, 0.5))
    before = layer.weight.detach().clone()
    optimisation.step(0.0 * sum(parameter.sum() for parameter in layer.parameters()))
    assert (layer.bias < 1).all() == decays
    assert (layer.weight.abs() < before.abs()).all()


def test_patience_ends_a_published_training_early(splits, tmp_path, monkeypatch):
    worse = iter(HeldOutErrors(float(k), 1.0, 1.0) for k in range(99))
    monkeypatch.setattr(selection, "held_out_errors", lambda *_: next(worse))
    training = PUBLISHED.model_copy(update={"patience": 3})
    _, history = train(splits[0], tmp_path, samples=640, training=training, test=splits[1])
    rows = [row for _, row in read_records(history)]
    assert int(rows[-1]["samples_seen"]) == 640 // 20 * 4


RUN = {"scene": "large_room", "size": "6k", "labels": "synfeal", "init": "scratch"}
RUN |= {"model": "posenet", "repetition": 0}
OTHERS = {"scene": "sanctuary", "size": "20k", "init": "pretrained", "model": "posenet2"}


class Recorder(Jitter):
    """Remembers what was shown, image by image."""

    def __init__(self):
        super().__init__()
        self.shown: list[torch.Tensor] = []

    def __call__(self, images, quat_wxyz):
        self.shown.append(images.sum(dim=(1, 2, 3)))
        return super().__call__(images, quat_wxyz)


@pytest.mark.parametrize(("n_paths", "share", "count"), [(20, 0.1, 2), (10, 0.5, 5), (3, 0.9, 2)])
def test_a_stretch_is_of_paths_that_follow_each_other(n_paths, share, count):
    path = np.repeat(np.arange(n_paths), 4)
    firsts = set()
    for seed in range(12):
        held = np.unique(path[held_out_stretch(path, share, seed)])
        np.testing.assert_array_equal(held, held[0] + np.arange(count))
        firsts.add(int(held[0]))
    assert len(firsts) > 1  # the seed decides which
    assert not held_out_stretch(path, 0.0, 0).any()
    assert not held_out_stretch(np.zeros(5, int), 0.5, 0).any()  # never all


@pytest.mark.parametrize(("share", "left"), [(0.0, 60), (0.3, 40)])
def test_labels_change_neither_order_nor_held_out_paths(tmp_path, share, left):
    frames, labels = write_split(tmp_path, "train", 60, 0)
    noisy = tmp_path / "noisy.csv"
    write_pose_table(noisy, add_noise(read_pose_table(labels), 0.3, 20, np.random.default_rng(0)))
    training = TRAINING.model_copy(update={"validation_share": share})
    shown = []
    for path in (labels, noisy):
        recorder = Recorder()
        train((frames, path), tmp_path, training=training, augment=recorder)
        shown.append(torch.cat(recorder.shown))
    assert torch.equal(*shown)
    assert len(shown[0].unique()) == left
