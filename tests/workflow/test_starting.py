"""`python -m benchmarks.starting`: what jobs say of their work, beside Snakemake's clock."""

import pandas as pd
import pytest

from benchmarks.starting import shares
from synfeal.errors import InputError

DRAWN = "INFO synfeal: rendering with opengl\nseq-01, 2500 frames in {} s, 230.1/s\n"
TRAINED = """\
INFO selection: 600 of 1200 samples, loss 1.0, held out 1.0 m/9.0°, 50 samples/s, 12 s left
INFO selection: 1200 of 1200 samples, loss 0.5, held out 0.5 m/5.0°, 60 samples/s, 0 s left
"""


def write_log(folder, job, text):
    path = folder / f"{job}.log"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def test_the_rest_of_a_jobs_time_is_what_it_does_not_work(tmp_path):
    """Two jobs draw for 8 and 10 of 12 seconds each; one trains for 1200 / 60 of 25 seconds."""
    write_log(tmp_path, "render_packed/room/seq-01", DRAWN.format(8.0))
    write_log(tmp_path, "render_packed/room/seq-02", DRAWN.format(10.0))
    write_log(tmp_path, "train/room/6k/seed0", TRAINED)
    rows = [("render_packed", f"room/seq-0{n}", 12.0) for n in (1, 2)]
    jobs = pd.DataFrame([*rows, ("train", "room/6k/seed0", 25.0)])
    table = shares(jobs.set_axis(["stage", "job", "wall_s"], axis=1), tmp_path).set_index("stage")
    assert table.jobs.to_dict() == {"render_packed": 2, "train": 1}
    assert table.rest_share["render_packed"] == pytest.approx(0.25)
    assert table.rest_share["train"] == pytest.approx(0.2)


def test_logs_that_say_nothing_are_refused(tmp_path):
    write_log(tmp_path, "render_packed/room/seq-01", "error: no space left\n")
    jobs = pd.DataFrame([("render_packed", "room/seq-01", 1.0)])
    with pytest.raises(InputError, match="no log says"):
        shares(jobs.set_axis(["stage", "job", "wall_s"], axis=1), tmp_path)
