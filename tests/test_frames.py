"""Tables as files: what is written reads back; what is wrong is named with its file and row."""

import numpy as np
import pandas as pd
import pytest

from synfeal.errors import InputError
from synfeal.frames import (
    COUNT,
    EXTRA,
    MAYBE,
    MAYBE_COUNT,
    NUMBER,
    TEXT,
    frame_of,
    read_frame,
    write_frame,
)

SCHEMA = {"name": TEXT, "n": COUNT, "x": NUMBER, "y": MAYBE, "k": MAYBE_COUNT}
ROWS = [
    {"name": 'a,"b"\nc', "n": 2**53 - 1, "x": 0.1 + 0.2, "y": None, "k": 1234567},
    {"name": "", "n": 0, "x": -1e-300, "y": 5e-324, "k": None},
]


def test_all_digits_and_all_text_come_back(tmp_path):
    frame = frame_of(ROWS, SCHEMA)
    write_frame(tmp_path / "a.csv", frame, float_format=None)
    pd.testing.assert_frame_equal(read_frame(tmp_path / "a.csv", SCHEMA), frame, check_exact=True)


def test_six_digits_of_numbers_and_all_of_counts(tmp_path):
    write_frame(tmp_path / "a.csv", frame_of([ROWS[0] | {"name": "a"}], SCHEMA))
    assert (tmp_path / "a.csv").read_text() == "name,n,x,y,k\na,9007199254740991,0.3,,1234567\n"


def test_columns_are_found_by_name_and_extra_ones_may_be_missing(tmp_path):
    (tmp_path / "a.csv").write_text("z,x,name\n9,1.5,a\n")
    found = read_frame(tmp_path / "a.csv", {"name": TEXT, "x": NUMBER, "x_sd": EXTRA})
    assert list(found.columns) == ["name", "x", "x_sd"]
    assert found.x.tolist() == [1.5]
    assert np.isnan(found.x_sd[0])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "No such file"),
        ("", "column a, n, x missing"),
        ("a,n\nb,1\n", "column x missing"),
        ("a,n,x\nb,1\n", "row 2: has 2 cells where the header has 3"),
        ("a,n,x\n\nb,1,2,3\n", "row 3: has 4 cells"),
        ('a,n,x\n"b,1,2\n', "cannot be read as CSV"),
        ("a,n,x\nb,1.5,2\n", "row 2: n must be a whole number, found '1.5'"),
        ("a,n,x\nb,1e30,2\n", "row 2: n must be a whole number, found '1e30'"),
        ("a,n,x\nb,1,\n", "row 2: x must be a number, found ''"),
        ("a,n,x\nb,1,inf\n", "x must be a number, found 'inf'"),
        ("a,n,x\nb,1,2\nb,1,x\n", "row 3: x must be a number"),
        ("\xff", "cannot be read as CSV"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(tmp_path, text, message):
    path = tmp_path / "a.csv"
    if text is not None:
        path.write_bytes(text.encode("latin-1"))
    with pytest.raises(InputError) as refusal:
        read_frame(path, {"a": TEXT, "n": COUNT, "x": NUMBER}, "measure again")
    assert str(refusal.value).startswith(f"{path}: ")
    assert str(refusal.value).endswith("; measure again")
    assert message in str(refusal.value)
    assert "\n" not in str(refusal.value)
