"""More careless inputs: commands as typed, what has to be said, and damaged sets.

``{}`` in a command stands for the name of a damaged file or set, which the message has to name.
"""

import json
import shutil

import numpy as np
from PIL import Image

from tests.support.careless import make_folder
from tests.support.collected import collect

COLLECT = "collect room.glb --frames 2 --out new --width 40 --height 33"
REPEAT = f"{COLLECT} --mode repeat --poses"
SCAN = "scan set/seq-01 --out new.glb --color-focal 35"

# What is typed, and what the one line has to name. Usage errors (exit 2) name the option as well.
COMMANDS = (
    ("", "COMMAND"),
    ("colect --mesh room.glb", "COMMAND"),
    ("collect", "MESH"),
    ("validate", "DATASET"),
    ("validate set set", "unrecognized arguments: set"),
    ("validate set --al", "unrecognized arguments: --al"),
    ("evaluate set", "POSES"),
    ("inspect", "MESH"),
    ("export set --out new", "--to"),
    ("compare set", "RESULTS_B"),
    # collect: numbers and angles
    ("collect room.glb --frames 2 --out ''", "--out: is empty"),
    ("evaluate set ''", "POSES: is empty"),
    (f"{COLLECT} --frames 2.5", "--frames"),
    (f"{COLLECT} --frames two", "--frames"),
    (f"{COLLECT} --frames", "--frames"),
    (f"{COLLECT} --roll -200 500", "--roll"),
    (f"{COLLECT} --roll 5", "--roll"),
    (f"{COLLECT} --yaw 0 720", "--yaw"),
    (f"{COLLECT} --yaw -1000 -900", "--yaw"),
    (f"{COLLECT} --pitch 80 100", "--pitch"),
    (f"{COLLECT} --spacing 1000", "frame spacing"),
    (f"{COLLECT} --spacing 5cm", "--spacing"),
    (f"{COLLECT} --box 0 1 0 1 0", "--box"),
    (f"{COLLECT} --box 0 0 0 1 0 1", "--box"),
    (f"{COLLECT} --box -1e308 1e308 0 1 0 1", "sampling_box|--box"),
    (f"{COLLECT} --box 0 1 0 1 0 1 --box 90 91 0 1 0 1", "sampling box"),
    (f"{COLLECT} --min-seen 1", "--min-seen"),
    (f"{COLLECT} --min-seen -0.1", "--min-seen"),
    (f"{COLLECT} --min-seen nan", "--min-seen"),
    (f"{COLLECT} --unit 1e-9", "--unit"),
    (f"{COLLECT} --unit 1e-4", "room.glb"),
    (f"{COLLECT} --unit 1e6", "--unit"),
    (f"{COLLECT} --seed 1.5", "--seed"),
    (f"{COLLECT} --seed 0x10", "--seed"),
    (f"{COLLECT} --cores two", "--cores"),
    (f"{COLLECT} --width 40px", "--width"),
    (f"{COLLECT} --width 15", "--width"),
    (f"{COLLECT} --fov 175", "--fov"),
    (f"{COLLECT} --background 0 0", "--background"),
    (f"{COLLECT} --background 0 0 0.5", "--background"),
    (f"{COLLECT} --background red green blue", "--background"),
    (f"{COLLECT} --backend vulkan", "--backend"),
    (f"{COLLECT} --detail most", "--detail"),
    (f"{COLLECT} --mode fly", "--mode"),
    (f"{COLLECT} --up-axis w", "--up-axis"),
    # collect: options that do not go together
    (f"{COLLECT} --margin 1", "--margin"),
    (f"{COLLECT} --angle-margin 1", "--angle-margin"),
    (f"{COLLECT} --like-range 0 5", "--like-range"),
    (f"{COLLECT} --like set/seq-01 --like-range 5 2", "--like-range"),
    (f"{COLLECT} --like set/seq-01 --like-range 500 600", "set/seq-01"),
    (f"{COLLECT} --like set/seq-01 --margin nan", "--margin"),
    (f"{COLLECT} --like set/seq-01 --angle-margin -1", "--angle-margin"),
    (f"{COLLECT} --like absent", "absent"),
    (f"{COLLECT} --like notes.txt", "notes.txt"),
    (f"{COLLECT} --like photos", "photos"),
    (f"{COLLECT} --like set/seq-01", "--like"),
    (f"{COLLECT} --poses set/train.csv", "--poses"),
    (f"{REPEAT} set --frames 999", "set"),
    (f"{REPEAT} set/manifest.json", "set/manifest.json"),
    (f"{REPEAT} room.glb", "room.glb"),
    (f"{COLLECT} --camera camera.json --fov 60", "--fov"),
    (f"{COLLECT} --camera room.glb", "room.glb"),
    (f"{COLLECT} --out room.glb", "room.glb"),
    (f"{COLLECT} --out set", "set"),
    (f"{COLLECT} --out set/seq-01", "set/seq-01"),
    (f"{COLLECT} --out photos/a.png/b", "photos/a.png"),
    # inspect
    ("inspect photos/a.png", "photos/a.png"),
    ("inspect config", "MESH"),
    ("inspect absent.glb", "MESH: absent.glb"),
    ("inspect room.glb --out room.glb", "room.glb"),
    ("inspect room.glb --out set", "set"),
    ("inspect room.glb --unit 1 2", "unrecognized arguments: 2"),
    ("inspect room.glb --up-axis x", "--up-axis"),
    ("inspect room.glb --unit 1e-5", "room.glb"),
    # preview
    ("preview set --out new.xyz", "--out"),
    ("preview set --out photos", "--out"),
    ("preview set --split validation", "--split"),
    ("preview set --fps fast --out new.gif", "--fps"),
    ("preview set --frames 1e9 --out new.gif", "--frames"),
    ("preview set absent --out new.gif", "absent"),
    ("preview set photos --out new.gif", "photos"),
    ("preview set/seq-01 --out new.gif", "set/seq-01"),
    ("preview room.glb --out new.gif", "room.glb"),
    # validate
    ("validate set/seq-01", "set/seq-01"),
    ("validate set --camera room.glb", "room.glb"),
    ("validate set --camera set/manifest.json/x", "set/manifest.json/x"),
    # export
    ("export set --to bundler --out new", "--to"),
    ("export set --to colmap --out set/export", "--out"),
    ("export set --to tum --out set/seq-01/tum", "--out"),
    ("export set --to ace --out linked/ace", "--out"),
    ("export set/seq-01 --to tum --out new", "set/seq-01"),
    ("export set --to tum --out new --camera photos/a.png", "photos/a.png"),
    ("export set --to tum --out new --camera wide.json", "wide.json|camera"),
    # evaluate
    ("evaluate set set/test.csv --rate 0", "--rate"),
    ("evaluate set set/test.csv --rate -30", "--rate"),
    ("evaluate set set/test.csv --rate nan", "--rate"),
    ("evaluate set set/test.csv --rate inf", "--rate"),
    ("evaluate set set/test.csv --rate fast", "--rate"),
    ("evaluate set set/test.csv --split val", "--split"),
    ("evaluate set set/test.csv --split train", "set/test.csv"),
    ("evaluate set set/test.csv --align sim2", "--align"),
    ("evaluate set set/test.csv --convention xyz", "--convention"),
    ("evaluate set set/test.csv --labels absent", "absent"),
    ("evaluate set set/test.csv --labels set/train.csv", "set/train.csv"),
    ("evaluate set set/test.csv --camera notes.txt", "notes.txt"),
    ("evaluate set set/test.csv --camera wide.json", "--camera|wide.json"),
    ("evaluate set set/test.csv --out notes.txt", "notes.txt"),
    ("evaluate set set/test.csv --out photos", "photos"),
    ("evaluate set set/test.csv --out photos/a.png/x", "photos/a.png"),
    ("evaluate set absent", "absent"),
    ("evaluate set photos", "photos"),
    ("evaluate set photos/a.png", "photos/a.png"),
    ("evaluate set room.glb", "room.glb"),
    ("evaluate set set/manifest.json", "set/manifest.json"),
    ("evaluate photos set/test.csv", "photos"),
    # train
    ("train set --out new --images 0", "--images"),
    ("train set --out new --images 1e3", "--images"),
    ("train set --out new --images 10 --minutes 1", "--minutes"),
    ("train set --out new --minutes 0", "--minutes"),
    ("train set --out new --minutes nan", "--minutes"),
    ("train set --out new --minutes -5", "--minutes"),
    ("train set --out new --localizer alexnet", "--localizer"),
    ("train set --out new --held-out 1", "--held-out"),
    ("train set --out new --held-out nan", "--held-out"),
    ("train set --out new --held-out -0.1", "--held-out"),
    ("train set --out new --range 5 2", "--range"),
    ("train set --out new --range -5 2", "--range"),
    ("train set --out new --range 5", "--range"),
    ("train set/seq-01 --out new --range 500 600", "set/seq-01"),
    ("train set --out new --seed -1", "--seed"),
    ("train set --out new --seed 99999999999999999999999", "--seed"),
    ("train set --out new --device tpu", "--device"),
    ("train set --out new --focal 0", "--focal"),
    ("train set --out new --focal nan", "--focal"),
    ("train set --out new --camera absent", "absent"),
    ("train set --out new --camera camera.json --focal 5", "--focal"),
    ("train set --out new --randomisation absent.yaml", "absent.yaml"),
    ("train set --out new --randomisation odd.yaml", "odd.yaml"),
    ("train set --out new --randomisation list.yaml", "list.yaml"),
    ("train set --out new --randomisation set", "set"),
    ("train set set --out new", "set"),
    ("train absent --out new", "absent"),
    ("train photos --out new", "photos"),
    ("train notes.txt --out new", "notes.txt"),
    ("train set --out notes.txt", "notes.txt"),
    ("train set --out photos", "photos"),
    ("train set --out set", "set"),
    # map
    ("map set --out new --range 5 2", "--range"),
    ("map set --out new --range 500 600", "--range|set"),
    ("map set --out new --stride 0", "--stride"),
    ("map set --out new --most 0", "--most"),
    ("map set --out new --seed -1", "--seed"),
    ("map set --out new --preset kinect", "--preset"),
    ("map set/seq-01 --out new --depth-scale 0 --color-focal 35", "--depth-scale"),
    ("map set/seq-01 --out new --depth-scale nan --color-focal 35", "--depth-scale"),
    ("map set/seq-01 --out new --color-focal -1", "--color-focal"),
    ("map set/seq-01 --out new --depth-focal inf --color-focal 35", "--depth-focal"),
    ("map set/seq-01 --out new --preset 7scenes", "--preset|--color-camera"),
    ("map set/seq-01 --out new --depth-from-color 0 0 0 0 0", "--depth-from-color"),
    ("map set/seq-01 --out new --color-focal 35 --depth-from-color 0 0 nan 0 0 0", "--depth-from"),
    ("map absent --out new", "absent"),
    ("map photos --out new", "photos"),
    ("map set --out photos", "photos"),
    ("map set --out set", "set"),
    ("map set --out notes.txt", "notes.txt"),
    # localize
    ("localize model.pt photos --focal 0 --out new.csv", "--focal"),
    ("localize model.pt photos --focal nan --out new.csv", "--focal"),
    ("localize model.pt photos --camera absent --out new.csv", "absent"),
    ("localize model.pt photos --camera camera.json --focal 9 --out new.csv", "--focal"),
    ("localize model.pt photos --camera wide.json --out new.csv", "wide.json|model.pt"),
    ("localize model.pt photos --device tpu --out new.csv", "--device"),
    ("localize model.pt photos --world moon --out new.csv", "--world"),
    ("localize model.pt photos --out photos/a.png", "photos/a.png"),
    ("localize model.pt photos/a.png --out set", "set"),
    ("localize model.pt set/manifest.json --out new.csv", "set/manifest.json"),
    ("localize photos photos --out new.csv", "photos"),
    ("localize empty photos --confidence 2 --out new.csv", "--confidence|empty"),
    ("localize half-map photos --out new.csv", "half-map"),
    ("localize old-map photos --out new.csv", "old-map"),
    # scan
    ("scan set/seq-01 --out new.ply --color-focal 35", "--out"),
    ("scan set/seq-01 --out new.glb", "set/seq-01"),
    (f"{SCAN} --voxel 0", "--voxel"),
    (f"{SCAN} --voxel nan", "--voxel"),
    (f"{SCAN} --voxel 1e-9", "--voxel"),
    (f"{SCAN} --stride 0", "--stride"),
    (f"{SCAN} --stride 99", "--stride"),
    (f"{SCAN} --range 5 2", "--range"),
    (f"{SCAN} --range 500 600", "set/seq-01"),
    (f"{SCAN} --max-depth 0", "--max-depth"),
    (f"{SCAN} --max-depth -inf", "--max-depth"),
    (f"{SCAN} --min-piece nan", "--min-piece"),
    (f"{SCAN} --gravity 0 0 0", "--gravity"),
    (f"{SCAN} --gravity 0 nan 1", "--gravity"),
    (f"{SCAN} --gravity 0 0 -1 --keep-axes", "--keep-axes"),
    (f"{SCAN} --convention inverted", "--convention"),
    (f"{SCAN} --color-camera camera.json", "--color-focal|--color-camera"),
    (f"{SCAN} --depth-focal 0", "--depth-focal"),
    (f"{SCAN} --depth-scale inf", "--depth-scale"),
    ("scan absent --out new.glb", "absent"),
    ("scan photos --out new.glb", "photos"),
    ("scan room.glb --out new.glb", "room.glb"),
    # runs of the workflow
    ("plan --cores 1 2 0", "--cores"),
    ("plan --cores many", "--cores"),
    ("plan --gpus 1", "--gpus"),
    ("plan --measured empty --compare absent", "empty|absent"),
    ("plan --profile photos/a.png", "photos/a.png"),
    ("run --profile absent", "absent"),
    ("run --cores 1.5", "--cores"),
    ("run --profile odd.yaml list.yaml", "list.yaml"),
    ("compare set set", "set"),
    ("compare empty notes.txt", "empty|notes.txt"),
    ("keep set", "COMMAND"),
)

