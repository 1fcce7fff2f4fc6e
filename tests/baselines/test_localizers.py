"""One contract for all five localizers in all their shapes, and losses with closed forms."""

import sys
from types import ModuleType
from typing import NamedTuple

import pytest
import torch

from baselines.config.learning import LOCALIZERS, MODELS, LocalizerConfig, NetworkConfig
from baselines.localizers.backbones.weights import build_backbone
from baselines.localizers.base import PoseRegressor
from baselines.localizers.hourglass import UpBlock
from baselines.localizers.losses import PosePrediction
from baselines.localizers.poselstm import FourDirectionLstm
from baselines.localizers.registry import (
    backbone_of,
    build_localizer,
)
from synfeal.errors import InputError
from tests.support.added_methods import examples

NETWORK = NetworkConfig(input_px=32, width=0.125)
HYPER = LocalizerConfig(learning_rate=3e-3, dropout=0.0, beta=1.0, s_orientation=-1.0)
INCEPTION_V3 = NetworkConfig(backbone="inception_v3", input_px=75, width=0.125)
CONCATENATION = HYPER.model_copy(update={"skip": "concatenation"})
WITHOUT = HYPER.model_copy(update={"auxiliary": False})
HAVE_AUXILIARY = ("posenet", "poselstm", "posenet2")


class Case(NamedTuple):
    """A localizer in one of its shapes."""

    name: str
    network: NetworkConfig = NETWORK
    hyper: LocalizerConfig = HYPER

    def build(self):
        return build_localizer(*self)

    @property
    def n_predictions(self):
        return 3 if self.name in HAVE_AUXILIARY and self.hyper.auxiliary else 1

    def batch(self, count=6):
        return batch(count, self.network.input_px)

    def resized(self, input_px, width=0.125):
        update = {"input_px": input_px, "width": width}
        return self._replace(network=self.network.model_copy(update=update))


CASES = {
    **{name: Case(name) for name in MODELS},
    **{f"{n}-inception_v3": Case(n, INCEPTION_V3) for n in MODELS if not LOCALIZERS[n].backbone},
    "hourglass-concatenation": Case("hourglass", hyper=CONCATENATION),
    **{f"{name}-alone": Case(name, hyper=WITHOUT) for name in HAVE_AUXILIARY},
}


def over(names):
    return pytest.mark.parametrize("case", [CASES[n] for n in names], ids=list(names))


all_localizers = over(CASES)
# Where every case would take long: every localizer, every backbone, every shape once.
once = over([*MODELS, "posenet-inception_v3", "hourglass-concatenation"])


@pytest.fixture(autouse=True)
def _one_thread_and_seed():
    torch.set_num_threads(1)
    torch.manual_seed(0)


def batch(count=6, px=32):
    """Noise images, positions and unit quaternions."""
    quat = torch.nn.functional.normalize(torch.randn(count, 4), dim=1)
    return torch.randn(count, 3, px, px), torch.randn(count, 3), quat


@all_localizers
def test_predictions_have_the_contracts_shapes_and_teach_every_parameter(case):
    images, position_m, quat_wxyz = case.batch()
    localizer = case.build()
    predictions = localizer(images)
    assert len(predictions) == case.n_predictions
    for prediction in predictions:
        assert prediction.position_m.shape == (6, 3)
        assert prediction.quat_wxyz.shape == (6, 4)
    loss = localizer.loss(predictions, position_m, quat_wxyz)
    assert loss.shape == ()
    loss.backward()
    idle = [n for n, p in localizer.named_parameters() if p.grad is None or not p.grad.any()]
    assert idle == []


@all_localizers
def test_the_backbone_is_the_one_named(case):
    found, named = case.build().backbone, backbone_of(case.name, case.network)
    expected = build_backbone(named, case.network.width)
    assert type(found) is type(expected)
    assert found.state_dict().keys() == expected.state_dict().keys()


