"""Photographs of one camera as another with the same centre would have taken them."""

import cv2
import numpy as np
import pytest
from PIL import Image

from baselines.training.checkpoint import FrameCamera
from baselines.training.resample import Resampler, same_view
from synfeal.camera.calibration import Calibration
from synfeal.camera.photograph import PhotographCamera, exif_focal_px
from synfeal.config.dataset import CameraConfig
from synfeal.errors import InputError
from synfeal.render import open_renderer
from tests.support.small_room import furnished_room, room_poses

NO_LENS = (0.0, 0.0, 0.0, 0.0, 0.0)
LENSES = {
    "pinhole": NO_LENS,
    "barrel": (-0.28, 0.09, 0.001, -0.0007, -0.01),
    "pincushion": (0.2, 0.05, 0.0, 0.0, 0.0),
}
TRAINING = FrameCamera(width=160, height=120, fx=131.0, fy=131.0, cx=80.0, cy=60.0)
# Of another focal length, off its middle and with pixels that are not square.
KINECT = Calibration(640, 480, 525.0, 520.0, 310.0, 246.0, NO_LENS)


def calibration(lens, width=640, height=480, focal=0.62):
    fx, fy = focal * width, 0.99 * focal * width
    return Calibration(width, height, fx, fy, 0.49 * width, 0.52 * height, lens)


def waves(rays):
    """A picture (..., 3) as a function of directions x / z, y / z, slow beside a pixel."""
    x, y = rays[..., 0], rays[..., 1]
    channels = np.sin(9 * x + 4 * y), np.cos(11 * y - 3 * x), np.sin(7 * x * y + 5 * x)
    return 127.5 + 100 * np.stack(channels, axis=-1)


def rays_by_opencv(camera):
    """Directions (H, W, 2) of the pixels of a camera, by OpenCV, whose first pixel is at 0."""
    rows, columns = np.mgrid[: camera.height, : camera.width].astype(np.float64)
    matrix = np.array(
        [[camera.fx, 0, camera.cx - 0.5], [0, camera.fy, camera.cy - 0.5], [0, 0, 1.0]]
    )
    lens = np.array([*camera.distortion, 0, 0, 0, 0, 0][:5])
    pixels = np.stack([columns, rows], axis=-1).reshape(-1, 1, 2)
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-10)
    found = cv2.undistortPoints(pixels, matrix, lens, criteria=criteria)
    return found.reshape(camera.height, camera.width, 2)


def photograph(camera):
    return Image.fromarray(waves(rays_by_opencv(camera)).round().astype(np.uint8))


@pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)
@pytest.mark.parametrize("size", [(640, 480), (1601, 1201), (120, 90)])
def test_what_both_cameras_see_is_the_same_picture(lens, size):
    source = calibration(lens, *size)
    resampler = Resampler(source, TRAINING)
    found = np.asarray(resampler(photograph(source)), np.float64)
    expected = waves(rays_by_opencv(TRAINING))
    assert found.shape == (120, 160, 3)
    assert resampler.outside == 0
    # Within it a coarse photograph is interpolated, and two pixels at the border stay with it.
    error = np.abs(found - expected)[3:-3, 3:-3]
    assert error.max() < (8 if size[0] < 160 else 2.5)


def test_a_training_camera_with_a_lens_gets_its_distortion():
    lens = LENSES["barrel"]
    target = FrameCamera(width=160, height=120, fx=131, fy=130, cx=78, cy=61, distortion=lens)
    source = calibration(NO_LENS, focal=0.5)
    found = np.asarray(Resampler(source, target)(photograph(source)), np.float64)
    assert np.abs(found - waves(rays_by_opencv(target)))[3:-3, 3:-3].max() < 2.5


def test_rendered_photographs_of_a_room_become_its_training_frames():
    mesh, (pose,) = furnished_room((12.0, 40.0)), room_poses(1, seed=2)
    names = ("width", "height", "fx", "fy", "cx", "cy")
    training = CameraConfig(**{name: getattr(TRAINING, name) for name in names})
    kinect = CameraConfig(**{name: getattr(KINECT, name) for name in names})
    with open_renderer(mesh, training) as renderer:
        frame = renderer.render(pose).astype(float)
    with open_renderer(mesh, kinect) as renderer:
        taken = Image.fromarray(renderer.render(pose))
    found = np.asarray(Resampler(KINECT, TRAINING)(taken), float)
    squeezed = np.asarray(taken.resize((160, 120), Image.Resampling.BOX), float)
    assert np.abs(found - frame).mean() < 2.0
    assert np.abs(squeezed - frame).mean() > 3 * np.abs(found - frame).mean()


def test_area_is_averaged_so_that_nothing_finer_than_a_pixel_is_left():
    source = Calibration(1280, 960, 1048.0, 1048.0, 640.0, 480.0, NO_LENS)  # eight times as fine
    board = np.indices((960, 1280)).sum(0) % 2 * 255
    taken = Image.fromarray(np.repeat(board[..., None], 3, 2).astype(np.uint8))
    found = np.asarray(Resampler(source, TRAINING)(taken), float)
    assert np.abs(found - 127.5).max() < 2