# The same of options that came later; ``fish`` is a set through a fisheye, ``pair`` one in stereo.
LATER = (
    # collect: lenses, stereo, trajectories, test paths
    (f"{COLLECT} --stereo 1e-300", "--stereo"),
    (f"{COLLECT} --stereo 1000", "--stereo"),
    (f"{COLLECT} --projection cylinder", "--projection"),
    (f"{COLLECT} --projection equirectangular", "--width"),
    (f"{COLLECT} --projection equirectangular --height 20 --fov 90", "--fov"),
    (f"{COLLECT} --projection fisheye --fov 500", "--fov"),
    (f"{COLLECT} --projection fisheye --fisheye-k nan 0 0 0", "--fisheye-k"),
    (f"{COLLECT} --projection fisheye --fisheye-k 9 9 9", "--fisheye-k"),
    (f"{COLLECT} --projection fisheye --camera camera.json", "--projection"),
    (f"{COLLECT} --fisheye-k 0 0 0 0", "--fisheye-k"),
    (f"{COLLECT} --test-paths 9", "--test-paths"),
    (f"{COLLECT} --test-paths 9 --test-frames 3", "--test-paths"),
    (f"{COLLECT} --like set/seq-01 --fov 60 --margin 1e9", "--margin"),
    (f"{COLLECT} --like set/seq-01 --fov 60 --angle-margin 1000", "--angle-margin"),
    (f"{COLLECT} --like set/seq-01 --fov 60 --mode repeat", "--poses"),
    (f"{COLLECT} --like room.glb", "room.glb"),
    # scan
    (f"{SCAN} --gravity 1e308 0 0", "--gravity"),
    (f"{SCAN} --gravity 0 0 -1e-300", "--gravity"),
    (f"{SCAN} --depth-from-color 0 0 0 1e9 0 0", "--depth-from-color"),
    (f"{SCAN} --depth-focal 1e9", "--depth-focal"),
    (f"{SCAN} --voxel 100", "--max-depth"),
    # train, map, localize
    ("train set --out new --images 99999999999999", "--images"),
    ("train set --out new --images 8 --range 0 5", "--range"),
    ("train set --out new --images 8 --focal 35", "--focal"),
    ("train fish --out new --images 8 --camera camera.json", "--camera"),
    ("train set fish --out new --images 8", "fish/manifest.json"),
    ("train set --out set/model --images 8", "--out"),
    ("map fish --out new", "fish/manifest.json"),
    ("map pair --out new", "--depth"),
    ("map set --out set/map", "--out"),
    ("map set --out new --range 0 0", "--range"),
    ("localize empty photos --out new.csv --turns 4", "--turns"),
    ("localize empty photos --out new.csv --device cpu", "--device"),
    ("localize model.pt photos --out new.csv --confidence 0.5", "--confidence"),
    ("localize model.pt photos --out new.csv --refine room.glb", "--refine"),
    ("localize model.pt photos --out new.csv --turns 1000000", "--turns"),
    # pairs
    ("pairs set --out set/pairs", "--out"),
    ("pairs set --out photos", "photos"),
    ("pairs set --out new --grid 41 5", "--grid"),
    ("pairs set --out new --min-overlap nan", "--min-overlap"),
    ("pairs set --out new --max-overlap 1.5", "--max-overlap"),
    ("pairs set --out new --tolerance 0", "--tolerance"),
    ("pairs set/seq-01 --out new", "set/seq-01"),
    ("pairs pair --out new", "--depth"),
    ("pairs set --out new --camera wide.json", "--camera"),
    # evaluate
    ("evaluate set set/test.csv --format kitti", "--format"),
    ("evaluate set set/test.csv --format colmap", "set/test.csv"),
    ("evaluate set set --format tum", "--format"),
    ("evaluate set set/test.csv --rate 5", "--rate"),
    ("evaluate set/test.csv set/test.csv --rate 5", "--rate"),
    ("evaluate set/test.csv set/test.csv --split train", "--split"),
    ("evaluate set/test.csv set/test.csv --camera camera.json", "--camera"),
    ("evaluate set set --convention world_from_cam-xyzw", "--convention"),
    ("evaluate set set --split train --convention cam_from_world-xyzw", "--convention"),
    ("evaluate set whole-commas.csv", "--format"),
    ("evaluate set numbered.txt", "--rate"),
    ("evaluate set set/test.csv --labels numbered.txt", "--rate"),
    ("evaluate numbered.txt set/test.csv", "set/test.csv"),
    # export and preview
    ("export fish --to rosbag --out new", "fish"),
    ("export fish --to tum --out new", "fish"),
    ("export set --to rosbag --out set/bag", "--out"),
    ("export set --to rosbag --out notes.txt", "notes.txt"),
    ("preview set --show right --out new.gif", "--show"),
    ("preview pair --show right-depth --out new.gif", "--depth"),
    ("preview set --fps 1e-9 --out new.gif", "--fps"),
    ("preview set --out set/seq-01/frame-000000.color.gif", "--out"),
)

