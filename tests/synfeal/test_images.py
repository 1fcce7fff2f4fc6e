"""The one reader of images: what other programs write comes back, and nothing damaged does."""

import io
import zipfile

import numpy as np
import pytest
from PIL import Image

from synfeal.camera.orientation import Orientation, orientation_of, upright
from synfeal.dataset.frame_files import ArchivedFile, encode_png
from synfeal.dataset.images import (
    image_size,
    is_of_one_color,
    read_image,
    read_rgb,
)
from synfeal.errors import InputError

RGB = np.random.default_rng(0).integers(0, 256, (12, 16, 3), dtype=np.uint8)


def written(path, pixels, mode=None, **settings):
    image = Image.fromarray(pixels)
    (image.convert(mode) if mode else image).save(path, **settings)
    return path


@pytest.mark.parametrize("write", [encode_png, None], ids=["our codec", "Pillow"])
@pytest.mark.parametrize("pixels", [RGB, (257 * RGB[..., 0].astype(np.uint16))], ids=["rgb", "16"])
def test_a_png_comes_back_whoever_wrote_it(write, pixels, tmp_path):
    path = tmp_path / "frame.png"
    if write is None:
        written(path, pixels)
    else:
        path.write_bytes(write(pixels))
    image = read_image(path)
    assert np.array_equal(np.asarray(image), pixels)
    assert image.size == image_size(path) == (16, 12)


def test_an_archived_image_is_that_of_the_folder(tmp_path):
    with zipfile.ZipFile(tmp_path / "seq-01.zip", "w") as archive:
        archive.writestr("seq-01/frame-000000.color.png", encode_png(RGB))
    archived = ArchivedFile(tmp_path / "seq-01.zip", "frame-000000.color.png")
    assert np.array_equal(read_rgb(archived), RGB)
    with pytest.raises(InputError, match=r"seq-01\.zip/frame-000001\.color\.png: missing$"):
        read_rgb(ArchivedFile(tmp_path / "seq-01.zip", "frame-000001.color.png"))


@pytest.mark.parametrize("mode", ["1", "L", "LA", "P", "RGBA", "CMYK"])
def test_colours_of_any_eight_bit_mode_are_rgb(mode, tmp_path):
    path = written(tmp_path / "picture.tif", RGB, mode)
    expected = Image.fromarray(RGB).convert(mode).convert("RGB")
    assert np.array_equal(read_rgb(path), np.asarray(expected))


def test_a_palette_with_transparency_is_read_without_a_warning(tmp_path):
    image = Image.fromarray(RGB).quantize(16)
    image.save(tmp_path / "picture.png", transparency=bytes(range(16)))
    assert np.array_equal(read_rgb(tmp_path / "picture.png"), np.asarray(image.convert("RGB")))


def test_pixels_are_averaged_where_an_image_is_shrunk(tmp_path):
    path = written(tmp_path / "frame.png", RGB)
    mean = RGB.reshape(6, 2, 8, 2, 3).mean(axis=(1, 3))
    assert np.abs(read_rgb(path, size=(16, 12), shrink=2) - mean).max() <= 0.5


# Row and column 0 of the stored pixels are, in the upright image (JEITA CP-3451, table 9):
UPRIGHT = {
    Orientation.UPRIGHT: lambda a: a,  # top, left
    Orientation.MIRRORED: lambda a: a[:, ::-1],  # top, right
    Orientation.TURNED_180: lambda a: a[::-1, ::-1],  # bottom, right
    Orientation.MIRRORED_TURNED_180: lambda a: a[::-1],  # bottom, left
    Orientation.MIRRORED_TURNED_270: lambda a: a.swapaxes(0, 1),  # left, top
    Orientation.TURNED_90: lambda a: a[::-1].swapaxes(0, 1),  # right, top
    Orientation.MIRRORED_TURNED_90: lambda a: a[::-1, ::-1].swapaxes(0, 1),  # right, bottom
    Orientation.TURNED_270: lambda a: a[:, ::-1].swapaxes(0, 1),  # left, bottom
}


@pytest.mark.parametrize("orientation", Orientation)
def test_exif_turns_are_reported_and_followed_on_demand(orientation, tmp_path):
    exif = Image.Exif()
    exif[0x0112] = int(orientation)
    path = written(tmp_path / "photo.png", RGB, exif=exif)
    image = read_image(path, "RGB")
    assert np.array_equal(np.asarray(image), RGB)  # as stored
    assert orientation_of(image) is orientation
    assert np.array_equal(np.asarray(upright(image).image), UPRIGHT[orientation](RGB))


@pytest.mark.parametrize("value", [0, 9])
def test_an_orientation_that_the_standard_does_not_know_turns_nothing(value, tmp_path):
    exif = Image.Exif()
    exif[0x0112] = value
    image = read_image(written(tmp_path / "photo.png", RGB, exif=exif))
    assert orientation_of(image) is Orientation.UPRIGHT
    assert np.array_equal(np.asarray(upright(image).image), RGB)


def png_of(pixels):
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "PNG")
    return file.getvalue()


def with_a_flipped_bit(content):
    middle = len(content) // 2
    return content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1 :]


@pytest.mark.parametrize("write", [encode_png, png_of], ids=["our codec", "Pillow"])
@pytest.mark.parametrize(
    "damage", [with_a_flipped_bit, lambda content: content[:-30], lambda _: b""]
)
def test_damage_is_told_in_one_line(write, damage, tmp_path):
    path = tmp_path / "frame.png"
    path.write_bytes(damage(write(RGB)))
    with pytest.raises(
        InputError, match=r"frame\.png: cannot be read as an image \(.+\); redo it$"
    ):
        read_image(path, remedy="; redo it")


@pytest.mark.parametrize(
    ("settings", "line"),
    [
        ({"size": (16, 13)}, "is of 16 x 12 pixels, the camera of 16 x 13"),
        ({"formats": ("JPEG",)}, "cannot be read as an image"),
        ({"most_pixels": 191}, "16 x 12 pixels are too many"),
    ],
)
def test_another_image_than_is_asked_for_is_refused(settings, line, tmp_path):
    path = tmp_path / "frame.png"
    for content in (encode_png(RGB), png_of(RGB)):
        path.write_bytes(content)
        with pytest.raises(InputError, match=line):
            read_image(path, **settings)


def test_depth_is_no_picture(tmp_path):
    path = written(tmp_path / "frame.png", RGB[..., 0].astype(np.uint16))
    with pytest.raises(InputError, match=r"frame\.png: holds pixels of mode I;16, such as depth"):
        read_rgb(path)


def test_a_frame_of_one_colour_may_have_a_few_other_pixels():
    plain = np.full((80, 80, 3), 90, np.uint8)
    assert is_of_one_color(plain)
    assert not is_of_one_color(np.where(np.arange(80)[:, None, None] < 8, 0, plain))
    assert is_of_one_color(np.where(np.arange(80)[:, None, None] < 4, 0, plain))
