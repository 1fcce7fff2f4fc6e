"""Pairs across paths on toy trajectories, and features where there are few."""

import numpy as np
import pycolmap
import pytest
from PIL import Image, ImageOps

from baselines.labels.batches import link_images
from baselines.labels.sfm.batch import match_features, sfm_batch
from baselines.labels.sfm.features import extract_features
from baselines.labels.sfm.pairs import match_retrieved, retrieved_pairs, thumbnails
from synfeal.errors import InputError
from tests.baselines.test_sfm_hard import CAMERA, CFG, sideways, write


def there_and_back(n_frames):
    """Unit vectors (n, 2) of a camera that goes a quarter round and returns the same way."""
    half = np.linspace(0, np.pi / 2, n_frames // 2)
    angle = np.concatenate([half, half[::-1]])
    return np.column_stack([np.cos(angle), np.sin(angle)]).astype(np.float32)


def test_every_frame_is_paired_with_the_one_at_the_same_place_on_the_way_back():
    pairs = retrieved_pairs(there_and_back(80), 1)
    for frame in range(31):  # the turning point is at 39.5
        assert (frame, 79 - frame) in pairs
    assert all(j - i > 16 for i, j in pairs)
    assert len(set(pairs)) == len(pairs)


def test_frames_chosen_for_a_frame_are_not_neighbours_of_each_other():
    """Frames 20 to 40 look most like frame 0, and all others like each other."""
    vectors = np.tile(np.float32([0.6, 0.8]), (60, 1))
    vectors[0], vectors[20:41] = [1, 0], [0.8, 0.6]
    assert [j for i, j in retrieved_pairs(vectors, 5) if i == 0] == [20, 25, 30, 35, 40]
    nearer = retrieved_pairs(vectors, 2, suppressed_frames=0)
    assert [j for i, j in nearer if i == 0] == [20, 21]


@pytest.mark.parametrize(("n_frames", "count"), [(1, 10), (17, 10), (18, 10), (60, 0)])
def test_short_batches_and_none_asked_for(n_frames, count):
    pairs = retrieved_pairs(there_and_back(2 * n_frames)[:n_frames], count)
    assert pairs == ([(0, 17)] if (n_frames, count) == (18, 10) else [])


def test_a_thumbnail_is_what_lies_under_its_pixels_whatever_the_brightness(tmp_path):
    paths = write(tmp_path, sideways(2))
    vector = thumbnails(paths, CAMERA)[1].reshape(24, 32)
    grey = np.asarray(Image.open(paths[1]).convert("L"), float)
    blocks = grey.reshape(24, 5, 32, 5).mean(axis=(1, 3))
    assert np.corrcoef(vector.ravel(), blocks.ravel())[0, 1] > 0.9999
    assert vector.mean() == pytest.approx(0, abs=1e-6)
    assert np.linalg.norm(vector) == pytest.approx(1, abs=1e-5)
    darker = Image.open(paths[1]).point(lambda value: value // 2)
    darker.save(paths[0])
    Image.new("RGB", darker.size, (90, 90, 90)).save(paths[1])
    dark, flat = thumbnails(paths, CAMERA)
    assert dark @ vector.ravel() > 0.999
    assert not flat.any()
    with pytest.raises(InputError, match="missing; collect the data set again"):
        thumbnails([tmp_path / "none.png"], CAMERA)


def described(folder, paths, cfg):
    """A database with features of images, by their names."""
    link_images(paths, CAMERA, folder / "images")
    n_poor = extract_features(folder / "images", folder / "db.db", CAMERA, cfg)
    return folder / "db.db", n_poor


def keypoints(database):
    with pycolmap.Database.open(database) as opened:
        images = sorted(opened.read_all_images(), key=lambda image: image.name)
        return [np.array(opened.read_keypoints(image.image_id)) for image in images]


def test_the_same_view_20_frames_later_is_matched_when_it_is_retrieved(tmp_path):
    poses = sideways(10)[[*range(10), *[9] * 10, *range(10)[::-1]]]
    database, _ = described(tmp_path, write(tmp_path, poses), CFG)
    names = [f"{frame:06d}.png" for frame in range(30)]
    with pycolmap.Database.open(database) as opened:
        ids = {image.name: image.image_id for image in opened.read_all_images()}
    ends = ids[names[0]], ids[names[29]]
    match_features(database, CFG, 0)
    with pycolmap.Database.open(database) as opened:
        assert not opened.exists_two_view_geometry(*ends)
    match_retrieved(database, names, [(0, 29)], CFG, 0)
    with pycolmap.Database.open(database) as opened:
        assert len(opened.read_two_view_geometry(*ends).inlier_matches) > 100


def faint(path, share):
    """Lower the contrast of an image, and keep its mean."""
    image = Image.open(path)
    grey = Image.new("RGB", image.size, (128, 128, 128))
    Image.blend(grey, ImageOps.grayscale(image).convert("RGB"), share).save(path)


def test_faint_images_get_more_and_weaker_features_and_no_other_image_does(tmp_path):
    paths = write(tmp_path, sideways(3))
    faint(paths[1], 0.06)
    counts = {}
    for few in (0, 60):
        folder = tmp_path / str(few)
        folder.mkdir()
        usual = CFG.model_copy(update={"peak_threshold": 0.0067, "few_features": few})
        database, n_poor = described(folder, paths, usual)
        assert n_poor == (few > 0)
        counts[few] = keypoints(database)
    assert len(counts[0][1]) < 60
    assert len(counts[60][1]) > 3 * len(counts[0][1])
    for image in (0, 2):
        np.testing.assert_array_equal(counts[0][image], counts[60][image])


def test_a_faint_wall_in_between_no_longer_breaks_a_batch(tmp_path):
    poses = sideways(13)
    paths = write(tmp_path, poses)
    for path in paths[7:10]:
        faint(path, 0.06)
    registered = {}
    for few in (0, 60):
        told = {"quadratic_overlap": False, "peak_threshold": 0.0067, "few_features": few}
        trajectory, facts = sfm_batch(paths, CAMERA, poses, CFG.model_copy(update=told), 0)
        registered[few] = int(trajectory.registered.sum())
        assert facts["images_with_weak_features"] == (3 if few else 0)
    assert registered[0] < 10
    assert registered[60] == 13
