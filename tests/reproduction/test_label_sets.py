"""Names of label sets: what is written is read back, and is what the rules' wildcards say."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from baselines.labels.injected import LABEL_ERRORS
from baselines.labels.methods import METHODS
from reproduction.design.label_sets import LabelSet

# As many digits as the design allows.
SIZES = st.floats(0, 100).map(lambda size: float(f"{size:.3g}")).filter(lambda size: size >= 1e-3)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("noise-p0.1-r5", ("noise", 0.1, 5.0)),
        ("noise-p0-r20", ("noise", 0.0, 20.0)),
        ("scale-p0.057-r0", ("scale", 0.057, 0.0)),
        ("rgbd-toro", ("rgbd-toro", 0.0, 0.0)),
        ("first-p1", ("first-p1", 0.0, 0.0)),
    ],
)
def test_names_are_read_and_written(name, expected):
    assert LabelSet.parse(name) == expected
    assert str(LabelSet.parse(name)) == name


@given(st.sampled_from([*LABEL_ERRORS, *METHODS]), SIZES, SIZES)
def test_every_size_of_an_error_comes_back(source, noise_m, noise_deg):
    named = LabelSet(source, noise_m, noise_deg)
    assert LabelSet.parse(str(named)) == named
    assert LabelSet.parse(source) == LabelSet(source)
