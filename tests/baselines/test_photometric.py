"""Photometric randomisation: each effect against what it is in closed form."""

import math

import numpy as np
import pytest
import torch
from scipy.fft import dct
from scipy.ndimage import gaussian_filter1d
from trimesh.visual.color import linear_to_srgb, srgb_to_linear

from baselines.training.photometric import (
    PhotometricRandomisation,
    Rectangles,
    balance_gains,
    blurred,
    covered,
    filled,
    levels_of,
    light_of,
    noisy,
    smooth_gain,
)
from synfeal.config.effects import NoiseConfig
from synfeal.config.photometric import BlurConfig, OcclusionConfig, PhotometricConfig, UnseenConfig

SIDE, COUNT = 32, 200
NOTHING = PhotometricConfig(
    unseen=None,
    field_ev=0.0,
    occlusion=None,
    blur=None,
    exposure_ev=(0.0, 0.0),
    offset=(0.0, 0.0),
    noise=None,
    white_balance_ev=0.0,
)


def only(**changed):
    """Nothing but what is named."""
    return NOTHING.model_copy(update=changed)


def grey(level, count=COUNT):
    return torch.full((count, 3, SIDE, SIDE), level, dtype=torch.uint8)


def pictures(count, seed=0):
    generator = torch.Generator().manual_seed(seed)
    return torch.randint(0, 256, (count, 3, SIDE, SIDE), generator=generator, dtype=torch.uint8)


def shown(config, images, seed=0):
    return PhotometricRandomisation(config, seed)(images)


def light_shown(config, images, seed=0):
    """Linear light, by another library, of what comes out."""
    return srgb_to_linear(shown(config, images, seed).double().numpy() / 255)


def test_what_is_empty_shows_random_colours_and_nothing_else_changes():
    images = grey(100, 2)
    images[0, :, 4:9, 6:12] = 3
    images[1, 0] = 2  # dark in one channel alone: something is seen there
    images[1, 1:] = 4
    colors = torch.tensor([0.2, 0.6, 1.0])[None, :, None, None].expand(2, 3, 4, 4)
    found = filled(images, 3, colors)
    hole = torch.zeros(SIDE, SIDE, dtype=torch.bool)
    hole[3:10, 5:13] = True  # and the pixels around it, whose edge was averaged with nothing
    expected = torch.tensor([51, 153, 255], dtype=torch.uint8)[:, None].expand(3, int(hole.sum()))
    assert torch.equal(found[0][:, hole], expected)
    assert (found[0][:, ~hole] == 100).all()
    assert torch.equal(found[1], images[1])


def test_empty_pixels_differ_between_images_and_times():
    black = grey(0, 100)
    randomisation = PhotometricRandomisation(only(unseen=UnseenConfig(cells=1)), 0)
    first, second = randomisation(black), randomisation(black)
    assert (first == first[:, :, :1, :1]).all()
    assert ((first - second).abs().amax((1, 2, 3)) > 0).all()
    levels = first[:, :, 0, 0] / 255
    assert float(levels.mean()) == pytest.approx(0.5, abs=4 / math.sqrt(12 * 300))
    assert float(levels.std()) == pytest.approx(1 / math.sqrt(12), rel=0.1)


def test_both_curves_are_those_of_srgb():
    levels = np.arange(256, dtype=np.uint8)
    light = light_of(torch.from_numpy(levels))
    np.testing.assert_allclose(light, srgb_to_linear(levels / 255), atol=1e-6)
    between = np.linspace(0, 1, 999)
    found = levels_of(torch.from_numpy(between))
    np.testing.assert_allclose(found, 255 * linear_to_srgb(between), atol=0.01)


def test_without_any_effect_images_stay_as_they_are():
    images = pictures(4)
    found = shown(NOTHING, images)
    torch.testing.assert_close(found, images.float(), atol=2e-3, rtol=0)
    assert found.is_contiguous(memory_format=torch.channels_last)


def test_exposure_multiplies_light_by_powers_of_two_alike_in_all_channels():
    before = srgb_to_linear(60 / 255)
    gains = light_shown(only(exposure_ev=(-1.0, 2.0)), grey(60)) / before
    assert (gains.max((1, 2, 3)) / gains.min((1, 2, 3)) < 1.0001).all()
    stops = np.log2(gains[:, 0, 0, 0])
    assert stops.min() >= -1.001
    assert stops.max() <= 2.001
    # A uniform distribution of 3 stops: mean 0.5, deviation 3 / sqrt(12).
    assert stops.mean() == pytest.approx(0.5, abs=4 * 0.866 / math.sqrt(COUNT))
    assert stops.std() == pytest.approx(3 / math.sqrt(12), rel=0.15)


