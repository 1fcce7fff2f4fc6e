"""Tables as files: what is written reads back; what is wrong is named with its file and row."""

import numpy as np
import pandas as pd

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
