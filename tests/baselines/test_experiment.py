"""A run that is scored where it is predicted has the scores that its stored predictions get."""

import numpy as np
import pytest

from baselines.training.experiment import train_and_score
from baselines.training.predict import predict_poses
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
        "frames": frames,
        "labels": labels,
        "test_frames": test_frames,
        "test_labels": test_labels,
        "run": run,
        "truth": test_labels,
        "depth": depth,
        "camera": CAMERA,
        "common": test_labels,
        "every": 2,
        "wildcards": WILDCARDS,
    }


def outputs(folder):
    names = ("predictions", "common", "errors", "common_errors", "history")
    paths = {f"out_{name}": folder / f"{name}.csv" for name in names}
    return paths | {
        "out_model": folder / "model.pt",
        "out_record": folder / "training.json",
        "out_metrics": folder / "metrics.json",
    }


def test_scores_are_those_of_the_stored_predictions(files, tmp_path):
    first, again = tmp_path / "run", tmp_path / "again"
    first.mkdir()
    again.mkdir()
    made, scored = outputs(first), outputs(again)
    train_and_score(**files, **made)
    write_scores(
        predictions=made["out_predictions"],
        labels=files["test_labels"],
        truth=files["truth"],
        train_labels=files["labels"],
        depth=files["depth"],
        camera=CAMERA,
        common=made["out_common"],
        common_truth=files["common"],
        wildcards=WILDCARDS,
        **{name: scored[name] for name in ("out_errors", "out_metrics", "out_common_errors")},
    )
    for name in ("out_errors", "out_metrics", "out_common_errors"):
        assert made[name].read_bytes() == scored[name].read_bytes()


def test_predictions_are_those_of_the_checkpoint(files, tmp_path):
    (tmp_path / "run").mkdir()
    made = outputs(tmp_path / "run")
    train_and_score(**files, **made)
    again = tmp_path / "again.csv"
    for name, every in {"predictions": 1, "common": 2}.items():
        predict_poses(
            made["out_model"], files["test_frames"], files["test_labels"], again, "cpu", every
        )
        assert again.read_bytes() == made[f"out_{name}"].read_bytes()


def test_without_a_place_for_scores_there_are_predictions_alone(files, tmp_path):
    (tmp_path / "run").mkdir()
    made = outputs(tmp_path / "run")
    scores = {name: made.pop(name) for name in ("out_errors", "out_metrics", "out_common_errors")}
    train_and_score(**files, **made)
    assert made["out_predictions"].exists()
    assert not any(path.exists() for path in scores.values())


def test_what_cannot_be_scored_is_not_trained(files, tmp_path):
    np.save(files["depth"], np.full((N_TEST - 1, 48), 2000, np.uint16))
    made = outputs(tmp_path)
    with pytest.raises(InputError, match=r"depth\.npy"):
        train_and_score(**files, **made)
    assert not made["out_model"].exists()
