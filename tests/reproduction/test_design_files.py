"""Files and jobs of a profile, on designs small enough to count by hand."""

from itertools import pairwise

import pytest

from baselines.config.references import ReferencesConfig
from reproduction.config.load import load_config
from reproduction.design.experiments import read_design
from reproduction.design.files import Files
from reproduction.design.jobs import jobs_of_run
from reproduction.design.side_tables import made_side_tables
from tests import CONFIG

ROW = {"table": "table4_size", "scene": "large_room", "size": "6k"}


def files_of(*rows, **changes):
    """Files of the smoke profile with this design: 60 + 25 frames in batches of 20."""
    config = load_config(CONFIG / "config.yaml", CONFIG / "smoke.yaml")
    config = config.model_copy(update={"experiments": rows, "tables": None, **changes})
    return Files(config, read_design(config))


def test_one_row_needs_its_scene_five_runs_and_no_large_frame():
    files = files_of(ROW)
    jobs = jobs_of_run(files)
    assert jobs["scene"] == [{"scene": "large_room"}]
    assert jobs["plan"] == [{"scene": "large_room", "split": s} for s in ("train", "test")]
    assert {job["model"] for job in jobs["train"]} == {
        "posenet",
        "poselstm",
        "hourglass",
        "posenet2resnet",
        "posenet2",
    }
    assert len(jobs["train"]) == 5
    assert not {"render", "dataset", "sfm", "rgbd", "chain", "features"} & set(jobs)
    assert files.manifests("estimation") == []
    assert not {"assistance", "label_error"} & set(made_side_tables(files))


def test_an_estimated_row_adds_its_batches_and_large_frames():
    jobs = jobs_of_run(files_of(ROW, {**ROW, "table": "table2_ground_truth", "labels": "sfm"}))
    # Batches share a frame: 60 frames are 3 of up to 21, 25 are 2.
    batches = [(job["split"], job["batch"]) for job in jobs["sfm"]]
    counts = {"train": 3, "test": 2}
    assert batches == [(s, f"00{b}") for s, count in counts.items() for b in range(count)]
    assert jobs["chain"] == [{"scene": "large_room", "size": "6k", "reconstructed": "sfm"}]
    assert {job["camera"] for job in jobs["render"]} == {"estimation"}
    assert "rgbd" not in jobs
    assert len(jobs["train"]) == 10


def test_structure_on_all_sizes_needs_large_frames_and_no_estimated_labels():
    asked = {"groups": ["images", "structure"], "structure_sizes": "all"}
    rows = (ROW, {**ROW, "size": "20k"})
    files = files_of(*rows, references=ReferencesConfig(**asked))
    jobs = jobs_of_run(files)
    assert not {"sfm", "rgbd", "chain"} & set(jobs)
    # Those of the larger size, of which the smaller one has the first.
    assert files.n_frames("large_room", "estimation", "train") == 200
    drawn = [files.sequence("large_room", "estimation", job["sequence"]) for job in jobs["render"]]
    assert sum(len(sequence) for sequence in drawn if sequence.split == "train") == 200
    assert {(job["size"], job["split"]) for job in jobs["features"]} == {
        (size, split) for size in ("6k", "20k") for split in ("train", "test")
    }
    assert {job["size"] for job in jobs["structure_references"]} == {"6k", "20k"}
    # Retrieval needs no depth, wherever it is asked for.
    retrieval = ReferencesConfig(**{**asked, "groups": ["images"]})
    assert files_of(*rows, references=retrieval).depth_scenes == []


@pytest.mark.parametrize(("sizes", "frames"), [(["6k"], 60), (["6k", "40k"], 400), (["20k"], 200)])
def test_no_frame_is_drawn_that_no_row_is_learned_from(sizes, frames):
    """The smoke profile has a hundredth of the paper's frames."""
    files = files_of(*({**ROW, "size": size} for size in sizes))
    assert files.n_frames("large_room", "network", "train") == frames
    drawn = [s for s in files.sequences("large_room", "network") if s.split == "train"]
    assert sum(len(sequence) for sequence in drawn) == frames


@pytest.mark.parametrize("labels", ["rgbd-toro", "rgbd-g2o"])
def test_pose_graphs_are_built_once_and_solved_by_each_method(labels):
    row = {**ROW, "table": "table2_ground_truth", "labels": labels}
    jobs = jobs_of_run(files_of(ROW, row))
    assert len(jobs["rgbd"]) == len(jobs["posegraph"]) == 5
    assert {job["graph_method"] for job in jobs["posegraph"]} == {labels}


def test_scratch_starts_from_nothing_and_errors_of_labels_are_named_by_their_size():
    noisy = {
        **ROW,
        "table": "table3_inconsistencies",
        "block": "position",
        "labels": "noise",
        "noise_m": 0.3,
    }
    files = files_of({**ROW, "init": "scratch"}, {**noisy, "init": "scratch"})
    jobs = jobs_of_run(files)
    assert "pretrain" not in jobs
    assert files.weights("posenet2", "scratch-half") is None
    assert files.weights("posenet2", "pretrained").endswith("/pretrained/googlenet.pt")
    assert [(job["noise_m"], job["noise_deg"]) for job in jobs["erroneous_labels"]] == [
        ("0.3", "0")
    ] * 2


def test_sequences_end_where_frames_do():
    files = files_of(ROW, shard_frames=25)
    names = [s.name for s in files.sequences("large_room", "network")]
    assert len(names) == len(set(names))
    train = [s for s in files.sequences("large_room", "network") if s.split == "train"]
    assert train[0].start == 0
    assert train[-1].stop == files.n_frames("large_room", "network", "train")
    assert all(a.stop == b.start for a, b in pairwise(train))
    dirs = files.sequence_dirs("large_room", "network", "train", stop=26)
    assert [path.rsplit("/", 1)[1] for path in dirs] == ["seq-01", "seq-02"]
    assert len(files.packed_shards("large_room", "train", "npy")) == len(train)
