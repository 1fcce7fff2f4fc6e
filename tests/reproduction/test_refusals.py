"""Files that cannot be used: one line that names the file and says what is wrong with it."""

import pytest

from baselines.labels.batches import read_trajectory
from baselines.labels.posegraph.graph import read_g2o
from baselines.references.run import read_answers
from baselines.training.checkpoint import frame_camera
from reproduction.config.load import load_config
from reproduction.design.experiments import read_experiments
from reproduction.speed.rendering import SCHEMA as SPEED
from reproduction.tables.speed_vs_error import render_rows
from synfeal.dataset.pose_table import HEADER, read_pose_table
from synfeal.errors import InputError
from synfeal.planning.repeat import read_poses
from synfeal.records.tables import COUNT, NUMBER, TEXT, read_frame
from tests.support.property_support import random_table
from tests.support.report_results import CONFIG

TRAJECTORY = "frame,registered,tx,ty,tz,qw,qx,qy,qz"
ANSWERS = "frame,tx,ty,tz,qw,qx,qy,qz"
NODE_0, NODE_1 = (f"VERTEX_SE3:QUAT {i} 0 0 0 0 0 0 1\n" for i in (0, 1))
DESIGN = "table,block,scene,size,labels,noise_m,noise_deg,init\n"
GOOD = "table4_size,,large_room,6k,synfeal,0,0,pretrained"


def edge(i, j, w=1):
    return f"EDGE_SE3:QUAT {i} {j} 0 0 0 0 0 0 {w}" + 21 * " 1" + "\n"


def design(line):
    """A design whose fourth line is wrong; the empty one before it counts."""
    return f"{DESIGN}{GOOD}\n\n{line}\n"


def table(path):
    return read_frame(path, {"a": TEXT, "n": COUNT, "x": NUMBER}, "measure again")


def poses(path):
    return read_poses(path.parent if path.name.startswith("frame") else path, "train")


def speeds(path):
    return render_rows(path.parents[2], "large_room")


def experiments(path):
    config = load_config(CONFIG / "config.yaml")
    return read_experiments(config.model_copy(update={"experiments": path}))


