"""Photographs, sequences and trajectories as people have them: read rightly, or refused in a line.

Each input holds what :data:`COLOR`, :data:`POSE` or :data:`PATH_M` say, so what is read is compared
with that; what is refused says why in words that a person can act on.
"""

import io
import json
import struct
import zlib

import numpy as np
import pytest
from PIL import Image

from synfeal.dataset.images import read_rgb
from synfeal.dataset.posed_sequence import read_posed_sequence
from synfeal.dataset.poses_in import read_pose_list, read_trajectory
from synfeal.errors import InputError
from tests.support.fuzzing import JARGON

COLOR = (200, 90, 30)
SIZE = (16, 12)


def encoded(mode="RGB", kind="PNG", **options):
    """An image of one colour, or of its grey value."""
    image = Image.new("RGB", SIZE, COLOR)
    adaptive = Image.Palette.ADAPTIVE
    image = image.convert("P", palette=adaptive) if mode == "P;adaptive" else image.convert(mode)
    buffer = io.BytesIO()
    image.save(buffer, kind, **options)
    return buffer.getvalue()


def chunk(name, data, checksum=None):
    found = zlib.crc32(name + data) if checksum is None else checksum
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", found)


PNG, JPEG = encoded(), encoded(kind="JPEG", quality=98, subsampling=0)
END = chunk(b"IEND", b"")
LFS = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a2146\nsize 12345\n"
EXIF = Image.Exif()
EXIF[0x0112], EXIF[0x010F] = 9, "\0\xff" * 50
HUGE = chunk(b"IHDR", struct.pack(">IIBBBBB", 100_000, 100_000, 8, 2, 0, 0, 0))
IMAGES_READ = {
    "a palette": encoded("P;adaptive"),
    "a palette with a transparent entry": encoded("P;adaptive", transparency=9),
    "an alpha channel": encoded("RGBA"),
    "CMYK": encoded("CMYK", "JPEG", quality=98),
    "a progressive JPEG": encoded(kind="JPEG", quality=98, progressive=True),
    "a JPEG called .png": JPEG,
    "a BMP called .png": encoded(kind="BMP"),
    "a TIFF called .png": encoded(kind="TIFF"),
    "a lossless WebP called .png": encoded(kind="WEBP", lossless=True),
    "text behind the end": PNG + b"<html>not found</html>",
    "a second image behind the first": PNG + PNG,
    "an unknown chunk": PNG.replace(END, chunk(b"teXt", b"hello") + END),
    "an orientation of 9 and a broken maker": encoded(kind="JPEG", quality=98, exif=EXIF),
    "EXIF that is none": encoded(kind="JPEG", quality=98, exif=b"Exif\0\0garbage"),
    "an ICC profile that is none": encoded(icc_profile=b"no profile"),
}
IMAGES_REFUSED = {
    "a JPEG cut short": (JPEG[: len(JPEG) // 2], "runcated"),
    "a PNG cut short": (PNG[:-20], "cannot be read as an image"),
    "a web page": (b"<!DOCTYPE html><title>404</title>", "cannot identify image file"),
    "a pointer of Git LFS": (LFS, "cannot identify image file"),
    "nothing": (b"", "cannot identify image file"),
    "one byte": (b"\x89", "cannot identify image file"),
    "a wrong checksum": (PNG[:40] + bytes([PNG[40] ^ 1]) + PNG[41:], "cannot be read as an image"),
    "ten thousand million pixels": (PNG[:8] + HUGE + END, "more pixels than are read"),
    "a drawing": (b"<svg xmlns='http://www.w3.org/2000/svg'/>", "cannot identify image file"),
    "a PDF": (b"%PDF-1.7\n%\xe2\xe3\n", "cannot identify image file"),
    "the fork of a Mac's file": (b"\0\5\x16\7\0\2\0\0Mac OS X        ", "cannot identify"),
    "depth of 16 bits": (None, "such as depth"),
    "floating point": (encoded("F", "TIFF"), "such as depth"),
    "an empty PNG": (PNG[:8] + END, "cannot be read as an image"),
    "a WebP cut short": (encoded(kind="WEBP")[:30], "cannot be read as an image"),
}


@pytest.mark.parametrize("case", IMAGES_READ)
def test_a_careless_image_has_its_colour(tmp_path, case):
    (tmp_path / "a.png").write_bytes(IMAGES_READ[case])
    rgb = read_rgb(tmp_path / "a.png")
    assert rgb.shape == (*SIZE[::-1], 3)
    assert np.abs(rgb.astype(int) - COLOR).max() <= 6


@pytest.mark.parametrize("case", IMAGES_REFUSED)
def test_a_careless_image_is_refused_in_a_line(tmp_path, case):
    content, words = IMAGES_REFUSED[case]
    path = tmp_path / "a.png"
    if content is None:
        Image.fromarray(np.full(SIZE, 700, np.uint16)).save(path)
    else:
        path.write_bytes(content)
    with pytest.raises(InputError) as raised:
        read_rgb(path)
    assert_plain(str(raised.value), path, words)


def assert_plain(said, path, words):
    assert said.startswith(str(path)), said
    assert words in said
    assert not JARGON.search(said), said


POSE = np.array([[0, 0, 1, 2], [-1, 0, 0, 3], [0, -1, 0, 4], [0, 0, 0, 1.0]])
ROWS = "0 0 1 2\n-1 0 0 3\n0 -1 0 4\n0 0 0 1\n"
COUNT = 3


def write_frames(folder, names=range(COUNT)):
    folder.mkdir()
    for number in names:
        (folder / f"frame-{number:06d}.color.png").write_bytes(PNG)
        (folder / f"frame-{number:06d}.pose.txt").write_text(ROWS)
    return folder


def posed(change):
    """The pose of frame 1, as text."""
    return lambda folder: (folder / "frame-000001.pose.txt").write_bytes(change.encode())


def touched(*names):
    return lambda folder: [(folder / name).write_bytes(b"x") for name in names]


def renamed(old, new):
    return lambda folder: (folder / old).rename(folder / new)


SEQUENCES_READ = {
    "ends of lines of Windows": posed(ROWS.replace("\n", "\r\n")),
    "ends of lines of an old Mac": posed(ROWS.replace("\n", "\r")),
    "tabs": posed(ROWS.replace(" ", "\t")),
    "blanks at both ends": posed("".join(f"  {row}  \n" for row in ROWS.splitlines())),
    "exponents": posed(ROWS.replace("1", "1.0E+00")),
    "no new line at the end": posed(ROWS.rstrip()),
    "blank lines at the end": posed(f"{ROWS}\n\n"),
    "rounding to three decimals": posed(ROWS.replace("1 2\n", "1.0004 2\n")),
    "what systems leave in folders": touched("Thumbs.db", ".DS_Store", "desktop.ini"),
    "forks of a Mac": touched("._frame-000000.color.png", "._frame-000001.pose.txt"),
    "notes and backups": touched("readme.txt", "frame-000000.color.png.bak", "frame-1.txt~"),
    "a photograph among PNG": renamed("frame-000001.color.png", "frame-000001.color.jpg"),
    "fewer digits": lambda folder: [
        renamed(f"frame-000001.{kind}", f"frame-1.{kind}")(folder)
        for kind in ("color.png", "pose.txt")
    ],
    "a gap in the numbers": lambda folder: [
        renamed(f"frame-000001.{kind}", f"frame-000009.{kind}")(folder)
        for kind in ("color.png", "pose.txt")
    ],
    "an empty folder beside": lambda folder: (folder / "masks").mkdir(),
}
SEQUENCES_REFUSED = {
    "a pose missing": (lambda f: (f / "frame-000001.pose.txt").unlink(), "missing"),
    "an image missing": (lambda f: (f / "frame-000001.color.png").unlink(), "missing"),
    "an empty pose": (posed(""), "four rows of four"),
    "three rows": (posed(ROWS.rpartition("0 0 0 1")[0]), "four rows of four"),
    "a row twice": (posed(f"{ROWS}0 0 0 1\n"), "four rows of four"),
    "commas between": (posed(ROWS.replace(" ", ", ")), "cannot be read as a pose"),
    "decimal commas": (posed(ROWS.replace("1", "1,0")), "cannot be read as a pose"),
    "a word": (posed(ROWS.replace("4", "four")), "cannot be read as a pose"),
    "a scaled rotation": (posed(ROWS.replace("1 2\n", "1.1 2\n")), "rotation"),
    "a mirrored one": (posed(ROWS.replace("1 2\n", "-1 2\n")), "rotation"),
    "its transpose": (posed("0 -1 0 0\n0 0 -1 0\n1 0 0 0\n2 3 4 1\n"), "0 0 0 1"),
    "nothing but zeros": (posed("0 0 0 0\n" * 4), "rotation"),
    "another unit, far away": (posed(ROWS.replace("4", "4e12")), "no place in metres"),
    "UTF-16": (
        lambda f: (f / "frame-000001.pose.txt").write_bytes(ROWS.encode("utf-16")),
        "not UTF-8",
    ),
    "two images of a frame": (touched("frame-000001.color.jpg"), "second colour image"),
}


@pytest.mark.parametrize("case", SEQUENCES_READ)
def test_a_careless_sequence_has_its_poses(tmp_path, case, caplog):
    folder = write_frames(tmp_path / "photos")
    SEQUENCES_READ[case](folder)
    found = read_posed_sequence(folder)
    np.testing.assert_allclose(found.world_from_cam, [POSE] * COUNT, atol=1e-3)
    assert not caplog.records


@pytest.mark.parametrize("case", SEQUENCES_REFUSED)
def test_a_careless_sequence_is_refused_in_a_line(tmp_path, case):
    folder = write_frames(tmp_path / "photos")
    change, words = SEQUENCES_REFUSED[case]
    change(folder)
    with pytest.raises(InputError) as raised:
        read_posed_sequence(folder)
    assert_plain(str(raised.value), folder / "frame-000001", words)


PATH_M = np.array([[0.0, 0, 0], [1, 2, 3], [-2, 4, 6]])
LINES = [f"{10 + i / 2} {x:g} {y:g} {z:g} 0 0 0.6 0.8" for i, (x, y, z) in enumerate(PATH_M)]
TUM = "\n".join(LINES) + "\n"


def lines(change):
    return "\n".join(change(line) for line in LINES) + "\n"


TRAJECTORIES_READ = {
    "a comment above": f"# timestamp tx ty tz qx qy qz qw\n{TUM}",
    "comments behind": TUM.replace("0.8\n", "0.8 # tracked\n"),
    "blank lines between": TUM.replace("\n", "\n\n"),
    "ends of lines of Windows": TUM.replace("\n", "\r\n"),
    "tabs": TUM.replace(" ", "\t"),
    "several blanks": TUM.replace(" ", "   "),
    "blanks in front": lines(lambda line: f"  {line}"),
    "the mark of a spreadsheet": f"\ufeff{TUM}",
    "no new line at the end": TUM.rstrip(),
    "plus signs": TUM.replace(" 1 ", " +1 "),
    "exponents": TUM.replace("0.6", "6e-1"),
    "the other sign of quaternions": TUM.replace("0.6 0.8", "-0.6 -0.8"),
    "quaternions of seven digits": TUM.replace("0.6 0.8", "0.5999999 0.8000001"),
    "columns filled up to the right": lines(lambda line: f"{line}   "),
    "times of a clock since 1970": lines(lambda line: f"14037155{line}"),
}
TRAJECTORIES_REFUSED = {
    "nothing": ("", "holds no poses"),
    "comments alone": ("# nothing\n# was tracked\n", "holds no poses"),
    "a column short": (lines(lambda line: line[:-4]), "eight"),
    "a column more": (lines(lambda line: f"{line} 1"), "eight"),
    "commas": (TUM.replace(" ", ","), "separated by blanks"),
    "a time in words": (lines(lambda line: f"now {line[5:]}"), "eight finite numbers"),
    "a clock": (lines(lambda line: f"10:30:00 {line[5:]}"), "eight finite numbers"),
    "not a number": (TUM.replace("2 3", "nan 3"), "eight finite numbers"),
    "beyond all numbers": (TUM.replace("2 3", "1e999 3"), "eight finite numbers"),
    "a quaternion of zeros": (TUM.replace("0.6 0.8", "0 0"), "line 1"),
    "quaternions twice as long": (TUM.replace("0.6 0.8", "1.2 1.6"), "line 1"),
    "a web page": ("<!DOCTYPE html>\n<title>404</title>\n", "line 1"),
    "a pointer of Git LFS": (LFS.decode(), "line 1"),
    "JSON": (json.dumps({"poses": LINES}), "line 1"),
    "two lines run together": (TUM.replace("0.8\n", "0.8 ", 1), "line 1"),
}


@pytest.mark.parametrize("case", TRAJECTORIES_READ)
def test_a_careless_trajectory_has_its_path(tmp_path, case):
    path = tmp_path / "trajectory.txt"
    path.write_bytes(TRAJECTORIES_READ[case].encode())
    found = read_trajectory(path).world_from_cam
    np.testing.assert_allclose(found[:, :3, 3], PATH_M, atol=1e-12)
    np.testing.assert_allclose(found[:, 1, 0], 0.96, atol=1e-6)  # 2 q_z q_w
    listed = read_pose_list(path, "tum")
    np.testing.assert_allclose(listed.translation, PATH_M, atol=1e-12)


@pytest.mark.parametrize("case", TRAJECTORIES_REFUSED)
def test_a_careless_trajectory_is_refused_in_a_line(tmp_path, case):
    content, words = TRAJECTORIES_REFUSED[case]
    path = tmp_path / "trajectory.txt"
    path.write_text(content)
    with pytest.raises(InputError) as raised:
        read_trajectory(path)
    assert_plain(str(raised.value), path, words)
