"""Cost of a run, from the measurements of its jobs, and what it ran on."""

import json
import math
import subprocess
from itertools import count, product

import pytest

from reproduction.config.load import load_config
from reproduction.report.html.provenance import (
    cost_sentence,
    origin_html,
    stages_of,
    write_provenance,
)
from reproduction.runs.job_times import read_jobs
from reproduction.statistics.limits import MEASURES, combine, percent_change, read_metrics, score_of
from reproduction.tables.cells import schema_of
from reproduction.tables.speed_vs_error import training_rows
from synfeal.errors import InputError
from synfeal.records.provenance import config_hash, git_commit, processor_name, provenance
from synfeal.records.tables import records_of
from tests.support.report_results import CONFIG, failed_metrics, metrics, write_rows

HEADER = "s\th:m:s\tmax_rss\tcpu_time\n"


def measure(path, seconds, peak_mb):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"{HEADER}{seconds}\t0:00:01\t{peak_mb}\t9\n")


@pytest.fixture
def benchmarks(tmp_path):
    folder = tmp_path / "benchmarks"
    measure(folder / "train" / "room" / "a.tsv", 10, 300.5)
    measure(folder / "train" / "room" / "b.tsv", 4, 200)
    measure(folder / "train" / "c.tsv", 1, "NA")
    measure(folder / "summary.tsv", 0.5, "-")
    return folder


def test_jobs_are_summed_by_stage_and_a_broken_measurement_is_named(benchmarks):
    train, summary = stages_of(read_jobs(benchmarks.rglob("*.tsv"), benchmarks))
    assert [*train.values()] == ["train", 3, 15.0, 4.0, 300.5]
    assert [*summary.values()] == ["summary", 1, 0.5, 0.5, None]
    (benchmarks / "summary.tsv").write_text("s\tmax_rss\tcpu_time\nfast\t1\t1\n")
    with pytest.raises(InputError, match=r"summary\.tsv: row 2: s must be a number"):
        read_jobs([benchmarks / "summary.tsv"], benchmarks)


def test_the_record_says_what_ran_where_and_for_how_long(benchmarks):
    root = benchmarks.parent
    out, result, folder = (root / name for name in ("provenance.json", "table.csv", "figures"))
    result.write_bytes(b"abc")
    folder.mkdir()
    (folder / "a.png").write_bytes(b"")
    write_provenance(7, "feed", list(benchmarks.rglob("*.tsv")), [result, folder], out)
    record = json.loads(out.read_text())
    assert (record["seed"], record["config_sha256"]) == (7, "feed")
    assert record["stages"][0]["seconds"] == 15.0
    # SHA-256 of "abc" and of nothing, as FIPS 180-2 and RFC 6234 print them.
    assert record["files"] == {
        "table.csv": "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
        "figures/a.png": "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855",
    }
    assert record["machine"]["usable_cores"] >= 1
    assert record["machine"]["graphics"]["backend"] != "auto"
    assert "4 jobs took 15.5 s of computing together" in cost_sentence(record)
    assert record["commit"] in origin_html(record)


def test_provenance_names_processor_commit_versions_and_configuration(tmp_path):
    path = tmp_path / "cpuinfo"
    path.write_text("processor : 0\nmodel name\t: Abacus 9 @ 1 GHz\nmodel name\t: other\n")
    assert processor_name(path) == "Abacus 9 @ 1 GHz"
    assert processor_name(tmp_path / "none")
    config = load_config(CONFIG / "config.yaml")
    record = provenance(7, config_hash(config))
    assert record["seed"] == 7
    assert record["packages"]["numpy"][0].isdigit()
    assert len(record["config_sha256"]) == 64
    assert git_commit(tmp_path) == "unknown"
    assert config_hash(config) == config_hash(config.model_copy())
    assert config_hash(config) != config_hash(config.model_copy(update={"seed": 1}))


def test_a_commit_is_dirty_when_code_changed_but_not_when_results_did(tmp_path):
    def git(*arguments):
        identity = ("-c", "user.name=a", "-c", "user.email=a@b.c")
        subprocess.run(["git", "-C", str(tmp_path), *identity, *arguments], check=True)

    (tmp_path / "results").mkdir()
    for name in ("code.py", "results/table.csv"):
        (tmp_path / name).write_text("1")
    git("init", "--quiet")
    git("add", ".")
    git("commit", "--quiet", "--message", "first")
    clean = git_commit(tmp_path / "results")
    assert len(clean) == 40
    (tmp_path / "results" / "table.csv").write_text("2")
    assert git_commit(tmp_path / "results") == clean
    (tmp_path / "code.py").write_text("2")
    assert git_commit(tmp_path) == f"{clean}-dirty"


COLUMNS = [*schema_of("table4_size", True)]
SEEDS = 2


def cell(scene, size, n_train, model, error_m):
    keys = {"scene": scene, "size": size, "model": model, "position_m_true": error_m}
    return keys | {"n_train": n_train, "n_seeds": SEEDS}


CELLS = [
    cell("large_room", "6k", 300, "posenet", 0.9),
    cell("large_room", "80k", 4000, "posenet", 0.4),
    cell("large_room", "80k", 4000, "posenet2", 0.3),
    cell("large_room", "80k", 4000, "hourglass", None),  # all seeds failed
    cell("sanctuary", "95k", 4750, "posenet", 0.5),
]


def fill(root, scene, size, model, repetition, images, seconds):
    name = f"{scene}/{size}/synfeal/pretrained/{model}/seed{repetition}"
    history = root / "runs" / name / "history.csv"
    history.parent.mkdir(parents=True)
    history.write_text(f"samples_seen,loss\n32,1.0\n{images},0.5\n")
    measured = root / "benchmarks/train" / f"{name}.tsv"
    measured.parent.mkdir(parents=True, exist_ok=True)
    # A whole number of looks, all of them busy: processor time is the time on the clock.
    measured.write_text(f"{HEADER}{seconds}\t0:00:01\t300\t{seconds}\n")


