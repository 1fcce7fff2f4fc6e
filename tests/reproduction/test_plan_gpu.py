"""Hours of training on one GPU."""

import pytest

from reproduction.design.profiles import read_profile
from reproduction.plan.gpu import gpu_text
from reproduction.plan.jobs import jobs_of
from synfeal.cli import main
from synfeal.errors import InputError

HEADER = "localizer,input_px,width,batch,step,randomised,processes,images_per_s,card\n"
MODELS = ("posenet", "poselstm", "hourglass", "posenet2resnet", "posenet2")


@pytest.fixture(scope="module")
def paper():
    return read_profile("paper")


def rates(path, models=MODELS, step="captured", rate=1000.0, **shape):
    shape = {"px": 224, "width": 1, "batch": 45, "randomised": False, "processes": 1} | shape
    kind = "{px},{width},{batch},{step},{randomised},{processes}".format(step=step, **shape)
    path.write_text(HEADER + "".join(f"{name},{kind},{rate},card X\n" for name in models))
    return path


def row_of(text, name):
    (line,) = [line for line in text.splitlines() if line.split()[:1] == [name]]
    return line


def test_hours_are_images_by_rate(paper, tmp_path):
    jobs = jobs_of(paper)
    images = jobs.loc[jobs["unit"].eq("images") & jobs["rule"].isin(["train", "train_varied"])]
    per_hour = images["count"].sum() / 10  # ten hours in all
    text = gpu_text(paper, rates(tmp_path / "rates.csv", rate=per_hour / 3600))
    assert row_of(text, "all").endswith(" 10.0 h")
    assert "card X" in text
    assert "missing" not in text.replace("missing     rendering", "")
    assert "weekend" not in text


def test_the_rates_that_hours_rest_on_are_printed(paper, tmp_path):
    told = "".join(
        f"{name},224,1,45,captured,False,1,{1000 + place},card {place}\n"
        for place, name in enumerate(MODELS)
    )
    (tmp_path / "rates.csv").write_text(HEADER + told)
    text = gpu_text(paper, tmp_path / "rates.csv")
    for place, name in enumerate(MODELS):
        assert row_of(text, name).split() == [
            name,
            f"{1000 + place:,}",
            "captured",
            "card",
            str(place),
        ]
    assert "of 224 px, width 1, batch 45" in text


def test_what_was_not_measured_is_said(paper, tmp_path):
    text = gpu_text(paper, rates(tmp_path / "rates.csv", MODELS[:2], step="plain"))
    assert "over " in row_of(text, "all")
    assert "rates of captured steps" in text
    assert "224 px, width 1, batch 45" in text
    other = gpu_text(paper, rates(tmp_path / "rates.csv", px=64))
    assert row_of(other, "all").endswith("unknown")


def test_captured_rates_come_before_plain_ones(paper, tmp_path):
    plain = rates(tmp_path / "plain.csv", step="plain", rate=10.0)
    captured = rates(tmp_path / "captured.csv", rate=5000.0)
    both = tmp_path / "both.csv"
    both.write_text(plain.read_text() + captured.read_text().removeprefix(HEADER))
    assert row_of(gpu_text(paper, both), "all") == row_of(gpu_text(paper, captured), "all")


def test_rates_that_cannot_be_read_are_told(paper, tmp_path):
    (tmp_path / "rates.csv").write_text("localizer\nposenet\n")
    with pytest.raises(InputError, match=r"benchmarks\.gpu"):
        gpu_text(paper, tmp_path / "rates.csv")


def test_the_tracked_rates_tell_every_table_of_the_paper(capsys):
    assert main(["cost", "--profile", "paper", "--gpu"]) == 0
    said = capsys.readouterr().out
    for table in ("table2_ground_truth", "table4_size", "all"):
        assert not row_of(said, table).endswith("unknown")
        assert "over" not in row_of(said, table)
    assert "weekend" in said


def test_options_of_processors_are_refused_beside_a_gpu(capsys):
    assert main(["cost", "--gpu", "--cores", "4"]) == 1
    assert "--cores: is of a plan on processors" in capsys.readouterr().err
