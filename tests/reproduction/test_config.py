"""Configuration: what is refused and how that reads, and the design of the shipped profiles."""

import copy
from collections import Counter
from pathlib import Path

import pytest
import yaml

from baselines.config.learning import MODELS
from reproduction.config.load import load_config, parse_config
from reproduction.design.docs import main
from reproduction.design.experiments import Design, Run, read_design, read_experiments
from synfeal.config.load import merge, read_yaml
from synfeal.errors import InputError
from synfeal.records.provenance import config_hash
from tests import CONFIG
from tests.support.report_results import design_of, experiment

PROFILES = {
    "mini": ("config.yaml",),
    "smoke": ("config.yaml", "smoke.yaml"),
    "paper": ("config.yaml", "paper.yaml"),
}


@pytest.fixture(autouse=True)
def _in_the_repository(monkeypatch):
    monkeypatch.chdir(CONFIG.parent)  # profiles name files relative to it


@pytest.fixture
def raw():
    return read_yaml(CONFIG / "config.yaml")


def profile(name):
    return load_config(*(CONFIG / file for file in PROFILES[name]))


def test_a_missing_key_and_what_a_section_needs_and_allows_is_said(raw):
    del raw["scenes"]["sanctuary"]["source"]
    with pytest.raises(InputError, match=r"^my\.yaml: scenes\.sanctuary\.source: missing"):
        parse_config(raw, "my.yaml")
    raw["scenes"]["sanctuary"]["source"] = "procedural"
    del raw["localizers"]["hourglass"]
    with pytest.raises(InputError, match=r"my\.yaml: localizers: hourglass missing"):
        parse_config(raw, "my.yaml")


def test_a_profile_overrides_key_by_key_and_the_message_names_both_files(tmp_path):
    base = {"a": {"b": 1, "c": [1, 2, 3]}, "d": {"e": 1}}
    override = {"a": {"c": [9]}, "d": 5, "f": {"g": 1}}
    kept = copy.deepcopy(base)
    assert merge(base, override) == {"a": {"b": 1, "c": [9]}, "d": 5, "f": {"g": 1}}
    assert base == kept
    override = tmp_path / "mine.yaml"
    override.write_text(yaml.safe_dump({"profile": "mine", "network": {"input_px": 48}}))
    config = load_config(CONFIG / "config.yaml", override)
    default = profile("mini")
    assert (config.profile, config.network.input_px) == ("mine", 48)
    assert (config.network.width, config.scenes) == (default.network.width, default.scenes)
    override.write_text("network: {input_pixels: 48}")
    with pytest.raises(InputError, match=r"config\.yaml \+ .*mine\.yaml: network\.input_pixels"):
        load_config(CONFIG / "config.yaml", override)


@pytest.mark.parametrize("name", PROFILES)
def test_the_shipped_profiles_and_their_designs_load(name):
    config = profile(name)
    assert config.profile == name
    assert config.root == Path("results") / name
    assert read_experiments(config)


def test_a_profile_leaves_out_an_effect_of_another_by_null(tmp_path):
    base = set(profile("mini").robustness.effects)
    file = tmp_path / "fewer.yaml"
    file.write_text("robustness: {effects: {jpeg_1: null}}")
    assert set(load_config(CONFIG / "config.yaml", file).robustness.effects) == base - {"jpeg_1"}


def test_a_run_is_repeated_as_often_as_any_of_its_tables_asks():
    rows = (
        experiment("table4_size"),
        experiment("table2_ground_truth", labels="sfm"),
        experiment("table2_ground_truth"),
        experiment("table5_from_scratch", size="20k", init="scratch"),
    )
    design = Design(rows=rows, repetitions={"default": 2, "table2_ground_truth": 3})
    asked = Counter((r.size, r.labels, r.init) for r in design.runs if r.model == "posenet")
    assert asked == {
        ("6k", "synfeal", "pretrained"): 3,  # Table 4 shows the third as well
        ("6k", "sfm", "pretrained"): 3,
        ("20k", "synfeal", "scratch"): 2,
        ("20k", "synfeal", "pretrained"): 2,  # what Table 5 compares with, in no row of its own
    }
    first = rows[0]
    run = Run("large_room", "6k", "synfeal", "pretrained", "posenet", 0)
    assert design.runs_of(first, "posenet")[0] == run
    assert len(design.table_runs("table4_size")) == 3 * 5
    assert set(design_of([first]).runs) < set(design.runs)


