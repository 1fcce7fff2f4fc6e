"""A data set in which every image, depth and pose says which frame it is of, and ways to damage it.

The number of a frame is the grey level of its image, its depth in decimetres, and the x of its
camera in metres. So whatever a reader pairs can be read off.
"""

import io
import json
import shutil
import zipfile

import numpy as np
from PIL import Image

from synfeal.config.dataset import CameraConfig
from synfeal.dataset.frame_files import encode_png, write_archive
from synfeal.dataset.pose_table import PoseTable, write_pose_table
from synfeal.dataset.sevenscenes import Sequence, pose_text, write_splits

CAMERA = CameraConfig(width=32, height=32, horizontal_fov_deg=60.0)
PER_SEQUENCE = 6
SEQUENCES = (("seq-01", "train"), ("seq-02", "train"), ("seq-03", "test"))
N_TRAIN = 2 * PER_SEQUENCE
FIRST = 1  # so that no frame is black, or has depth 0


def write_numbered_set(folder, with_tables=True, archived=False):
    """Three sequences of six frames, two of them for training; depth for all."""
    for place, (name, _) in enumerate(SEQUENCES):
        directory = folder / name
        directory.mkdir(parents=True)
        for number in range(PER_SEQUENCE):
            value = FIRST + place * PER_SEQUENCE + number
            stem = directory / f"frame-{number:06d}"
            stem.with_suffix(".color.png").write_bytes(
                encode_png(np.full((32, 32, 3), 10 * value, np.uint8))
            )
            stem.with_suffix(".depth.png").write_bytes(
                encode_png(np.full((32, 32), 100 * value, np.uint16))
            )
            stem.with_suffix(".pose.txt").write_text(pose_text(pose_of(value)))
        if archived:
            write_archive(directory, folder / f"{name}.zip")
            shutil.rmtree(directory)
    sequences = [Sequence(name, split, 0, PER_SEQUENCE) for name, split in SEQUENCES]
    write_splits(folder, sequences)
    (folder / "manifest.json").write_text(json.dumps({"camera": CAMERA.record}))
    for split in ("train", "test") if with_tables else ():
        write_true_table(folder / f"{split}.csv", split)


def pose_of(value):
    pose = np.eye(4)
    pose[0, 3] = value
    return pose


def write_true_table(path, split, named=True):
    """The true poses of a split, with the names of the images or without."""
    own = [(place, name) for place, (name, of) in enumerate(SEQUENCES) if of == split]
    x = [FIRST + place * PER_SEQUENCE + k for place, _ in own for k in range(PER_SEQUENCE)]
    names = [f"{name}/frame-{k:06d}.color.png" for _, name in own for k in range(PER_SEQUENCE)]
    frame = np.arange(len(x))
    position_m = np.column_stack([x, np.zeros((len(x), 2))]).astype(float)
    quat_wxyz = np.tile([1.0, 0.0, 0.0, 0.0], (len(x), 1))
    table = PoseTable(frame, frame // PER_SEQUENCE, position_m, quat_wxyz)
    write_pose_table(path, table, names if named else ())


def value_of_image(content):
    """The number of the frame that an encoded colour image or a depth image shows."""
    pixels = np.asarray(Image.open(io.BytesIO(content)))
    return float(pixels.ravel()[0]) / (100 if pixels.dtype != np.uint8 else 10)


def members(folder, sequence="seq-01"):
    """Names and contents of the files of a sequence, archived or not, in order."""
    archive = folder / f"{sequence}.zip"
    if archive.is_file():
        with zipfile.ZipFile(archive) as opened:
            return [(i.filename.partition("/")[2], opened.read(i)) for i in opened.infolist()]
    return [(path.name, path.read_bytes()) for path in sorted((folder / sequence).iterdir())]


def write_members(folder, files, sequence="seq-01"):
    """Write a sequence anew with these files; an archive may hold a name twice."""
    archive = folder / f"{sequence}.zip"
    if archive.is_file():
        archive.unlink()
        with zipfile.ZipFile(archive, "w") as packed:
            for name, content in files:
                packed.writestr(zipfile.ZipInfo(f"{sequence}/{name}"), content)
        return
    shutil.rmtree(folder / sequence)
    (folder / sequence).mkdir()
    for name, content in files:
        (folder / sequence / name).write_bytes(content)


def delete(*names):
    def damage(folder):
        write_members(folder, [file for file in members(folder) if file[0] not in names])

    return damage


def rename(old, new):
    def damage(folder):
        files = [(new if name == old else name, content) for name, content in members(folder)]
        assert files != members(folder)
        write_members(folder, files)

    return damage


def copy(old, new):
    """A second file of the same content; under the same name, archives hold it twice."""

    def damage(folder):
        files = members(folder)
        write_members(folder, [*files, (new, dict(files)[old])])

    return damage


def edit_lines(name, edit):
    def damage(folder):
        path = folder / name
        lines = path.read_text().splitlines()
        changed = edit(lines)
        assert changed != lines
        path.write_text("".join(f"{line}\n" for line in changed))

    return damage


def without_line(at):
    return lambda lines: [*lines[:at], *lines[at + 1 :]]


def doubled_line(at):
    return lambda lines: [*lines[: at + 1], *lines[at:]]


def replaced_in_line(at, old, new):
    return lambda lines: [*lines[:at], lines[at].replace(old, new), *lines[at + 1 :]]
