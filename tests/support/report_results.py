"""A small results tree with known numbers, for the tests of the report."""

import numpy as np
import pandas as pd

from baselines.config.learning import MODELS
from reproduction.config.load import load_config
from reproduction.design.experiments import Design, Experiment, read_experiments
from reproduction.statistics.limits import COLUMNS, COMMON_COLUMNS
from reproduction.tables.side import write_side_table
from reproduction.tables.write import write_table
from synfeal.records.files import write_json
from synfeal.records.tables import read_records, write_frame, write_numbers
from tests import CONFIG

TABLE4 = "table4_size"
SCENES = ("large_room", "sanctuary")
SIZES = ("6k", "20k", "40k", "80k")
ROWS = {
    "table2_ground_truth": 25,
    "table3_inconsistencies": 60,
    "table4_size": 40,
    "table5_from_scratch": 20,
    "table6_label_errors": 60,
    "table7_images_shown": 30,
}

MEASURES = ("position_m", "orientation_deg", "position_m_true", "orientation_deg_true")
FRAMES = {"6k": (300, 125), "20k": (1000, 250), "40k": (2000, 500)}
FRAMES |= {"80k": (4000, 1000), "95k": (4750, 1000)}


def experiment(table, **changes):
    values = {"table": table, "block": "", "scene": "large_room", "size": "6k"}
    values |= {"labels": "synfeal", "noise_m": 0, "noise_deg": 0, "init": "pretrained"}
    return Experiment(**(values | changes))


def metrics(size, position_m, orientation_deg, true_share=1.0):
    """Scores of one run; limits are 10 % below and 20 % above each score."""
    shares = (position_m, orientation_deg, position_m * true_share, orientation_deg * true_share)
    scores = dict(zip(MEASURES, shares, strict=True))
    limits = {f"{m}_low": 0.9 * value for m, value in scores.items()}
    limits |= {f"{m}_high": 1.2 * value for m, value in scores.items()}
    rms = {"position_rms_m": position_m / 3**0.5}
    return {**scores, **limits, **rms, **references(size), "failed": 0}


def failed_metrics(size):
    """Scores of a run that predicted nothing finite."""
    known = references(size)
    return dict.fromkeys(metrics(size, 1.0, 1.0)) | known | {"failed": known["n_test"]}


def references(size):
    """Return the scores of the mean pose and the true poses, and the number of frames."""
    baseline = {f"baseline_{m}": v for m, v in zip(MEASURES, (1.1, 70.0, 1.0, 60.0), strict=True)}
    counts = dict(zip(("n_train", "n_test"), FRAMES[size], strict=True))
    return {**baseline, "floor_position_m": 0.25, "floor_orientation_deg": 15.0, **counts}


def design_of(rows, repetitions=1, more_scenes=()):
    repeated = {"default": repetitions}
    return Design(rows=tuple(rows), repetitions=repeated, more_scenes=more_scenes)


def run_folder(root, row, model, repetition=0):
    place = f"{row.scene}/{row.size}/{row.label_id}/{row.init}/{model}/seed{repetition}"
    return root / "runs" / place


def write_run(root, row, model, values, repetition=0):
    write_json(run_folder(root, row, model, repetition) / "metrics.json", values)


def write_errors(root, row, model, errors, repetition=0):
    """Errors (N, 4) of every frame; those of the frames that all sizes share are the same."""
    rows = np.column_stack([np.arange(len(errors)), errors])
    folder = run_folder(root, row, model, repetition)
    write_numbers(folder / "errors.csv", ",".join(COLUMNS), rows.tolist())
    common = rows[:, [0, 3, 4]].tolist()
    write_numbers(folder / "common_errors.csv", ",".join(COMMON_COLUMNS), common)


def fill(root, rows, repetitions=1):
    """Scores for every run of some rows: the later the model, the lower; scratch twice as high."""
    for row in rows:
        for init, factor in {row.init: 1, "pretrained": 1, "scratch": 2}.items():
            same = row.model_copy(update={"init": init})
            share = 1.0 if row.labels == "synfeal" else 0.5
            base = factor * (1 + 3 * row.noise_m) * 300 / FRAMES[row.size][0] ** 0.5 / 17.320508
            for index, model in enumerate(MODELS):
                for k in range(repetitions):
                    score = base * (1 - 0.1 * index) * (1 + 0.02 * k)
                    write_run(root, same, model, metrics(row.size, score, 20 * score, share), k)