def test_a_run_is_repeated_as_often_as_its_localizer_asks():
    rows = (experiment("table2_ground_truth", labels="sfm"), experiment("table2_ground_truth"))
    asked = {"table2_ground_truth": 2, "posenet": 5, "hourglass": 1}
    design = Design(rows=rows, repetitions=asked)
    per_cell = Counter((run.labels, run.model) for run in design.runs)
    for labels in ("sfm", "synfeal"):
        found = {model: per_cell[labels, model] for model in MODELS}
        assert found == {**dict.fromkeys(MODELS, 2), "posenet": 5}
    assert [run.repetition for run in design.runs_of(rows[0], "posenet")] == [0, 1, 2, 3, 4]
    assert len(design.table_runs("table2_ground_truth")) == 2 * (5 + 4 * 2)


def test_a_run_is_repeated_as_often_as_its_size_asks():
    rows = [experiment("table4_size", size=size) for size in ("6k", "20k", "80k")]
    rows.append(experiment("table5_from_scratch", size="20k", init="scratch"))
    asked = {"default": 1, "6k": 3, "80k": 4, "table5_from_scratch": 2}
    design = Design(rows=rows, repetitions=asked)
    found = Counter((r.size, r.init) for r in design.runs if r.model == "posenet")
    # Table 5 compares with transfer learning, so that its own number holds there, too.
    assert found == {
        ("6k", "pretrained"): 3,
        ("20k", "pretrained"): 2,
        ("20k", "scratch"): 2,
        ("80k", "pretrained"): 4,
    }
    assert [run.repetition for run in design.runs_of(rows[2], "posenet")] == [0, 1, 2, 3]
    assert len(design.table_runs("table4_size")) == 5 * (3 + 2 + 4)


def test_repetitions_of_an_unknown_table_or_size_are_refused(tmp_path):
    override = tmp_path / "mine.yaml"
    override.write_text("training: {repetitions: {table9_nothing: 3}}\n")
    with pytest.raises(InputError, match=r"training\.repetitions.*'table9_nothing'.*default.*95k"):
        load_config(CONFIG / "config.yaml", override)
    override.write_text("training: {repetitions: {7k: 3}}\n")
    with pytest.raises(InputError, match=r"training\.repetitions.*'7k'"):
        load_config(CONFIG / "config.yaml", override)
    override.write_text("training: {repetitions: {table3_inconsistencies: 3}}\n")
    design = read_design(load_config(CONFIG / "config.yaml", override))
    assert max(run.repetition for run in design.runs) == 2


def test_further_scenes_are_labelled_as_the_rows_are():
    config = load_config(CONFIG / "config.yaml", CONFIG / "night.yaml")
    design = read_design(config)
    own = [row for row in design.rows if row.table == "table2_ground_truth" and row.estimated]
    methods = [row.labels for row in own]
    rooms = ("large_room", "sanctuary")
    assert design.estimated == [(room, "6k", method) for room in rooms for method in methods]
    estimation = config.estimation.model_copy(update={"more_scenes": ("attic",)})
    with pytest.raises(InputError, match=r"more_scenes: 'attic': .* no row of size '6k'"):
        read_design(config.model_copy(update={"estimation": estimation}))


def test_a_run_of_one_table_leaves_out_further_scenes_that_it_has_no_rows_of():
    config = load_config(CONFIG / "config.yaml", CONFIG / "night.yaml")
    alone = read_design(config.model_copy(update={"tables": ("table2_ground_truth",)}))
    assert {scene for scene, _, _ in alone.estimated} == {"large_room"}
    estimation = config.estimation.model_copy(update={"more_scenes": ("attic",)})
    wrong = {"estimation": estimation, "tables": ("table2_ground_truth",)}
    with pytest.raises(InputError, match="more_scenes: 'attic'"):
        read_design(config.model_copy(update=wrong))


def test_a_dose_changes_what_a_profile_is_known_by():
    mini = profile("mini")
    estimation = mini.estimation.model_copy(update={"noise_dose": "code"})
    other = mini.model_copy(update={"estimation": estimation})
    assert config_hash(mini) != config_hash(other)
    assert read_design(mini).model_dump() != read_design(other).model_dump()
    with pytest.raises(InputError, match=r"estimation\.noise_dose: .*'text' or 'code'"):
        parse_config(
            merge(read_yaml(CONFIG / "config.yaml"), {"estimation": {"noise_dose": "print"}}),
            "my.yaml",
        )


