"""No reader gives an image another frame's pose, whatever was deleted, renamed or doubled.

Readers return numbers of frames as read from each image, beside those of the poses it is paired
with; after any damage both are the same, or one line names what was damaged.
"""

import json
import warnings

import numpy as np
import pytest
import torch
from PIL import Image

import synfeal
from baselines.references.features import files_of_split
from baselines.training.data import read_labelled_frames
from synfeal.cli import main
from synfeal.dataset.packed import pack_frames
from synfeal.dataset.preview import write_preview
from synfeal.dataset.sevenscenes import read_split
from synfeal.errors import InputError
from synfeal.evaluation.run import Settings, evaluate
from synfeal.exporting.run import export
from synfeal.planning.repeat import read_poses
from synfeal.validation.run import validate
from tests.support import named_frames as numbered
from tests.support.collected import refused
from tests.support.named_frames import FIRST, N_TRAIN, PER_SEQUENCE

TRAIN = np.arange(FIRST, FIRST + N_TRAIN, dtype=float)


def api(dataset, _):
    found = synfeal.open_dataset(dataset).train
    shown = [numbered.value_of_image(image.read_bytes()) for image in found.images]
    return shown, found.world_from_cam[:, 0, 3]


def evaluated(dataset, work, named=True, split="train"):
    """Errors of the true poses of all frames that the set ever had."""
    poses = work / "poses.csv"
    numbered.write_true_table(poses, split, named)
    found = evaluate(dataset, poses, Settings(split=split))
    return found.errors["position_m"], np.zeros(len(found.frames.names))


def evaluated_by_row(dataset, work):
    return evaluated(dataset, work, named=False)


def previewed(dataset, work):
    """Return the frames that are shown, beside those of the data set in order."""
    out = work / "preview.gif"
    count = write_preview([dataset], out, 100, 10.0)
    shown = []
    with Image.open(out) as film:
        for moment in range(count):
            film.seek(moment)
            shown.append(round(np.median(np.asarray(film.convert("RGB"))[100:]) / 10))
    return shown, api(dataset, work)[1]


def exported(dataset, work):
    export(dataset, "nerfstudio", work / "out", True, None)
    frames = json.loads((work / "out/transforms.json").read_text())["frames"]
    shown = []
    for frame in frames:
        color, depth = (work / "out" / frame[k] for k in ("file_path", "depth_file_path"))
        shown.append(numbered.value_of_image(color.read_bytes()))
        assert numbered.value_of_image(depth.read_bytes()) == shown[-1]
    return shown, [frame["transform_matrix"][0][3] for frame in frames]


def repeated(dataset, _):
    """Poses of the frames, which nothing is paired with: in order, whichever they are."""
    found = read_poses(dataset, "train").position_m[:, 0]
    return found, np.sort(found)


def trained(dataset, work):
    """Frames that were packed when the data set was whole."""
    return _labelled(work / "train.npy", dataset / "train.csv")


def packed_anew(dataset, work):
    pack_frames(read_split(dataset, "train"), 16, work / "new.npy")
    numbered.write_true_table(work / "labels.csv", "train", named=False)
    return _labelled(work / "new.npy", work / "labels.csv")


def _labelled(frames, labels):
    found = read_labelled_frames(frames, labels, 16, torch.device("cpu"))
    return found.images[found.rows, 0, 0, 0].numpy() / 10, found.position_m[:, 0].numpy()


def labelled_by_methods(dataset, _):
    """Colour and depth of all frames, whose true poses are rows of a plan."""
    color, depth = files_of_split(read_split(dataset, "train"), "train", N_TRAIN)
    shown = [[numbered.value_of_image(f.read_bytes()) for f in files] for files in (color, depth)]
    assert shown[0] == shown[1]
    return shown[0], TRAIN


READERS = (
    api,
    evaluated,
    evaluated_by_row,
    previewed,
    exported,
    repeated,
    trained,
    packed_anew,
    labelled_by_methods,
)

