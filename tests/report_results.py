"""A small results tree with known numbers, for the tests of the report."""

from pathlib import Path

import pandas as pd

from synfeal.config import MODELS, Design, Experiment, load_config, read_experiments
from synfeal.files import write_json
from synfeal.frames import read_records, write_frame
from synfeal.report.meshes import write_meshes_table
from synfeal.report.tables import write_table

CONFIG = Path(__file__).parent.parent / "config"
TABLE4 = "table4_size"
SIZES = ("6k", "20k", "40k", "80k")
ROWS = {
    "table2_ground_truth": 25,
    "table3_inconsistencies": 60,
    "table4_size": 40,
    "table5_from_scratch": 20,
    "table6_label_errors": 45,
    "table7_images_shown": 30,
}

MEASURES = ("position_m", "orientation_deg", "position_m_true", "orientation_deg_true")
FRAMES = {"6k": (300, 125), "20k": (1000, 250), "40k": (2000, 500)}
FRAMES |= {"80k": (4000, 1000), "95k": (4750, 1000)}


def experiment(table, **changes):
    values = {
        "table": table,
        "block": "",
        "scene": "large_room",
        "size": "6k",
        "labels": "synfeal",
        "noise_m": 0,
        "noise_deg": 0,
        "init": "pretrained",
    }
    return Experiment(**(values | changes))


def metrics(size, position_m, orientation_deg, true_share=1.0):
    """Scores of one run; limits are 10 % below and 20 % above each score."""
    n_train, n_test = FRAMES[size]
    shares = (position_m, orientation_deg, position_m * true_share, orientation_deg * true_share)
    scores = dict(zip(MEASURES, shares, strict=True))
    limits = {f"{m}_low": 0.9 * value for m, value in scores.items()}
    limits |= {f"{m}_high": 1.2 * value for m, value in scores.items()}
    return {
        **scores,
        **limits,
        "position_rms_m": position_m / 3**0.5,
        **references(),
        "n_train": n_train,
        "n_test": n_test,
        "failed": 0,
    }


def failed_metrics(size):
    """Scores of a run that predicted nothing finite."""
    values = dict.fromkeys(metrics(size, 1.0, 1.0))
    n_train, n_test = FRAMES[size]
    counts = {"n_train": n_train, "n_test": n_test, "failed": n_test}
    return values | counts | references()


def references():
    """What the mean pose and the true poses score."""
    baseline = {f"baseline_{m}": v for m, v in zip(MEASURES, (1.1, 70.0, 1.0, 60.0), strict=True)}
    return baseline | {"floor_position_m": 0.25, "floor_orientation_deg": 15.0}


def design_of(rows, repetitions=1, more_scenes=()):
    repeated = {"default": repetitions}
    return Design(rows=tuple(rows), repetitions=repeated, more_scenes=more_scenes)


def write_run(root, row, model, values, repetition=0):
    place = f"{row.scene}/{row.size}/{row.label_id}/{row.init}/{model}/seed{repetition}"
    write_json(root / "runs" / place / "metrics.json", values)


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


def fill_scenes(root):
    large_room = {"vertices": 50_000, "faces": 90_000, "volume_m3": 88.25, "extents_m": [1, 2, 3]}
    sanctuary = {"vertices": 80_000, "faces": 150_000, "volume_m3": 190.0}
    for scene, values in (("large_room", large_room), ("sanctuary", sanctuary)):
        write_json(root / "scenes" / scene / "properties.json", values)


def batch_record(index, assisted=False, **values):
    """A batch of 25 frames more; its last pose was 30 cm and 4 degrees off when assisted."""
    off = {"m": 0.3, "deg": 4.0} if assisted else {"m": 0.1, "deg": 1.0}
    return {
        **{"index": index, "start": 25 * index, "stop": 25 * index + 26, "assisted": assisted},
        **{"registered": 26, "filled": 0, "lost": False},
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
    config = load_config(CONFIG / "config.yaml")
    path = CONFIG / "experiments.csv"
    return read_experiments(config.model_copy(update={"experiments": path}))


def complete_results(root):
    """Scores of every run of the shipped design, and its five tables."""
    design = shipped_design()
    fill(root, design)
    fill_scenes(root)
    fill_assistance(root)
    for name in ROWS:
        make(name, design, root)
    out = root / "tables" / "table1_meshes"
    scenes = ["large_room", "sanctuary"]
    write_meshes_table(scenes, root, out.with_suffix(".csv"), out.with_suffix(".tex"))
    return root


def make(name, rows, root, repetitions=1):
    """Write a table and return its CSV rows and its LaTeX."""
    out = root / "tables" / name
    write_table(
        name, design_of(rows, repetitions), root, out.with_suffix(".csv"), out.with_suffix(".tex")
    )
    return read(out.with_suffix(".csv")), out.with_suffix(".tex").read_text()


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
