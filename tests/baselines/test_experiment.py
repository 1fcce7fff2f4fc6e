"""A run that is scored where it is predicted has the scores that its stored predictions get."""

import numpy as np
import pytest

from baselines.training.experiment import Scoring, train_and_score
from baselines.training.predict import predict_poses
from baselines.training.run import CommonTest, RunFiles, SplitFiles
from baselines.training.score import write_scores
from synfeal.config.dataset import CameraConfig
from synfeal.errors import InputError
from tests.support.colored_frames import HYPER, NETWORK, TRAINING, write_split

N_TEST = 20
CAMERA = CameraConfig(width=32, height=32)
WILDCARDS = {"scene": "room", "model": "posenet2"}


@pytest.fixture
def files(tmp_path):
    frames, labels = write_split(tmp_path, "train", 32, 1)
    test_frames, test_labels = write_split(tmp_path, "test", N_TEST, 2)
    depth = tmp_path / "depth.npy"
    np.save(depth, np.full((N_TEST, 48), 2000, np.uint16))
    run = {
        "training": TRAINING.model_dump(mode="json", exclude={"samples_seen", "repetitions"})
        | {"augmentation": {"tilt_deg": 0, "roll_deg": 0}},
        "network": NETWORK.model_dump(mode="json"),
        "localizer": HYPER.model_dump(mode="json"),
        "samples_seen": 32,
        "seed": 0,
    }
    return {
        "model": "posenet2",
        "train": SplitFiles(frames, labels),
        "test": SplitFiles(test_frames, test_labels),
        "run": run,
    }


def outputs(folder, test, depth):
    """Objects that a run in a folder is given, by argument."""
    return {
        "common": CommonTest(test.labels, 2, folder / "common.csv"),
        "out": RunFiles(
            model=folder / "model.pt",
            history=folder / "history.csv",
            record=folder / "training.json",
            predictions=folder / "predictions.csv",
        ),
        "scoring": Scoring(
            truth=test.labels,
            depth=depth,
            camera=CAMERA,
            wildcards=WILDCARDS,
            out_errors=folder / "errors.csv",
            out_common_errors=folder / "common_errors.csv",
            out_metrics=folder / "metrics.json",
        ),
    }


@pytest.fixture
def made(files, tmp_path):
    (tmp_path / "run").mkdir()
    return outputs(tmp_path / "run", files["test"], tmp_path / "depth.npy")


def test_scores_are_those_of_the_stored_predictions(files, made, tmp_path):
    (tmp_path / "again").mkdir()
    scored = outputs(tmp_path / "again", files["test"], tmp_path / "depth.npy")["scoring"]
    train_and_score(**files, **made)
    names = ("out_errors", "out_metrics", "out_common_errors")
    write_scores(
        predictions=made["out"].predictions,
        labels=files["test"].labels,
        truth=scored.truth,
        train_labels=files["train"].labels,
        depth=scored.depth,
        camera=CAMERA,
        common=made["common"].out,
        common_truth=made["common"].truth,
        wildcards=WILDCARDS,
        **{name: getattr(scored, name) for name in names},
    )
    for name in names:
        assert getattr(made["scoring"], name).read_bytes() == getattr(scored, name).read_bytes()


def test_predictions_are_those_of_the_checkpoint(files, made, tmp_path):
    train_and_score(**files, **made)
    again = tmp_path / "again.csv"
    for path, every in {made["out"].predictions: 1, made["common"].out: 2}.items():
        predict_poses(made["out"].model, *files["test"], again, "cpu", every)
        assert again.read_bytes() == path.read_bytes()


def test_without_scoring_there_are_predictions_alone(files, made):
    scoring = made.pop("scoring")
    train_and_score(**files, **made)
    assert made["out"].predictions.exists()
    assert not scoring.out_errors.exists()
    assert not scoring.out_metrics.exists()


def test_what_cannot_be_scored_is_not_trained(files, made, tmp_path):
    np.save(tmp_path / "depth.npy", np.full((N_TEST - 1, 48), 2000, np.uint16))
    with pytest.raises(InputError, match=r"depth\.npy"):
        train_and_score(**files, **made)
    assert not made["out"].model.exists()
