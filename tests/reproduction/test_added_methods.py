"""Methods of another package: one file each is all it takes, from the design to a trained model."""

import json
import re
import subprocess
import sys

import pytest
import yaml

from synfeal.config.load import merge, read_yaml
from tests import ROOT
from tests.support.added_methods import examples, install

ROW = {"table": "table2_ground_truth", "scene": "large_room", "size": "6k"}
DESIGN = {
    "profile": "mine",
    "tables": None,
    "experiments": [
        ROW,
        ROW | {"labels": "constant"},
        ROW | {"table": "table6_label_errors", "labels": "lean", "noise_m": 0.1},
    ],
}
SETTINGS = """
from pydantic import Field

from baselines.config.learning import LocalizerConfig


class DirectConfig(LocalizerConfig):
    pull: float = Field(0.5, gt=0, description="how hard")
"""


def python(environment, code, *arguments):
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(command, env=environment, cwd=ROOT, capture_output=True, text=True)


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The package of the page; its localizer has hyper-parameters of its own, too."""
    modules = examples()
    assert set(modules) == {"direct", "constant", "lean", "first_label"}
    own = 'halve_every=(150, 300), hyper="my_methods.settings:DirectConfig")'
    assert modules["direct"].count("halve_every=(150, 300))") == 1
    modules["direct"] = modules["direct"].replace("halve_every=(150, 300))", own)
    folder = tmp_path_factory.mktemp("installed")
    environment = install(folder, modules)
    (folder / "my_methods" / "settings.py").write_text(SETTINGS)
    return environment


LISTS = """
import sys
from baselines.config.learning import MODELS
from baselines.labels.methods import frame_methods
from baselines.references.registry import in_group, titles_of
from reproduction.design.experiments import INJECTED
from reproduction.figures.style import METHOD_STYLES, MODEL_STYLES
from reproduction.tables.layouts import ERRORS, SOURCES, TITLES, label_title
assert MODELS[-1] == "direct" and TITLES["direct"] == "Direct"
styles = [str(style) for style in MODEL_STYLES.values()]
assert len({*styles}) == len(MODELS)
assert frame_methods()[-1] == "constant" and SOURCES["constant"] == "Constant pose"
assert "constant" in METHOD_STYLES
assert INJECTED[-1] == "lean" and ERRORS["lean"] == "one error for all"
assert label_title("lean-p0.1-r5") == "lean 0.1 m, 5°"
assert in_group("images")[-1] == "first-label" and titles_of({})["first-label"] == "First label"
assert not {"torch", "open3d", "my_methods.direct", "my_methods.constant"} & set(sys.modules)
"""


def test_tables_and_figures_know_them_without_loading_them(installed):
    run = python(installed, LISTS)
    assert run.returncode == 0, run.stderr


def test_a_design_with_them_is_planned(installed, tmp_path):
    profile, out = tmp_path / "mine.yaml", tmp_path / "jobs.json"
    profile.write_text(yaml.safe_dump(merge(read_yaml(ROOT / "config/smoke.yaml"), DESIGN)))
    command = [sys.executable, "-m", "tests.support.dry_run", profile, tmp_path, out]
    run = subprocess.run(command, env=installed, cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stdout[-3000:] + run.stderr[-3000:]
    outputs = {name for job in json.loads(out.read_text()) for name in job["output"]}
    root = f"{tmp_path}/mine"
    assert f"{root}/labels/large_room/6k/constant/train.csv" in outputs
    assert f"{root}/labels/large_room/6k/lean-p0.1-r0/test.csv" in outputs
    assert f"{root}/runs/large_room/6k/constant/pretrained/direct/seed0/model.pt" in outputs
    assert f"{root}/references/large_room/6k/synfeal/first-label/metrics.json" in outputs


TRAINS = """
import sys
from pathlib import Path
import numpy as np
from baselines.config.labels import EstimationConfig
from baselines.config.learning import hyper_of
from baselines.labels.injected import with_error
from baselines.labels.methods import estimate_batch
from baselines.references.evidence import Evidence
from baselines.references.run import answer_and_score
from baselines.training.checkpoint import read_checkpoint
from baselines.training.predict import predict_poses
from baselines.training.train import RATE, recipe_of
from synfeal.config.dataset import CameraConfig
from synfeal.dataset.pose_table import read_pose_table, write_pose_table
from synfeal.geometry.poses import pose_error
from synfeal.records.files import read_json
from tests.support.colored_frames import CPU, train, write_split

