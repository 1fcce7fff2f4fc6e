"""Ground of every stage: whole files or none, tables, seeds by name, reasons in words."""

import io
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from PIL import Image

from synfeal.errors import why
from synfeal.records.files import atomic_path, write_json
from synfeal.records.provenance import generator_of, seed_of
from synfeal.records.tables import (
    COUNT,
    EXTRA,
    MAYBE,
    MAYBE_COUNT,
    NUMBER,
    TEXT,
    frame_of,
    read_frame,
    read_numbers,
    write_frame,
    write_numbers,
)
from tests.support.fuzzing import JARGON
from tests.support.property_support import random_table


def test_first_frames_are_a_prefix_and_too_many_are_refused():
    table = random_table(10, 3)
    np.testing.assert_array_equal(table.first(4).position_m, table.position_m[:4])
    with pytest.raises(ValueError, match="11"):
        table.first(11)


def raised(action):
    try:
        action()
    except Exception as error:
        return error
    raise AssertionError("nothing was wrong")


@pytest.mark.parametrize(
    ("action", "words"),
    [
        (lambda: Image.open(io.BytesIO(b"no image")), "cannot identify image file"),
        (lambda: Path("absent").read_text(), "No such file or directory"),
        (lambda: b"caf\xe9".decode(), "it is not UTF-8 text"),
        (lambda: {}["camera"], "'camera' is missing"),
        (lambda: (_ for _ in ()).throw(AssertionError), "its parts do not fit together"),
        (lambda: np.array([[1], [1, 2]]), "its parts do not fit together"),
        (lambda: float("x"), "'x' is no number"),
        (lambda: int("1.5"), "'1.5' is no number"),
        (lambda: json.loads("[\n1,"), "line 2: expecting value"),
        (lambda: yaml.safe_load("a: 1\n\tb: 2"), "line 2: found character '\\t' that cannot"),
        (lambda: yaml.safe_load("a: [1"), "line 1: expected ',' or ']', but got 'stream end'"),
    ],
)
def test_a_reason_is_in_words_and_not_in_those_of_python(action, words):
    said = why(raised(action))
    assert said.startswith(words)
    assert not JARGON.search(said)


def test_a_failed_write_leaves_the_old_file_and_no_other(tmp_path):
    path = tmp_path / "result.txt"
    path.write_text("old")

    def write_half():
        with atomic_path(path) as temporary:
            temporary.write_text("half of the n")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        write_half()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_json_refuses_nan(tmp_path):
    with pytest.raises(ValueError, match="JSON compliant"):
        write_json(tmp_path / "a.json", {"error_m": float("nan")})
    assert list(tmp_path.iterdir()) == []
    write_json(tmp_path / "a.json", {"b": 1, "a": None})
    assert json.loads((tmp_path / "a.json").read_text()) == {"a": None, "b": 1}


def test_seeds_depend_on_every_component_and_on_nothing_else():
    assert seed_of(0, "train", "posenet") == seed_of(0, "train", "posenet")
    names = [(0, "a", "b"), (1, "a", "b"), (0, "ab"), (0, "a", "c"), (0, "b", "a")]
    assert len({seed_of(*name) for name in names}) == len(names)
    assert 0 <= seed_of("x") < 2**63
    assert generator_of("x").integers(2**40) == generator_of("x").integers(2**40)


SCHEMA = {"name": TEXT, "n": COUNT, "x": NUMBER, "y": MAYBE, "k": MAYBE_COUNT}
ROWS = [
    {"name": 'a,"b"\nc', "n": 2**53 - 1, "x": 0.1 + 0.2, "y": None, "k": 1234567},
    {"name": "", "n": 0, "x": -1e-300, "y": 5e-324, "k": None},
]


def test_digits_text_and_columns_come_back(tmp_path):
    frame = frame_of(ROWS, SCHEMA)
    write_frame(tmp_path / "a.csv", frame, float_format=None)
    pd.testing.assert_frame_equal(read_frame(tmp_path / "a.csv", SCHEMA), frame, check_exact=True)
    write_frame(tmp_path / "a.csv", frame_of([ROWS[0] | {"name": "a"}], SCHEMA))
    assert (tmp_path / "a.csv").read_text() == "name,n,x,y,k\na,9007199254740991,0.3,,1234567\n"
    (tmp_path / "a.csv").write_text("z,x,name\n9,1.5,a\n")
    found = read_frame(tmp_path / "a.csv", {"name": TEXT, "x": NUMBER, "x_sd": EXTRA})
    assert list(found.columns) == ["name", "x", "x_sd"]
    assert found.x.tolist() == [1.5]
    assert np.isnan(found.x_sd[0])


def test_numbers_come_back_beside_names_with_commas_and_after_a_mark_of_a_spreadsheet(tmp_path):
    path = tmp_path / "a.csv"
    write_numbers(path, "x,y,image", [[0.1 + 0.2, 2, 'a,"b".png'], [-1e-300, 5e-324, "c.png"]])
    last = "-1e-300,5e-324,c.png"
    assert path.read_text() == f'x,y,image\n0.30000000000000004,2,"a,""b"".png"\n{last}\n'
    path.write_text("\ufeff" + path.read_text(), encoding="utf-8")
    found = read_numbers(path, "x,y", "table", passed_over="image")
    assert found.tolist() == [[0.1 + 0.2, 2], [-1e-300, 5e-324]]