def test_what_a_photograph_does_not_show_is_said_and_filled_with_its_border():
    narrow = Calibration(320, 240, 524.0, 524.0, 160.0, 120.0, NO_LENS)  # half the tangent
    resampler = Resampler(narrow, TRAINING)
    # It shows 320 / 524 by 240 / 524 of the training frames' 160 / 131 by 120 / 131.
    assert resampler.outside == pytest.approx(1 - 0.25, abs=0.01)
    taken = np.zeros((240, 320, 3), np.uint8)
    taken[:, :160] = 90
    taken[:, 160:] = 200
    found = np.asarray(resampler(Image.fromarray(taken)))
    assert (found[:, :70] == 90).all()
    assert (found[:, 90:] == 200).all()


def test_beyond_the_fold_of_a_lens_nothing_is_known():
    fish = Calibration(640, 480, 300.0, 300.0, 320.0, 240.0, (-0.4, 0.0, 0.0, 0.0, 0.0))
    wide = FrameCamera(width=160, height=120, fx=40.0, fy=40.0, cx=80.0, cy=60.0)
    resampler = Resampler(fish, wide)
    # Its radial part r - 0.4 r^3 turns back at r = sqrt(1 / 1.2): a circle of 36.5 pixels.
    seen = np.pi * (40 / np.sqrt(1.2)) ** 2 / (160 * 120)
    assert 1 - resampler.outside == pytest.approx(seen, rel=0.03)
    assert np.asarray(resampler(photograph(calibration(NO_LENS)))).shape == (120, 160, 3)


@pytest.mark.parametrize(
    ("changed", "same"),
    [
        ({}, True),
        ({"width": 320, "height": 240, "fx": 262.0, "fy": 262.0, "cx": 160, "cy": 120}, True),
        ({"fx": 132.0}, False),
        ({"cy": 61.0}, False),
        ({"distortion": (0.1, 0, 0, 0, 0)}, False),
    ],
)
def test_photographs_that_need_no_resampling_are_known(changed, same):
    own = {name: getattr(TRAINING, name) for name in ("width", "height", "fx", "fy", "cx", "cy")}
    assert same_view(Calibration(**{**own, "distortion": NO_LENS, **changed}), TRAINING) is same


def with_exif(focal_mm, size=(600, 400), taken=None):
    image = Image.new("RGB", size)
    exif = Image.Exif()
    inner = exif.get_ifd(0x8769)
    inner[0xA405] = focal_mm
    if taken is not None:
        inner[0xA002], inner[0xA003] = taken
    image.info["exif"] = exif.tobytes()
    return image


def test_the_focal_length_of_exif_is_that_of_film_with_the_same_diagonal():
    # 36 x 24 mm and 600 x 400 pixels have one aspect ratio: 600 / 36 pixels are a millimetre.
    assert exif_focal_px(with_exif(27)) == pytest.approx(27 * 600 / 36)
    assert exif_focal_px(with_exif(27, (400, 600), (600, 400))) == pytest.approx(450)
    four_thirds = exif_focal_px(with_exif(27, (640, 480)))
    diagonal_deg = 2 * np.degrees(np.arctan(400 / four_thirds))
    assert diagonal_deg == pytest.approx(2 * np.degrees(np.arctan(np.hypot(18, 12) / 27)))


def test_exif_that_says_nothing_or_is_of_a_cropped_picture_is_not_believed():
    assert exif_focal_px(Image.new("RGB", (60, 40))) is None
    assert exif_focal_px(with_exif(0)) is None
    assert exif_focal_px(with_exif(27, (500, 400), (600, 400))) is None
    assert exif_focal_px(with_exif(27, (300, 200), (600, 400))) == pytest.approx(225)


def test_a_calibration_goes_before_exif_and_fits_the_photograph(tmp_path):
    path = tmp_path / "cameras.txt"
    path.write_text("1 PINHOLE 640 480 525 525 320 240\n")
    camera = PhotographCamera.read(path, None, exif=True)
    found = camera.of(with_exif(27, (320, 240)), "p.jpg")
    assert (found.fx, found.cx, found.width) == (262.5, 160, 320)
    with pytest.raises(InputError, match=r"p\.jpg: its camera .*cameras\.txt is of 640x480"):
        camera.of(Image.new("RGB", (480, 640)), "p.jpg")
    focal = PhotographCamera.read(None, 100.0, exif=True).of(Image.new("RGB", (60, 40)), "p")
    assert (focal.fx, focal.cx, focal.cy) == (100, 30, 20)
    assert PhotographCamera.read(None, None, exif=False).of(with_exif(27), "p") is None


@pytest.mark.parametrize("focal", [0.0, -3.0, float("nan"), float("inf")])
def test_a_focal_length_that_is_none_is_refused(focal):
    with pytest.raises(InputError, match=r"focal_px: must be a positive number"):
        PhotographCamera.read(None, focal, exif=True)