def test_an_offset_adds_the_same_light_to_dark_and_bright():
    images = grey(30)
    images[..., SIDE // 2 :] = 150
    light = light_shown(only(offset=(0.0, 0.1)), images)
    before = srgb_to_linear(np.array([30, 150]) / 255)
    added = light[..., 0, [0, -1]] - before
    np.testing.assert_allclose(added[..., 0], added[..., 1], atol=1e-5)
    assert 0 <= added.min() < 0.01
    assert 0.09 < added.max() <= 0.1001


def test_light_beyond_white_is_white():
    assert (shown(only(exposure_ev=(3.0, 3.0)), grey(200)) > 254.999).all()
    assert (shown(only(offset=(-0.5, -0.5)), grey(100)) == 0).all()


def test_white_balance_changes_red_and_blue_beside_green():
    gains = balance_gains(torch.tensor([[1.0, -1.0], [0.0, 2.0]]))[..., 0, 0]
    torch.testing.assert_close(gains, torch.tensor([[2.0, 1.0, 0.5], [1.0, 1.0, 4.0]]))
    light = light_shown(only(white_balance_ev=0.5), grey(120))[..., 0, 0]
    np.testing.assert_allclose(light[:, 1], srgb_to_linear(120 / 255), rtol=1e-4)
    stops = np.log2(light[:, [0, 2]] / light[:, 1:2])
    assert np.abs(stops).max() <= 0.501
    assert (np.abs(stops).max(axis=0) > 0.45).all()
    assert abs(np.corrcoef(stops.T)[0, 1]) < 0.3


def test_the_light_changes_smoothly_through_its_nodes():
    nodes = torch.tensor([[0.0, 1.0], [-1.0, 3.0]])[None, None]
    gains = smooth_gain(nodes, 65)[0, 0]
    corners = gains[[0, 0, -1, -1], [0, -1, 0, -1]]
    torch.testing.assert_close(corners, torch.tensor([1.0, 2.0, 0.5, 8.0]))
    constant = torch.full((1, 1, 3, 3), -2.0)
    torch.testing.assert_close(smooth_gain(constant, SIDE), torch.full((1, 1, SIDE, SIDE), 0.25))
    light = light_shown(only(field_ev=0.4), grey(90))
    stops = np.log2(light / srgb_to_linear(90 / 255))
    np.testing.assert_allclose(stops[:, 0], stops[:, 2], atol=1e-3)
    corner = stops[:, 0, 0, 0]  # a node: nothing is interpolated there
    assert corner.std() == pytest.approx(0.4, rel=0.2)
    assert np.abs(np.diff(stops, axis=-1)).max() < 0.25


@pytest.mark.parametrize("sigma_px", [0.7, 1.5, 4.0])
def test_blur_is_scipys_mirrored_gaussian(sigma_px):
    light = torch.rand((2, 3, SIDE, SIDE), generator=torch.Generator().manual_seed(1))
    sigma = torch.tensor([[sigma_px, 0.0], [0.0, sigma_px]])
    found = blurred(light, sigma).numpy()
    for image, axis in ((0, -1), (1, -2)):
        expected = gaussian_filter1d(
            light[image].numpy(), sigma_px, axis=axis, mode="reflect", truncate=8
        )
        np.testing.assert_allclose(found[image], expected, atol=0.03 if sigma_px < 1 else 2e-4)


def test_blur_keeps_the_mean_and_adds_variances():
    light = torch.rand((3, 3, SIDE, SIDE), generator=torch.Generator().manual_seed(2))
    once = blurred(light, torch.tensor([[3.0, 0.8], [0.0, 0.0], [6.0, 6.0]]))
    torch.testing.assert_close(once.mean((2, 3)), light.mean((2, 3)), atol=1e-6, rtol=0)
    torch.testing.assert_close(once[1], light[1], atol=2e-6, rtol=0)
    twice = blurred(blurred(light[:1], torch.tensor([[1.2, 2.0]])), torch.tensor([[1.6, 1.5]]))
    torch.testing.assert_close(twice, blurred(light[:1], torch.tensor([[2.0, 2.5]])))


def test_blur_dampens_each_cosine_by_its_own_factor():
    sigma_px, frequency = 2.0, 5
    place = (np.arange(SIDE) + 0.5) / SIDE
    wave = np.cos(np.pi * frequency * place)
    light = torch.from_numpy(np.tile(wave, (1, 3, SIDE, 1))).float()
    found = blurred(light, torch.tensor([[sigma_px, 0.0]]))[0, 0, 0].numpy()
    kept = dct(found, norm="ortho")[frequency] / dct(wave, norm="ortho")[frequency]
    assert kept == pytest.approx(math.exp(-0.5 * (sigma_px * math.pi * frequency / SIDE) ** 2))


def test_blur_hits_its_share_of_the_images():
    images = pictures(COUNT)
    found = shown(only(blur=BlurConfig(share=0.3, sigma=0.2)), images)
    changed = (found - images.float()).abs().amax((1, 2, 3)) > 1
    assert int(changed.sum()) == pytest.approx(0.3 * COUNT, abs=4 * math.sqrt(0.21 * COUNT))


def test_a_rectangle_covers_what_it_says():
    edges = [torch.tensor([value]) for value in (3, 5, 7, 2)]  # left, top, width, height
    color = torch.tensor([[0.1, 0.2, 0.3]])
    found = covered(torch.ones(1, 3, SIDE, SIDE), Rectangles(*edges, color))[0]
    hidden = torch.zeros(SIDE, SIDE, dtype=torch.bool)
    hidden[5:7, 3:10] = True
    assert torch.equal(found[:, hidden], color[0][:, None].expand(3, 14))
    assert (found[:, ~hidden] == 1).all()


def test_rectangles_have_the_area_and_the_share_asked_for():
    config = OcclusionConfig(share=0.4, area=(0.1, 0.3), most_aspect=2.0)
    found = shown(only(occlusion=config), grey(128, 1000))
    hidden = ((found - 128).abs() > 0.01).any(1)
    area = hidden.float().mean((1, 2))
    hit = area > 0
    assert int(hit.sum()) == pytest.approx(400, abs=4 * math.sqrt(240))
    slack = 1.5 / SIDE  # sides are whole pixels
    assert area[hit].min() > 0.1 - slack
    assert area[hit].max() < 0.3 + slack
    assert float(area[hit].mean()) == pytest.approx(0.2, abs=0.02)
    across, down = hidden.any(1).sum(1)[hit], hidden.any(2).sum(1)[hit]
    assert torch.equal(hidden[hit].sum((1, 2)), across * down)  # a rectangle, all within the image
    aspect = across / down
    assert aspect.max() < 2.6
    assert aspect.min() > 1 / 2.6
    middle = torch.stack([hidden[hit][:, SIDE // 2].any(1), hidden[hit][:, 0].any(1)])
    assert middle.float().mean(1)[1] > 0.02  # also at the border
    assert (aspect > 1.3).any()
    assert (aspect < 0.75).any()


def test_noise_has_the_variance_of_photons_and_of_reading_out():
    noise = NoiseConfig(full_well_e=400.0, read_e=6.0)
    normal = torch.randn((1, 3, 300, 300), generator=torch.Generator().manual_seed(3))
    for level in (0.0, 0.25, 1.0):
        found = noisy(torch.full_like(normal, level), normal, noise)
        assert float(found.mean()) == pytest.approx(level, abs=2e-3)
        # In electrons: the signal's own number of them, and the read noise squared.
        assert float((400 * found).var()) == pytest.approx(400 * level + 36, rel=0.02)


def test_seeds_and_states_decide_all_that_is_drawn():
    config, images = PhotometricConfig(), pictures(8)
    one = PhotometricRandomisation(config, 4)
    first, second = one(images), one(images)
    assert not torch.equal(first, second)
    again = PhotometricRandomisation(config, 4)
    assert torch.equal(again(images), first)
    state = again.state_dict()
    other = PhotometricRandomisation(config, 5)
    assert not torch.equal(other(images), first)
    other.load_state_dict(state)
    assert torch.equal(other(images), second)


def test_levels_stay_within_a_files():
    found = shown(PhotometricConfig(), pictures(64))
    assert found.min() >= 0
    assert found.max() <= 255
    assert found.isfinite().all()


@pytest.mark.parametrize(
    "wrong",
    [
        {"exposure_ev": (1.0, -1.0)},
        {"offset": (-2.0, 0.0)},
        {"blur": {"share": 1.5}},
        {"occlusion": {"area": (0.5, 0.1)}},
        {"field_cells": 0},
        {"gain": 2},
    ],
)
def test_ranges_that_are_none_are_refused(wrong):
    with pytest.raises(ValueError, match=r"validation error"):
        PhotometricConfig.model_validate(wrong)