# fmt: off
# By file and its reader: what it holds (None: there is none), and what is said.
CASES = {
    ("a.csv", table): [
        (None, "No such file"),
        ("", "column a, n, x missing; measure again"),
        ("a,n,x\nb,1\n", "row 2: has 2 cells where the header has 3"),
        ('a,n,x\n"b,1,2\n', "cannot be read as CSV"),
        ("a,n,x\nb,1e30,2\n", "row 2: n must be a whole number, found '1e30'"),
        ("a,n,x\nb,1,\n", "row 2: x must be a number, found ''"),
        ("a,n,x\nb,1,2\nb,1,x\n", "row 3: x must be a number"),
        (b"\xff", "cannot be read as CSV"),
        ("a,n,x,n\nb,1,2,3\n", "column n appears twice; measure again"),
        ("a,n,x\n\nb,x,2\n", "row 3: n must be a whole number"),
    ],
    ("poses.csv", read_pose_table): [
        (None, "cannot be read as a pose table"),
        (f"{HEADER}\n0,0,1,2,3,1,0,0\n", "row 2: has 8 cells where the header has 9"),
        (f"{HEADER}\n\n0,0,1,2,3,1,0,0,0\n", "row 2: has 0 cells"),
        (f"{HEADER}\n0,0,1,2,x,1,0,0,0\n", "row 2: tz must be a number, found 'x'"),
        (f'{HEADER},image\n0,0,1,2,3,1,0,0,0,"a\n', "cannot be read as a pose table"),
        (f"{HEADER}\n0,0,1,2,nan,1,0,0,0\n", "row 2"),
    ],
    ("batch-000.csv", read_trajectory): [
        ("", "header must be", "found ''"),
        (f"{TRAJECTORY}\n0,1,2\n", "row 2: has 3 cells"),
        (f"{TRAJECTORY}\n0,1,nan,0,0,1,0,0,0\n", "row 2"),
        (f"{TRAJECTORY}\n1,1,0,0,0,1,0,0,0\n", "frames must count from 0"),
        (f"{TRAJECTORY}\n0,2,0,0,0,1,0,0,0\n", "registered be 0 or 1; est"),
        (f"{TRAJECTORY}\n0,1,0,0,0,2,0,0,0\n", "line 2 holds a quat"),
    ],
    ("graph.g2o", read_g2o): [
        ("", "numbered 0 to n-1"),
        ("VERTEX_SE3:QUAT 0 0 0 0 0 0 0\n", "line 1: needs 8 finite numbers, found 7"),
        ("VERTEX_SE3:QUAT 0 0 0 zero 0 0 0 1\n", "line 1: 'zero' is no number"),
        ("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 2\n", "line 1 holds a quaternion of length 2"),
        ("VERTEX_SE3:QUAT 0.5 0 0 0 0 0 0 1\n", "must begin with whole numbers"),
        (f"{NODE_0}VERTEX_SE3:QUAT 2 0 0 0 0 0 0 1\n", "numbered 0 to n-1 without"),
        (f"{NODE_0}{edge(1, 0)}", "edge 1 0 must join two different"),
        (f"{NODE_0}{NODE_1}", "node 1 is not connected to node 0 by edges; is the file cut short"),
        (f"{NODE_0}\n", "line 2 is not a VERTEX_SE3:QUAT or EDGE_SE3:QUAT record"),
        (f"{NODE_0}{edge(0, 1, w=3)}", "line 2 holds a quaternion of"),
        (b"\xff", "cannot be read as a g2o file"),
    ],
    ("mine.csv", lambda path: read_answers(path, random_table(4, 0))): [
        (None, "cannot be read"),
        ("frame,tx,ty,tz\n0,1,2,3\n", "columns frame,tx,ty,tz,qw"),
        (f"{ANSWERS}\n0,1,2,3,1,0,0,0\n0,1,2,3,1,0,0,0\n", "frame 0 appears twice"),
        (f"{ANSWERS}\n4,1,2,3,1,0,0,0\n", "frame 4 is not in the test set of 4"),
        (f"{ANSWERS}\n0.5,1,2,3,1,0,0,0\n", "row 2: frame must be a whole number, found '0.5'"),
        (f"{ANSWERS}\n0,1,2,3,one,0,0,0\n", "row 2: qw must be a number, found 'one'"),
    ],
    ("train.json", lambda path: frame_camera(path.with_suffix(".npy"))): [
        (text, "train.json: cannot be read as the record")
        for text in ("", "[]", "{}", '{"camera": 3}', '{"camera": {"width": 1}}')
    ],
    ("poses.txt", poses): [
        ("0 0 0 0 0 0 0 2\n", "line 1 holds a quaternion of length 2"),
        ("0 0 0 nan 0 0 0 1\n", "line 1 must hold eight finite numbers"),
    ],
    ("planned.csv", poses): [(f"{HEADER}\n0,0,0,0,0,0,0,0,0\n", "line 2 ", " length 0")],
    ("poses.json", poses): [("[]", "must be a directory, a .csv pose table or a .txt")],
    ("frame-000000.pose.txt", poses): [
        ("1 0 0 0\n0 1 0 0\n0 0 -1 0\n0 0 0 1\n", "not a rigid pose"),
        ("1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1.01\n", "not a rigid pose"),
        ("1 0 0 0\n0 1 0 0\n0 0 1 0\n1 0 0 1\n", "not a rigid pose"),
    ],
    ("scenes/large_room/render_speed.csv", speeds): [
        (text, "render_speed.csv")
        for text in (
            None, "a,b\n1,2\n", f"{','.join(SPEED)}\nopengl,wide,96,2,1.0,9,1,1,1,0,0,1\n",
            f"{','.join(SPEED)}\nopengl,128\n",
        )
    ],
    ("design.csv", experiments): [
        (None, "No such file"),
        ("table,scene\n", "header must be table,block,scene"),
        ("", "header must be"),
        ("café".encode("latin-1"), "cannot be read as CSV"),
        (DESIGN, "has no rows"),
        *(
            (design(line), "row 4: ", *words) for line, *words in (
                ("table4_size,,kitchen,6k,synfeal,0,0,pretrained", "scene 'kitchen'", "large_room"),
                ("table4_size,,large_room,95k,synfeal,0,0,pretrained", "size '95k'", "'80k'"),
                ("table9,,large_room,6k,synfeal,0,0,pretrained", "table", "table2_ground_truth"),
                ("table4_size,,large_room,6k,synfeal,0,0,imagenet", "init", "'scratch'"),
                ("table4_size,,large_room,6k,synfeal,0.1,0,pretrained", "labels", "`noise`"),
                ("table4_size,,large_room,6k,noise,0,0,pretrained", "labels", "above 0"),
                ("table4_size,,large_room,6k,noise,-1,0,pretrained", "noise_m", "0 or more"),
                ("table3_inconsistencies,both,large_room,6k,noise,0.1000001,0,scratch",
                 "at most six digits"),
                ("table4_size,both,large_room,6k,synfeal,0,0,pretrained", "block", "table 3"),
                ("table3_inconsistencies,,large_room,6k,synfeal,0,0,pretrained",
                 "block", "three blocks"),
                ("table4_size,,large_room,6k,synfeal,0,0", "7 cells", "header has 8"),
                ("table4_size,,large_room,6k,synfeal,0,0,scratch",
                 "shows each scene, size once", "row 2"),
            )
        ),
    ],
}
# fmt: on


@pytest.mark.parametrize(
    ("name", "read", "content", "words"),
    [(*file, text, words) for file, cases in CASES.items() for text, *words in cases],
)
def test_a_file_that_cannot_be_used_is_refused_in_one_line(
    name, read, content, words, tmp_path, monkeypatch
):
    monkeypatch.chdir(CONFIG.parent)
    path = tmp_path / name
    path.parent.mkdir(parents=True, exist_ok=True)
    if content is not None:
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError) as refusal:
        read(path)
    message = str(refusal.value)
    assert str(path) in message
    assert "\n" not in message
    assert all(word in message for word in words), message