@pytest.fixture
def root(tmp_path):
    write_rows(tmp_path / "tables/table4_size.csv", COLUMNS, CELLS)
    fill(tmp_path, "large_room", "80k", "posenet", 0, 1000, 5.0)
    fill(tmp_path, "large_room", "80k", "posenet", 1, 3000, 7.0)
    fill(tmp_path, "large_room", "80k", "posenet2", 0, 1000, 2.0)
    fill(tmp_path, "large_room", "80k", "posenet2", 1, 1000, 4.0)
    return tmp_path


def test_a_localizer_has_a_row_with_seconds_over_images_of_all_seeds(root):
    first, second = records_of(training_rows(root, "large_room"))
    assert (first["variant"], second["variant"]) == ("PoseNet", "PoseNet2")
    assert first["seconds_per_item"] == pytest.approx(12.0 / 4000)
    assert second["seconds_per_item"] == pytest.approx(6.0 / 2000)
    assert (first["error"], second["error"]) == (0.4, 0.3)
    same = {"error_unit": "m", "chosen": 0}
    assert all(same.items() <= row.items() for row in (first, second))


def test_a_design_without_table_4_has_no_rows(tmp_path):
    assert training_rows(tmp_path, "large_room").empty


def test_a_training_without_measurement_or_images_is_named(root):
    with pytest.raises(InputError, match=r"sanctuary/95k/.*/posenet/seed0\.tsv: missing"):
        training_rows(root, "sanctuary")
    path = root / "runs/large_room/80k/synfeal/pretrained/posenet/seed1/history.csv"
    path.write_text("samples_seen,loss\n")
    with pytest.raises(InputError, match=r"seed1/history\.csv: shows no images"):
        training_rows(root, "large_room")


KEYS = [*MEASURES, *(f"{m}_{end}" for m in MEASURES for end in ("low", "high"))]


def run_of(first):
    """Scores that all differ: ``first``, ``first + 1``, ... in the order of ``KEYS``."""
    values = metrics("6k", 1.0, 1.0) | dict(zip(KEYS, map(float, count(first)), strict=False))
    return values | {"position_rms_m": first + 50.0, "floor_position_m": first + 60.0}


def test_a_cell_is_the_mean_of_its_runs_and_those_without_a_score_count():
    cell = combine([run_of(0), run_of(2), run_of(10)])  # offsets 0, 2, 10: mean 4, sd sqrt(28)
    for place, measure in enumerate(MEASURES):
        low = len(MEASURES) + 2 * place
        assert cell[measure] == place + 4
        # Between the normal distribution's and Student's with two degrees of freedom, whose
        # tabulated 97.5 % point is 4.303, times the standard error over three seeds.
        error = math.sqrt(28 / 3)
        above = cell[f"{measure}_high"] - (place + 4)
        widest = math.hypot(low + 1 - place, 4.303 * error)
        assert math.hypot(low + 1 - place, 1.96 * error) < above < widest
        assert cell[f"{measure}_low"] == 0
        assert cell[f"{measure}_sd"] == pytest.approx(math.sqrt(28))
    assert (cell["position_rms_m"], cell["floor_position_m"]) == (54, 60)
    assert (cell["n_train"], cell["n_test"]) == (300, 125)
    assert (cell["n_seeds"], cell["n_finished"], cell["failed"]) == (3, 3, 0)
    assert cell["limits_of"] == "paths and seeds"
    cell = combine([failed_metrics("6k"), run_of(3) | {"failed": 7}])
    assert cell["position_m"] == 3
    assert cell["position_m_sd"] is None
    assert cell["limits_of"] == "paths"  # one run has a score: its spread is not known
    assert cell["baseline_position_m_true"] == 1  # guessing the mean needs no score
    assert cell["position_rms_m"] == 53
    assert (cell["n_seeds"], cell["n_finished"], cell["failed"]) == (2, 1, 125 + 7)
    nothing = combine([failed_metrics("6k")])
    assert nothing["orientation_deg"] is None
    assert (nothing["position_rms_m"], nothing["n_finished"], nothing["n_test"]) == (None, 0, 125)
    score = score_of([run_of(0), run_of(2) | {"position_m_high": None}], "position_m")
    assert (score["position_m"], score["position_m_high"]) == (1, None)
    assert score["position_m_sd"] == pytest.approx(math.sqrt(2))


def test_percent_change():
    pairs = [(3, 2), (1, 2), (2, 2), (0, 2), (None, 2), (2, None), (2, 0)]
    expected = [50, -50, 0, -100, None, None, None]
    assert [percent_change(new, old) for new, old in pairs] == expected


GONE = object()


@pytest.mark.parametrize(
    ("keys", "values"),
    [
        ([*KEYS, "position_rms_m", "baseline_orientation_deg"], [-1.0, "one", [1.0]]),
        (["n_train", "n_test", "failed"], [-1, 0.5, None]),
        ([*KEYS, "position_rms_m", "n_train", "failed"], [GONE]),
    ],
    ids=["no error", "no count", "missing"],
)
def test_a_score_that_is_none_is_refused_by_name(tmp_path, keys, values):
    path = tmp_path / "metrics.json"
    for key, value in product(keys, values):
        changed = {k: v for k, v in (run_of(0) | {key: value}).items() if v is not GONE}
        path.write_text(json.dumps(changed))
        with pytest.raises(InputError, match=f"{key}.*score that run again") as refusal:
            read_metrics(path)
        assert str(refusal.value).startswith(str(path))