# What is done to sequence 1 or to a table, and the words of which a refusal must hold one.
FRAME, FREE, LAST = "frame-000003", "frame-000042", "frame-000005"
KINDS = ("color.png", "depth.png", "pose.txt")
DAMAGES = {
    **{f"{k} deleted": (numbered.delete(f"{FRAME}.{k}"), (FRAME,)) for k in KINDS},
    **{
        f"{k} renamed": (numbered.rename(f"{FRAME}.{k}", f"{FREE}.{k}"), (FRAME, FREE))
        for k in KINDS
    },
    **{
        f"{k} renamed, short": (numbered.rename(f"{FRAME}.{k}", f"frame-3.{k}"), (FRAME, "frame-3"))
        for k in KINDS
    },
    **{
        f"{k} doubled, long": (
            numbered.copy(f"{FRAME}.{k}", f"frame-0000003.{k}"),
            ("frame-0000003",),
        )
        for k in KINDS
    },
    **{
        f"{k} doubled": (numbered.copy(f"{FRAME}.{k}", f"{FRAME}-copy.{k}"), (f"{FRAME}-copy",))
        for k in KINDS
    },
    **{
        f"{k} doubled as the next": (
            numbered.copy(f"{FRAME}.{k}", f"frame-000006.{k}"),
            ("000006",),
        )
        for k in KINDS
    },
    "color as JPEG beside": (
        numbered.copy(f"{FRAME}.color.png", f"{FRAME}.color.jpg"),
        (f"{FRAME}.color.jpg",),
    ),
    "frame deleted": (
        numbered.delete(*(f"{FRAME}.{k}" for k in KINDS)),
        (FRAME, "train split has 11"),
    ),
    "last frame deleted": (
        numbered.delete(*(f"{LAST}.{k}" for k in KINDS)),
        (LAST, "frame 11 does not exist"),
    ),
}
ARCHIVED = {
    f"member {k} twice": (numbered.copy(f"{FRAME}.{k}", f"{FRAME}.{k}"), (f"{FRAME}.{k}",))
    for k in KINDS
}
IMAGE = "seq-01/frame-000003.color.png"
TABLE = "train.csv"
TABLES = {
    "row deleted": (numbered.edit_lines(TABLE, numbered.without_line(4)), (TABLE,)),
    "last row deleted": (numbered.edit_lines(TABLE, numbered.without_line(-1)), (TABLE,)),
    "row doubled": (numbered.edit_lines(TABLE, numbered.doubled_line(4)), (TABLE,)),
    "row renamed": (
        numbered.edit_lines(TABLE, numbered.replaced_in_line(4, "frame-000003", FREE)),
        (TABLE,),
    ),
    "row of the next": (
        numbered.edit_lines(TABLE, numbered.replaced_in_line(4, "frame-000003", "frame-000004")),
        (TABLE,),
    ),
    "rows exchanged": (
        numbered.edit_lines(TABLE, lambda x: [*x[:4], x[5], x[4], *x[6:]]),
        (TABLE,),
    ),
}
LIST = "TrainSplit.txt"
SPLITS = {
    "sequence deleted": (
        numbered.edit_lines(LIST, numbered.without_line(0)),
        (TABLE, LIST, "seq-01", "hold 6 frames", "holds 6 frames", "train split has 6", "does not"),
    ),
    "sequence doubled": (numbered.edit_lines(LIST, numbered.doubled_line(0)), (LIST, "seq-01")),
    "sequence renamed": (
        numbered.edit_lines(LIST, numbered.replaced_in_line(0, "1", "9")),
        ("seq-09", LIST),
    ),
}
CASES = [
    *((name, form, tables) for name in DAMAGES for form in (False, True) for tables in (0, 1)),
    *((name, True, tables) for name in ARCHIVED for tables in (False, True)),
    *((name, False, True) for name in TABLES),
    *((name, False, tables) for name in SPLITS for tables in (False, True)),
]
EVERY = DAMAGES | ARCHIVED | TABLES | SPLITS


