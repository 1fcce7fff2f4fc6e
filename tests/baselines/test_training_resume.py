"""A training run that is stopped, in whatever way, and started again ends as an undisturbed one."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
import torch

from baselines.training import resume
from baselines.training.resume import digest
from synfeal.records.files import unfinished_prefix
from tests.support.colored_frames import HYPER, TRAINING, Jitter, train, write_split

SAMPLES, STEPS, KILLED_AT = 192, 12, 9
DROPOUT = HYPER.model_copy(update={"dropout": 0.5})
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def splits(tmp_path_factory):
    folder = tmp_path_factory.mktemp("splits")
    return write_split(folder, "train", 60, 0), write_split(folder, "test", 20, 1)


def run(splits, folder, augment, protocol="corrected", seed=1):
    training = TRAINING.model_copy(update={"protocol": protocol})
    given = {"samples": SAMPLES, "hyper": DROPOUT, "training": training, "test": splits[1]}
    return train(splits[0], folder, seed=seed, augment=augment, **given)


@pytest.fixture(scope="module")
def undisturbed(splits, tmp_path_factory):
    """Checkpoint and history of each protocol, trained without a stop."""
    folder = tmp_path_factory.mktemp("undisturbed")
    return {p: run(splits, folder / p, Jitter(), p) for p in ("corrected", "published")}


def assert_same(found, expected):
    """The same weights and history, bit by bit, and nothing left over."""
    states = [torch.load(paths[0], weights_only=True)["localizer"] for paths in (found, expected)]
    assert states[0].keys() == states[1].keys()
    assert [k for k in states[0] if not torch.equal(states[0][k], states[1][k])] == []
    assert found[1].read_text() == expected[1].read_text()
    assert sorted(p.name for p in found[0].parent.iterdir()) == ["history.csv", "model.pt"]


def fail():
    raise RuntimeError("stopped here")


@pytest.mark.parametrize("protocol", ["corrected", "published"])
def test_an_interrupted_training_ends_the_same(
    protocol, splits, undisturbed, tmp_path, monkeypatch
):
    monkeypatch.setattr(resume, "RESUME_EVERY_S", 0.0)
    with pytest.raises(RuntimeError, match="stopped here"):
        run(splits, tmp_path, Jitter(KILLED_AT, fail), protocol)
    rest = Jitter()
    assert_same(run(splits, tmp_path, rest, protocol), undisturbed[protocol])
    assert rest.calls == STEPS - (KILLED_AT - 1)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_waits_for_its_step_and_loses_nothing(number, splits, undisturbed, tmp_path):
    def stop():
        signal.raise_signal(number)

    before = signal.signal(number, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            run(splits, tmp_path, Jitter(KILLED_AT, stop))
        assert signal.getsignal(number) is signal.default_int_handler
    finally:
        signal.signal(number, before)
    assert [p.name for p in tmp_path.iterdir()] == ["resume.pt"]
    rest = Jitter()
    assert_same(run(splits, tmp_path, rest), undisturbed["corrected"])
    assert rest.calls == STEPS - KILLED_AT


KILLED = """
import os, signal, sys
from pathlib import Path
from baselines.training import resume
from tests.support.colored_frames import Jitter
from tests.baselines.test_training_resume import KILLED_AT, run
resume.RESUME_EVERY_S = 0.0
folder = Path(sys.argv[1])
splits = [(folder / f"{name}.npy", folder / f"{name}.csv") for name in ("train", "test")]
kill = lambda: os.kill(os.getpid(), signal.SIGKILL)
run(splits, Path(sys.argv[2]), Jitter(KILLED_AT, kill))
"""


def test_a_killed_process_ends_the_same(splits, undisturbed, tmp_path):
    command = [sys.executable, "-c", KILLED, str(splits[0][0].parent), str(tmp_path)]
    process = subprocess.run(command, cwd=ROOT, env=os.environ, check=False, capture_output=True)
    assert process.returncode == -signal.SIGKILL, process.stderr.decode()
    (
        tmp_path / f"{unfinished_prefix('resume')}left.pt"
    ).touch()  # as when it is killed while it writes
    rest = Jitter()
    assert_same(run(splits, tmp_path, rest), undisturbed["corrected"])
    assert rest.calls == STEPS - (KILLED_AT - 1)


def changed(content):
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


@pytest.mark.parametrize(
    ("damage", "seed"),
    [
        (changed, 1),
        (lambda content: content[:1000], 1),
        (lambda content: b"no" * 999, 1),
        (bytes, 2),
    ],
    ids=["a bit", "short", "another kind", "another training run"],
)
def test_a_file_that_is_not_its_own_is_ignored(
    damage, seed, splits, undisturbed, tmp_path, monkeypatch, caplog
):
    monkeypatch.setattr(resume, "RESUME_EVERY_S", 0.0)
    with pytest.raises(RuntimeError, match="stopped here"):
        run(splits, tmp_path, Jitter(3, fail), seed=seed)
    file = tmp_path / "resume.pt"
    file.write_bytes(damage(file.read_bytes()))
    whole = Jitter()
    assert_same(run(splits, tmp_path, whole), undisturbed["corrected"])
    assert whole.calls == STEPS
    assert "resume.pt: ignored" in caplog.text


@pytest.mark.parametrize("error", [torch.OutOfMemoryError("full"), AttributeError("ours")])
def test_a_sound_file_is_not_given_up_for_another_error(error, tmp_path, monkeypatch):
    """Without this a run that lacks memory for a moment would lose all that it had learned."""
    file = resume.ResumeFile(tmp_path / "resume.pt", "a run")
    file.save_if_due({"random": resume.RandomState(torch.device("cpu"))}, now=True)

    def fail(*args, **kwargs):
        raise error

    monkeypatch.setattr(torch, "load", fail)
    with pytest.raises(type(error)):
        file.load({})
    assert (tmp_path / "resume.pt").exists()


def test_a_digest_tells_any_change():
    values = [
        ("a", torch.zeros(2)),
        ("a", torch.tensor([0.0, 1e-30])),
        ("a", torch.zeros(2, 1)),
        ("a", torch.zeros(2, dtype=torch.int32)),
        ("a", {"b": torch.zeros(2)}),
        ("a", {"c": torch.zeros(2)}),
        ("ab", None),
        ("a", "b"),
    ]
    assert len({digest(*v) for v in values}) == len(values)
    assert digest("a", {"b": torch.zeros(2)}) == digest("a", {"b": torch.zeros(2)})