@all_localizers
def test_images_are_judged_one_by_one(case):
    """In evaluation, the company of other images in a batch changes nothing."""
    images, _, _ = case.batch()
    localizer = case.build().eval()
    with torch.inference_mode():
        together, alone = localizer(images)[0], localizer(images[2:3])[0]
    torch.testing.assert_close(together.position_m[2:3], alone.position_m, atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(together.quat_wxyz[2:3], alone.quat_wxyz, atol=1e-5, rtol=1e-4)


@once
def test_full_networks_fit_together(case):
    """At the papers' width, on images of 224 pixels, or 299 for Inception v3."""
    case = case.resized(299 if case.network.backbone == "inception_v3" else 224, width=1.0)
    with torch.device("meta"):
        images, _, _ = case.batch()
        main = case.build()(images)[0]
    assert (main.position_m.shape, main.quat_wxyz.shape) == ((6, 3), (6, 4))


@all_localizers
def test_the_pose_prior_moves_every_regressor(case):
    localizer = case.build()
    mean = torch.tensor([10.0, -20.0, 30.0])
    localizer.set_pose_prior(mean)
    biases = [m.position.bias for m in localizer.modules() if isinstance(m, PoseRegressor)]
    assert len(biases) == case.n_predictions
    assert all(torch.equal(bias, mean) for bias in biases)


@pytest.mark.parametrize("name", HAVE_AUXILIARY)
def test_auxiliary_predictions_count_three_tenths(name):
    """Whatever the loss: learned weights that are 0 leave distances as they are."""
    hyper = HYPER.model_copy(update={"s_position": 0.0, "s_orientation": 0.0})
    localizer = build_localizer(name, NETWORK, hyper)
    position_m, quat_wxyz = torch.zeros(1, 3), torch.tensor([[1.0, 0.0, 0.0, 0.0]])
    off = [PosePrediction(torch.tensor([[d, 0.0, 0.0]]), quat_wxyz) for d in (1.0, 10.0, 100.0)]
    loss = localizer.loss(off, position_m, quat_wxyz)
    assert loss.item() == pytest.approx(1.0 + 0.3 * 10.0 + 0.3 * 100.0)


@pytest.mark.parametrize("name", HAVE_AUXILIARY)
def test_auxiliary_regressors_leave_the_rest_of_the_network_as_it_is(name):
    """Same seed, same first weights: a comparison of runs with and without them is paired."""
    parts = []
    for hyper in (HYPER, WITHOUT):
        torch.manual_seed(3)
        parts.append(build_localizer(name, NETWORK, hyper).state_dict())
    both, alone = parts
    assert {key for key in both if not key.startswith("auxiliary")} == alone.keys()
    assert all(torch.equal(both[key], value) for key, value in alone.items())


@pytest.mark.parametrize(
    ("case", "prediction", "last", "next_one"),
    [
        *[(name, 1, "inception4a", "inception4b") for name in HAVE_AUXILIARY],
        *[(name, 2, "inception4d", "inception4e") for name in HAVE_AUXILIARY],
        ("posenet-inception_v3", 1, "Mixed_5d", "Mixed_6a"),
        ("posenet-inception_v3", 2, "Mixed_6e", "Mixed_7a"),
    ],
)
def test_auxiliary_regressors_branch_off_after_the_block_named(case, prediction, last, next_one):
    """A gradient tells which blocks a prediction is made of."""
    localizer = CASES[case].build()
    images, _, _ = CASES[case].batch()
    localizer(images)[prediction].position_m.sum().backward()
    for block, reached in ((last, True), (next_one, False)):
        parameters = localizer.backbone.get_submodule(block).parameters()
        assert all((p.grad is not None) == reached for p in parameters), block


def test_an_up_block_adds_or_appends_the_encoders_maps():
    added, appended = UpBlock(8, 4, concatenate=False), UpBlock(8, 4, concatenate=True)
    appended.load_state_dict(added.state_dict())
    maps, encoder = torch.randn(2, 8, 5, 5), torch.randn(2, 4, 9, 10)
    upsampled, passed_on = appended(maps, encoder).split(4, dim=1)
    assert torch.equal(passed_on, encoder)
    assert (upsampled >= 0).all()
    torch.testing.assert_close(added(maps, encoder), upsampled + encoder)


def test_the_example_of_the_page_is_a_localizer(monkeypatch):
    """It keeps the contract with either backbone, once it is added as the page says."""
    direct = ModuleType("my_methods.direct")
    exec(examples()["direct"], direct.__dict__)
    monkeypatch.setitem(sys.modules, direct.__name__, direct)
    name = direct.Direct.kind.name
    monkeypatch.setitem(LOCALIZERS, name, direct.Direct.kind)
    for network in (NETWORK, INCEPTION_V3):
        case = Case(name, network)
        test_predictions_have_the_contracts_shapes_and_teach_every_parameter(case)
        test_the_backbone_is_the_one_named(case)
        test_the_pose_prior_moves_every_regressor(case)


@pytest.mark.parametrize("name", ["posenet", "poselstm", "hourglass"])
def test_a_fixed_weight_must_be_configured(name):
    with pytest.raises(InputError, match=rf"localizers\.{name}\.beta"):
        build_localizer(name, NETWORK, LocalizerConfig())


def test_full_width_has_the_papers_sizes():
    """Feature of 2048 units; PoseLSTM reads it as 32 x 64, with 128 units in each direction."""
    network = NetworkConfig(input_px=64, width=1.0)
    posenet2 = build_localizer("posenet2", network, HYPER)
    assert posenet2.regressor[-1].position.in_features == 2048
    poselstm = build_localizer("poselstm", network, HYPER)
    assert poselstm.lstm.shape == (32, 64)
    assert poselstm.regressor[-1].position.in_features == 4 * 128


def test_the_lstm_reads_in_four_directions():
    """The first unit read and the last unit read both reach the output, along rows and columns."""
    lstm = FourDirectionLstm(4, 6, 5)
    features = torch.randn(1, 24, requires_grad=True)
    for part in lstm(features).split(5, dim=1):
        features.grad = None
        part.sum().backward(retain_graph=True)
        assert (features.grad != 0).all()
    matrix = features.detach().view(4, 6)
    _, (state, _) = lstm.vertical(matrix[:, None, :])
    torch.testing.assert_close(lstm(features)[0, :5], state[0, 0])
    _, (state, _) = lstm.horizontal(matrix.T[:, None, :])
    torch.testing.assert_close(lstm(features)[0, 10:15], state[0, 0])
