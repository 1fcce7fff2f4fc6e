"""Captures that a map is made of."""

import json

import pytest

from baselines.references.captured import as_sequence
from tests.support.capture_writers import transforms


@pytest.mark.parametrize("name", ["applied_scale", "aabb_scale"])
def test_lengths_that_are_not_metres_are_said(name, tmp_path, caplog):
    transforms(tmp_path / "capture")
    with as_sequence(tmp_path / "capture"):
        assert not caplog.messages
    file = tmp_path / "capture" / "transforms.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), name: 16}))
    with as_sequence(tmp_path / "capture") as sequence:
        assert sequence.names is not None
    assert name in caplog.text
    assert "metres" in caplog.text