# Files of which each is the only thing wrong with a command that would work.
MATRIX = [[35.0, 0, 20], [0, 35.0, 16], [0, 0, 1]]
CAMERA = {"K": MATRIX, "dist": [0.0, 0, 0, 0, 0], "image_size": [40, 33]}
CAMERAS = {
    "no-focal.json": {**CAMERA, "K": [[0, 0, 20], [0, 35, 16], [0, 0, 1]]},
    "negative.json": {**CAMERA, "K": [[-35, 0, 20], [0, 35, 16], [0, 0, 1]]},
    "two-by-two.json": {**CAMERA, "K": [[35, 0], [0, 35]]},
    "no-size.json": {"K": MATRIX, "dist": [0, 0, 0, 0, 0]},
    "no-lens.json": {"K": MATRIX, "image_size": [40, 33]},
    "text.json": {**CAMERA, "K": "35"},
    "size.json": {**CAMERA, "image_size": [-40, 33]},
    "two.json": {**CAMERA, "dist": [1, 2]},
    "folds.json": {**CAMERA, "dist": [-9, 0, 0, 0, 0]},
    "list.json": [1, 2, 3],
    "nothing.json": {},
}
EFFECTS = {
    "key.yaml": "lihgt: {}\n",
    "turned.yaml": "light: {ev: [2, -2]}\n",
    "negative.yaml": "motion_blur: {exposure_s: -1}\n",
    "long.yaml": "motion_blur: {exposure_s: 99}\n",
    "word.yaml": "light: {ev: bright}\n",
    "half.yaml": "light: {ev: [1]}\n",
}
CLUTTERS = {
    "none.yaml": "count: 0\n",
    "many.yaml": "count: 5000\n",
    "half-one.yaml": "count: 1.5\n",
    "seeds.yaml": "seed: -1\n",
    "sizes.yaml": "size_m: [0.4, 0.1]\n",
    "gone.yaml": "files: [absent.glb]\n",
    "yes.yaml": "count: yes\n",
}
TUM_LINE = "0 0 0 0 0 0 0 1\n"
TRAJECTORIES = {
    "commas.txt": TUM_LINE.replace(" ", ",") * 3,
    "commas-and-blanks.txt": TUM_LINE.replace(" ", ", ") * 3,
    "seven.txt": "0 0 0 0 0 0 0\n",
    "twelve.txt": "1 0 0 0 0 1 0 0 0 0 1 0\n",
    "far.txt": "0 1e308 0 0 0 0 0 1\n1 -1e308 1e308 0 0 0 0 1\n",
    "no-turn.txt": "0 0 0 0 0 0 0 0\n",
    "huge-turn.txt": "0 0 0 0 1e308 1e308 0 1\n",
    "words.txt": "a b c d e f g h\n",
    "comments.txt": "# nothing\n",
    "header.csv": "frame,path,tx,ty,tz,qw,qx,qy,qz\n",
    "other.csv": "x,y,z\n1,2,3\n",
    "far.csv": "frame,path,tx,ty,tz,qw,qx,qy,qz\n0,0,1e300,0,0,1,0,0,0\n1,0,0,0,0,1,0,0,0\n",
}
PLY = (
    "ply\nformat ascii 1.0\nelement vertex 4\n"
    "property float x\nproperty float y\nproperty float z\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 2\nproperty list"
    " uchar int vertex_indices\nend_header\n"
)
QUAD = "0 0 0 255 0 0\n{far} 0 0 0 255 0\n0 1 0 0 0 255\n0 0 1 9 9 9\n3 0 1 2\n3 0 2 3\n"
MESHES = {
    "far.ply": PLY + QUAD.format(far="1e30"),
    "tiny.ply": PLY
    + QUAD.replace(" 1 ", " 1e-9 ").format(far="1e-9").replace("0 0 1 9", "0 0 0 9"),
    "cut.ply": PLY + "".join(QUAD.format(far="1").splitlines(keepends=True)[:-1]),
    "beyond.ply": PLY + QUAD.format(far="1").replace("3 0 2 3", "3 0 2 9"),
    "outside.obj": "mtllib /etc/passwd\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n",
    "outside.gltf": json.dumps(
        {
            "asset": {"version": "2.0"},
            "buffers": [{"uri": "../../../../../../../../etc/passwd", "byteLength": 36}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "nodes": [{"mesh": 0}],
            "scenes": [{"nodes": [0]}],
        }
    ),
}
# A command for each kind of file, whose name stands for {}; it or one of the words is said.
FILES = (
    (f"{COLLECT} --camera {{}}", CAMERAS, "--camera"),
    ("validate set --camera {}", CAMERAS, "camera"),
    ("localize model.pt photos --out new.csv --camera {}", CAMERAS, "model.pt"),
    (f"{COLLECT} --effects {{}}", EFFECTS, "--effects"),
    (f"{COLLECT} --clutter {{}}", CLUTTERS, "--clutter|absent.glb"),
    (f"{REPEAT} {{}}", TRAJECTORIES, "--poses"),
    ("evaluate set {}", TRAJECTORIES, "--convention"),
    ("inspect {} --out new", MESHES, "MESH"),
    ("collect {} --frames 2 --out new", MESHES, "MESH"),
)


def make_more(folder, mesh, data_set, model):
    """Sound files and others, for :data:`COMMANDS`, :data:`LATER` and :data:`FILES`."""
    make_folder(folder, mesh, data_set, model)
    for name, *lens in (
        ("fish", "--depth", "--projection", "fisheye"),
        ("pair", "--stereo", "0.1"),
    ):
        frames = ("--frames", "2", "--test-frames", "2")
        assert collect(mesh, folder / name, *frames, *lens) == 0
    lines = [f"{second} 0 0 0 0 0 0 1\n" for second in range(3)]
    (folder / "numbered.txt").write_text("".join(lines))
    (folder / "whole-commas.csv").write_text("".join(lines).replace(" ", ","))
    for table in (EFFECTS, CLUTTERS, TRAJECTORIES, MESHES):
        for name, text in table.items():
            (folder / name).write_text(text)
    for name, value in CAMERAS.items():
        (folder / name).write_text(json.dumps(value))
    (folder / "camera.json").write_text(json.dumps(CAMERA))
    (folder / "wide.json").write_text(json.dumps({**CAMERA, "image_size": [4000, 33]}))
    (folder / "odd.yaml").write_text("brightness: 7\n")
    (folder / "linked").symlink_to("set")
    for name, record in (("half-map", "{"), ("old-map", '{"format": "map", "version": 0}')):
        (folder / name).mkdir()
        (folder / name / "map.json").write_text(record)


# What can happen to a data set, and the commands that have to notice.
def _first(folder, kind):
    return folder / "seq-01" / f"frame-000000.{kind}"


def no_depth_image(folder):
    _first(folder, "depth.png").unlink()


def cut_color(folder):
    path = _first(folder, "color.png")
    path.write_bytes(path.read_bytes()[:-40])


def empty_color(folder):
    _first(folder, "color.png").write_bytes(b"")


def color_of_another_size(folder):
    Image.new("RGB", (8, 8)).save(_first(folder, "color.png"))


def color_is_a_directory(folder):
    _first(folder, "color.png").unlink()
    _first(folder, "color.png").mkdir()


def color_is_a_lost_link(folder):
    _first(folder, "color.png").unlink()
    _first(folder, "color.png").symlink_to("/nowhere")


def enormous_color(folder):
    path = _first(folder, "color.png")
    content = bytearray(path.read_bytes())
    content[16:24] = (10**5).to_bytes(4, "big") * 2
    path.write_bytes(content)


def depth_of_eight_bits(folder):
    Image.new("L", (40, 33)).save(_first(folder, "depth.png"))


def pose_of_text(folder):
    _first(folder, "pose.txt").write_text("here\n")


def pose_of_three_rows(folder):
    np.savetxt(_first(folder, "pose.txt"), np.eye(4)[:3])


def pose_far_away(folder):
    pose = np.eye(4)
    pose[0, 3] = 1e308
    np.savetxt(_first(folder, "pose.txt"), pose)


def mirrored_pose(folder):
    np.savetxt(_first(folder, "pose.txt"), np.diag([-1.0, 1, 1, 1]))


def scaled_pose(folder):
    np.savetxt(_first(folder, "pose.txt"), np.diag([2.0, 2, 2, 1]))


def lost_pose(folder):
    np.savetxt(_first(folder, "pose.txt"), np.full((4, 4), np.nan))


def empty_split(folder):
    (folder / "TrainSplit.txt").write_text("")
    (folder / "TestSplit.txt").write_text("")


def split_of_words(folder):
    (folder / "TrainSplit.txt").write_text("all of them\n")


def split_that_leaves_the_set(folder):
    (folder / "TrainSplit.txt").write_text("../set\n")


def split_without_its_sequence(folder):
    shutil.rmtree(folder / "seq-01")


def manifest_of_text(folder):
    (folder / "manifest.json").write_text("none")


def manifest_without_camera(folder):
    (folder / "manifest.json").write_text("{}")


def camera_of_words(folder):
    path = folder / "manifest.json"
    manifest = json.loads(path.read_text())
    manifest["camera"]["fx"] = "wide"
    path.write_text(json.dumps(manifest))


def sequence_is_a_file(folder):
    shutil.rmtree(folder / "seq-01")
    (folder / "seq-01").write_text("")


def frame_of_two_names(folder):
    shutil.copy(_first(folder, "color.png"), folder / "seq-01" / "frame-0.color.png")


DAMAGES = {
    damage: commands.split()
    for damage, commands in (
        (no_depth_image, "validate export map scan"),
        (cut_color, "validate preview train map"),
        (empty_color, "validate preview train map"),
        (color_of_another_size, "validate train map"),
        (color_is_a_directory, "validate preview export train map"),
        (color_is_a_lost_link, "validate preview train map"),
        (enormous_color, "validate preview train map"),
        (depth_of_eight_bits, "validate export map"),
        (pose_of_text, "validate export map repeat"),
        (pose_of_three_rows, "validate export map"),
        (pose_far_away, "validate export map like"),
        (mirrored_pose, "validate export map like"),
        (scaled_pose, "validate export map"),
        (lost_pose, "validate export"),
        (empty_split, "preview evaluate train export-ace"),
        (split_of_words, "validate preview train export"),
        (split_that_leaves_the_set, "validate preview train export"),
        (split_without_its_sequence, "validate preview train export"),
        (manifest_of_text, "validate train evaluate export map"),
        (manifest_without_camera, "validate train export"),
        (camera_of_words, "validate train export"),
        (sequence_is_a_file, "validate preview train export"),
        (frame_of_two_names, "validate preview train export"),
    )
}
ON_SETS = {
    "validate": "validate bad",
    "preview": "preview bad --out new.gif",
    "export": "export bad --to tum --out new",
    "export-ace": "export bad --to ace --out new",
    "evaluate": "evaluate bad set/test.csv",
    "train": "train bad --out new --images 8",
    "map": "map bad --out new",
    "scan": "scan bad/seq-01 --out new.glb --color-focal 35",
    "like": "collect room.glb --frames 2 --out new --like bad/seq-01 --fov 60",
    "repeat": "collect room.glb --frames 2 --out new --mode repeat --poses bad/seq-01",
}