@pytest.mark.parametrize("name", ["mini", "paper"])
def test_the_design_is_the_papers(name):
    config = profile(name).model_copy(update={"tables": None})
    experiments = read_experiments(config)
    rows = Counter(row.table for row in experiments)
    # And KinectFusion, of which the paper only writes, where frames are close enough for it.
    added = int(config.collection.frame_spacing_m < 0.05)
    assert rows == {
        "table2_ground_truth": 4 + added,
        "table3_inconsistencies": 12,
        "table4_size": 8,
        "table5_from_scratch": 4,
        "table6_label_errors": 1 + 4 * 2 + 3,  # our own, as the next
        "table7_images_shown": 2 * 3,
    }
    runs = design_of(experiments).runs
    # 24 data sets and starts of the paper, the nine of Table 6 that Table 3 does not share, and
    # four of Table 7 that see fewer images
    assert len(runs) == len({run.directory for run in runs}) == (24 + added + 9 + 4) * 5
    assert "large_room/6k/noise-p0.1-r5/pretrained/posenet/seed0" in {r.directory for r in runs}
    both = [row for row in experiments if row.block == "both" and row.labels == "noise"]
    assert {(r.noise_m, r.noise_deg) for r in both} == {(0.1, 5.0), (0.2, 10.0), (0.3, 20.0)}


def test_a_design_is_files_and_rows_one_after_the_other(tmp_path):
    path = with_experiments(tmp_path / "some.csv", GOOD).experiments
    row = {"table": "table4_size", "scene": "large_room", "size": "20k"}
    both = profile("mini").model_copy(update={"experiments": (path, row)})
    assert [(e.scene, e.size) for e in read_experiments(both)] == [
        ("large_room", "6k"),
        ("large_room", "20k"),
    ]
    # Each part names itself in what is wrong with it.
    for parts, where in (
        ((path, {**row, "size": "6k"}), r"experiments: row 2: .*once"),
        ((row, path, path), r"some\.csv: row 2: .*once"),
        ((row, tmp_path / "none.csv"), r"none\.csv"),
    ):
        with pytest.raises(InputError, match=where):
            read_experiments(both.model_copy(update={"experiments": parts}))


def test_sizes_scale_with_the_profile():
    mini, smoke, paper = profile("mini"), profile("smoke"), profile("paper")
    assert mini.scale == 0.25
    frames = [mini.n_frames("large_room", "6k", split) for split in ("train", "test")]
    assert frames == [1500, 625]
    assert mini.n_frames("sanctuary", "95k", "train") == 23_750
    assert mini.n_largest("large_room", "train") == 20_000
    assert smoke.n_frames("large_room", "6k", "train") == 60
    assert paper.n_frames("sanctuary", "95k", "train") == 95_000
    tiny = mini.model_copy(update={"scale": 1e-6})
    assert tiny.n_frames("large_room", "6k", "test") == 2  # a split is never empty


GOOD = "table4_size,,large_room,6k,synfeal,0,0,pretrained"


def with_experiments(path, *lines):
    header = "table,block,scene,size,labels,noise_m,noise_deg,init"
    path.write_text("\n".join([header, *lines]) + "\n", encoding="utf-8")
    return profile("mini").model_copy(update={"experiments": path})


def test_a_size_needs_a_training_length_and_a_byte_order_mark_does_no_harm(tmp_path):
    config = with_experiments(tmp_path / "design.csv", GOOD)
    training = config.training.model_copy(update={"samples_seen": {"20k": 1}})
    with pytest.raises(InputError, match=r"size '6k' has no training\.samples_seen entry"):
        read_experiments(config.model_copy(update={"training": training}))
    path = tmp_path / "design.csv"
    config = with_experiments(path, GOOD)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert len(read_experiments(config)) == 1


def test_documentation_that_drifted_is_noticed(tmp_path, capsys):
    for name in ("config.yaml", "smoke.yaml", "night.yaml", "paper.yaml"):
        (tmp_path / name).write_bytes((CONFIG / name).read_bytes())
    assert main(["--folder", str(tmp_path)]) == 0
    assert main(["--check", "--folder", str(tmp_path)]) == 0
    (tmp_path / "smoke.yaml").write_text("profile: smoke\nscale: 0.02\n")
    assert main(["--check", "--folder", str(tmp_path)]) == 1
    assert "README.md: out of date" in capsys.readouterr().err