folder = Path(sys.argv[1])
frames, labels = write_split(folder, "train", 40, 0)
truth = read_pose_table(labels)

hyper = hyper_of("direct")(learning_rate=2e-3, s_orientation=-1.0, pull=2.0)
assert recipe_of("direct") == hyper_of("direct")(learning_rate=RATE)
model, _ = train((frames, labels), folder, name="direct", hyper=hyper)
trained = read_checkpoint(model, CPU)
assert trained.description.localizer == "direct"
assert trained.description.hyper == hyper and trained.description.hyper.pull == 2.0
predict_poses(model, frames, labels, folder / "predictions.csv")
assert len(read_pose_table(folder / "predictions.csv")) == 40

rng = np.random.default_rng(0)
leant = with_error("lean", truth, truth, 0.3, 20.0, rng)
position_m, orientation_rad = pose_error(leant.world_from_cam, truth.world_from_cam)
np.testing.assert_allclose(position_m, 0.3)
np.testing.assert_allclose(np.degrees(orientation_rad), 20)

paths = [Path(f"{k}.png") for k in range(5)]
found, _ = estimate_batch("constant", paths, paths, CameraConfig(), EstimationConfig(), 0)
np.testing.assert_array_equal(found.first_from_cam, np.tile(np.eye(4), (5, 1, 1)))

names = ("train", "test", "train_truth", "test_truth")
evidence = Evidence(dict.fromkeys(names, labels), CameraConfig(), 0)
answer_and_score(evidence, ["first-label"], folder, {"scene": "room"})
answers = read_pose_table(folder / "first-label" / "predictions.csv")
np.testing.assert_allclose(answers.world_from_cam, np.tile(truth.world_from_cam[0], (40, 1, 1)))
assert read_json(folder / "first-label" / "metrics.json")["reference"] == "first-label"
"""


def test_each_does_its_work(installed, tmp_path):
    run = python(installed, TRAINS, tmp_path)
    assert run.returncode == 0, run.stderr[-3000:]


def test_hyper_parameters_of_its_own_are_checked(installed, tmp_path):
    profile = tmp_path / "mine.yaml"
    own = {"localizers": {"direct": {"pull": -1}}}
    profile.write_text(yaml.safe_dump(merge(read_yaml(ROOT / "config/config.yaml"), own)))
    code = "import sys; from pathlib import Path; from reproduction.config.load import load_config"
    run = python(installed, f"{code}; load_config(Path(sys.argv[1]))", profile)
    line = run.stderr.splitlines()[-1]
    assert re.search(r"InputError: .*localizers\.direct\.pull: must be above 0", line)


DECLARED = "from baselines.registry.kinds import LabelError\n{}\ndef error(table): ...\n"


@pytest.mark.parametrize(
    ("declaration", "entries", "message"),
    [
        ('@LabelError(name="noise", title="Mine")', None, "the name 'noise' is taken by baselines"),
        ('@LabelError(name="x" * 2, title="Mine")', None, "line 2: @LabelError: arguments must be"),
        ('@LabelError(name="Mine", title="Mine")', None, "name: 'Mine' must be lower-case"),
        ('@LabelError(name="mine")', None, "missing 1 required keyword-only argument: 'title'"),
        ("", None, "declares nothing, though the entry point 'mine'"),
        ("", "mine = my_methods.gone\n", "the entry point 'mine' of synfeal.methods is not there"),
    ],
)
def test_a_declaration_that_cannot_be_used_is_one_line(declaration, entries, message, tmp_path):
    environment = install(tmp_path, {"mine": DECLARED.format(declaration)}, entries)
    run = python(environment, "import baselines.labels.injected")
    assert "InputError" in run.stderr
    assert message in run.stderr.splitlines()[-1]
