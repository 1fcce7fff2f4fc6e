"""``synfeal evaluate``: how good are these poses?"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from synfeal.cli.options import Command, Options

if TYPE_CHECKING:
    from synfeal.evaluation.run import Evaluation

CONVENTIONS = tuple(
    f"{direction}-{order}"
    for direction in ("world_from_cam", "cam_from_world")
    for order in ("wxyz", "xyzw")
)
OPTIONS: Options = (
    (
        "dataset",
        {"type": Path, "metavar": "DATASET", "help": "directory of seq-01 or seq-01.zip"},
    ),
    (
        "poses",
        {
            "type": Path,
            "metavar": "POSES",
            "help": "7-Scenes tree, TUM trajectory (or a directory of seq-01.txt, ...), COLMAP"
            " model, result file of hloc or ACE, pose table, poses.csv of synfeal localize",
        },
    ),
    (
        "--split",
        {"choices": ("test", "train", "all"), "default": "test", "help": "frames to score (test)"},
    ),
    (
        "--align",
        {
            "choices": ("none", "se3", "sim3"),
            "default": "none",
            "help": "move all poses onto the data set's first, as a whole (none)",
        },
    ),
    (
        "--labels",
        {"type": Path, "metavar": "POSES", "help": "poses as a second yardstick, in any format"},
    ),
    (
        "--convention",
        {
            "choices": CONVENTIONS,
            "help": "what POSES hold, where it is not what their format says",
        },
    ),
    (
        "--rate",
        {"type": float, "default": 30.0, "metavar": "HZ", "help": "TUM: frames a second (30)"},
    ),
    ("--camera", {"type": Path, "metavar": "FILE", "help": "calibration file (manifest.json)"}),
    ("--out", {"type": Path, "help": "directory for scores.csv, errors.csv and errors.png"}),
)

FILES = ("scores.csv", "errors.csv", "errors.png")


def run(arguments: argparse.Namespace) -> None:
    """Carry out the command."""
    from synfeal.dataset.directories import refuse_foreign
    from synfeal.evaluation.run import Settings, evaluate
    from synfeal.evaluation.text import report_text

    out: Path | None = arguments.out
    if out:
        refuse_foreign(out, FILES, "an evaluation")
    names = ("split", "align", "convention", "rate", "labels", "camera")
    settings = Settings(*(getattr(arguments, name) for name in names))
    found = evaluate(arguments.dataset, arguments.poses, settings)
    print(report_text(arguments.poses, settings, found), end="")
    if out:
        _write(out, f"{arguments.poses} on {arguments.dataset}", found)
        print(f"\n{out}: {', '.join(FILES)}")


def _write(out: Path, title: str, found: Evaluation) -> None:
    from synfeal.evaluation.figure import figure_of
    from synfeal.evaluation.text import errors_table, scores_table
    from synfeal.files import atomic_path

    for name, table in zip(FILES, (scores_table(found), errors_table(found)), strict=False):
        with atomic_path(out / name) as temporary:
            table.to_csv(temporary, index=False, lineterminator="\n")
    with atomic_path(out / FILES[2]) as temporary:
        figure_of(title, found).savefig(temporary, dpi=150)


COMMAND = Command(
    "evaluate",
    "how good are these poses? yours or another program's",
    "Scores poses of any common format against a data set: errors, recalls, reprojection error.",
    "synfeal evaluate mydata results_ace.txt --out scores",
    OPTIONS,
    run,
)