def new_set(tmp_path, archived, with_tables):
    dataset = tmp_path / "set"
    numbered.write_numbered_set(dataset, with_tables, archived)
    pack_frames(read_split(dataset, "train"), 16, tmp_path / "train.npy")
    return dataset


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.__name__)
@pytest.mark.parametrize("archived", [False, True])
@pytest.mark.parametrize("with_tables", [False, True])
def test_whole_sets_are_read_in_full(tmp_path, reader, archived, with_tables):
    dataset = new_set(tmp_path, archived, with_tables)
    if reader is trained and not with_tables:
        return
    shown, posed = reader(dataset, tmp_path)
    np.testing.assert_array_equal(shown, posed)
    assert len(shown) == N_TRAIN + (PER_SEQUENCE if reader is exported else 0)


@pytest.mark.parametrize(("damage", "archived", "with_tables"), CASES)
def test_images_keep_their_poses_or_the_damage_is_named(tmp_path, damage, archived, with_tables):
    dataset = new_set(tmp_path, bool(archived), bool(with_tables))
    change, words = EVERY[damage]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # zipfile's, of the name that is to be there twice
        change(dataset)
    for reader in READERS:
        if reader is trained and not with_tables:
            continue
        try:
            shown, posed = reader(dataset, tmp_path)
        except InputError as error:
            message = str(error).replace(str(tmp_path), "")
            assert any(word in message for word in words), (reader.__name__, message)
            continue
        assert len(shown), reader.__name__
        np.testing.assert_array_equal(shown, posed, reader.__name__)
    found = [
        failure
        for check in validate(dataset, None, False)
        if check.name in ("names", "tables", "splits")
        for failure in check.failures
    ]
    named = [failure for failure in found if any(word in failure for word in words)]
    if damage == "last frame deleted" and not with_tables:
        assert found == []  # nothing is left that says it was there
    else:
        assert named, found


def test_poses_of_a_set_with_more_frames_are_refused_or_scored_by_name(tmp_path, capsys):
    numbered.write_numbered_set(tmp_path / "ok")
    numbered.write_numbered_set(tmp_path / "bare", with_tables=False)
    numbered.write_numbered_set(tmp_path / "lack")
    for name in ("bare", "lack"):
        for path in (tmp_path / name / "seq-03").glob("frame-000002.*"):
            path.unlink()
    poses = tmp_path / "ok/test.csv"
    line = refused(capsys, "evaluate", tmp_path / "lack", poses)
    assert "lack/test.csv: line 4 names seq-03/frame-000002.color.png, which is not there" in line
    assert main(["evaluate", str(tmp_path / "bare"), str(poses)]) == 0
    printed = capsys.readouterr().out
    assert "5 frames" in printed
    assert "1 poses of other frames are left out" in printed
    found = evaluate(tmp_path / "bare", poses, Settings())
    assert found.errors["position_m"].tolist() == [0.0] * 5
    numbered.write_true_table(tmp_path / "rows.csv", "test", named=False)
    for split in ("test", "all"):
        line = refused(
            capsys, "evaluate", tmp_path / "bare", tmp_path / "rows.csv", "--split", split
        )
        assert "rows.csv: " in line


def test_the_table_of_another_split_is_refused(tmp_path, capsys):
    numbered.write_numbered_set(tmp_path / "ok")
    line = refused(
        capsys, "evaluate", tmp_path / "ok", tmp_path / "ok/test.csv", "--split", "train"
    )
    assert "none of its 6 poses is of a frame of the train split" in line
    numbered.write_true_table(tmp_path / "rows.csv", "test", named=False)
    line = refused(capsys, "evaluate", tmp_path / "ok", tmp_path / "rows.csv", "--split", "train")
    assert "poses of 6 frames without their names, but the train split has 12" in line


def test_both_tables_are_found_by_name_among_all_frames(tmp_path):
    numbered.write_numbered_set(tmp_path / "ok")
    (tmp_path / "ok/TrainSplit.txt").write_text("sequence2\nsequence1\n")
    for split in ("train", "test"):
        found = evaluate(tmp_path / "ok", tmp_path / f"ok/{split}.csv", Settings(split="all"))
        known = found.errors["position_m"][np.isfinite(found.errors["position_m"])]
        assert known.tolist() == [0.0] * (N_TRAIN if split == "train" else PER_SEQUENCE)
    shown, posed = api(tmp_path / "ok", tmp_path)
    assert shown == posed.tolist() == [*TRAIN[PER_SEQUENCE:], *TRAIN[:PER_SEQUENCE]]