def fill_scenes(root, volumes_m3=(88.25, 190.0)):
    for k, (scene, volume_m3) in enumerate(zip(SCENES, volumes_m3, strict=True)):
        values = {"vertices": (50_000, 80_000)[k], "faces": (90_000, 150_000)[k]}
        values |= {"volume_m3": volume_m3} | ({} if k else {"extents_m": [1, 2, 3]})
        write_json(root / "scenes" / scene / "properties.json", values)


def batch_record(index, assisted=False, **values):
    """A batch of 25 frames more; its last pose was 30 cm and 4 degrees off when assisted."""
    off = {"m": 0.3, "deg": 4.0} if assisted else {"m": 0.1, "deg": 1.0}
    return {
        "index": index,
        "start": 25 * index,
        "stop": 25 * index + 26,
        "assisted": assisted,
        "registered": 26,
        "filled": 0,
        "lost": False,
        **{f"error_before_{unit}": value for unit, value in off.items()},
        **{f"error_after_{unit}": 0.0 if assisted else value for unit, value in off.items()},
        **values,
    }


METHODS_RUN = ("sfm", "rgbd-toro", "rgbd-g2o", "kinect-fusion")


def fill_assistance(root, assisted=None, size="6k", batches=(12, 5), scene="large_room"):
    """Records of the paper's methods; by method, how many batches were assisted, from the first.

    The first batch of the training split registered six frames fewer, which were filled.
    """
    for method, count in (assisted or dict.fromkeys(METHODS_RUN, 6)).items():
        flags = [k < count for k in range(sum(batches))]
        splits = {"train": flags[: batches[0]], "test": flags[batches[0] :]}
        records = {s: [batch_record(k, f) for k, f in enumerate(fs)] for s, fs in splits.items()}
        records["train"][0] |= {"registered": 20, "filled": 6}
        value = {"method": method, "splits": {s: {"records": r} for s, r in records.items()}}
        write_json(root / "labels" / scene / size / method / "assistance.json", value)


def shipped_design():
    config = load_config(CONFIG / "config.yaml", CONFIG / "complete.yaml")
    files = tuple(CONFIG / f"experiments{name}.csv" for name in ("", "-kinect_fusion"))
    return read_experiments(config.model_copy(update={"experiments": files}))


def complete_results(root):
    """Scores of every run of the shipped design, and its five tables."""
    design = shipped_design()
    fill(root, design)
    fill_scenes(root)
    fill_assistance(root)
    for name in ROWS:
        make(name, design, root)
    write_side_table(
        "table1_meshes", design_of(design), {}, root, *table_files(root, "table1_meshes")
    )
    return root


def table_files(root, name):
    """CSV and LaTeX of a table."""
    return [root / "tables" / f"{name}.{end}" for end in ("csv", "tex")]


def make(name, rows, root, repetitions=1):
    """Write a table and return its CSV rows and its LaTeX."""
    csv, tex = table_files(root, name)
    write_table(name, design_of(rows, repetitions), root, csv, tex)
    return read(csv), tex.read_text()


def read(path):
    """Rows of a table as text, by column."""
    return [row for _, row in read_records(path)]


def cell(rows, **keys):
    (found,) = [row for row in rows if all(row[key] == value for key, value in keys.items())]
    return found


def lines_of(tex, against):
    """Cells of the lines of a table whose errors are against something."""
    return [
        line.removesuffix(r" \\").split(" & ")
        for line in tex.splitlines()
        if against in line.split(" & ")
    ]


def write_rows(path, columns, rows):
    """A table of some columns; what a row lacks is an empty cell."""
    write_frame(path, pd.DataFrame(rows, columns=list(columns)))


def change_cell(path, column, value, row=0):
    """Set a cell of a table."""
    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    table.loc[row, column] = value
    table.to_csv(path, index=False)
