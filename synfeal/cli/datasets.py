"""Commands about data sets: ``synfeal preview``, validate, export, pairs and evaluate."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from synfeal.cli.options import command, keywords, option
from synfeal.errors import InputError

FORMATS = ("ace", "colmap", "hloc", "mstransformer", "nerfstudio", "rosbag", "tum")
CONVENTIONS = tuple(
    f"{direction}-{order}{axes}"
    for axes in ("", "-opengl")
    for direction in ("world_from_cam", "cam_from_world")
    for order in ("wxyz", "xyzw")
)
# fmt: off
POSE_FORMATS = (
    "7scenes", "tum", "kitti", "euroc", "colmap", "kapture", "hloc", "pgt", "ace", "ace0", "csv",
)
# fmt: on
LAYERS = ("color", "depth", "normals", "masks", "right", "right-depth")
DATASET = option("dataset", "directory of seq-01 or seq-01.zip", type=Path, metavar="DATASET")
CAMERA = option("--camera", "calibration file (manifest.json)", type=Path, metavar="FILE")


@command(
    "show the paths of a data set as a moving picture",
    "synfeal preview clean blurred --out both.gif",
    option(
        "datasets",
        "data set of collect; several are shown side by side",
        type=Path,
        nargs="+",
        metavar="DATASET",
    ),
    option("--out", "GIF or MP4 to write (preview.gif in the first data set)", type=Path),
    option("--frames", "number of frames to show, from the first (120)", type=int, default=120),
    option("--fps", "frames per second, at most 50 (12)", type=float, default=12.0),
    option("--split", "split to show (train)", choices=("train", "test"), default="train"),
    option("--show", "layers to show side by side (color)", nargs="+", choices=LAYERS),
    function="synfeal.api:preview",
)
def preview(arguments: argparse.Namespace) -> None:
    """Write a GIF or MP4 of the first frames of a data set.

    Several data sets, such as the same paths with other effects, are shown side by side.
    """
    from synfeal.api import preview as write

    out = arguments.out or arguments.datasets[0] / "preview.gif"
    shown = write(**{**keywords(arguments, preview), "out": out})
    print(f"{out}: {shown} frames")


@command(
    "check that a data set is complete and consistent",
    "synfeal validate mydata",
    DATASET,
    CAMERA,
    option(
        "--every-pair", "compare every pair of frames, not a sample of 600", action="store_true"
    ),
    function="synfeal.api:validate",
    was={"--all": "--every-pair"},
)
def validate(arguments: argparse.Namespace) -> None:
    """Check files, poses, splits, hashes and geometry of a data set; exit 1 if a check fails."""
    from synfeal.validation.run import error_lines, report
    from synfeal.validation.run import validate as run_checks

    checks = run_checks(arguments.dataset, arguments.camera, arguments.every_pair)
    print(arguments.wording.text(report(arguments.dataset, checks)), end="", flush=True)
    errors = error_lines(checks)
    for line in errors[:-1]:
        print(f"error: {' '.join(arguments.wording.text(line).split())}", file=sys.stderr)
    if errors:
        raise InputError(errors[-1])


@command(
    "convert a data set for ACE, COLMAP, hloc, Nerfstudio and others",
    "synfeal export mydata --to colmap --out mydata-colmap",
    DATASET,
    option("--to", "format to write", choices=FORMATS, required=True),
    option("--out", "directory to create", type=Path, required=True),
    option("--copy", "copy colour images instead of linking to them", action="store_true"),
    CAMERA,
    function="synfeal.api:export",
)
def export(arguments: argparse.Namespace) -> None:
    """Write a 7-Scenes data set in the format of another program."""
    from synfeal.api import export as write

    n_frames = write(**keywords(arguments, export))
    print(f"{arguments.out}: {n_frames} frames for {arguments.to}")


@command(
    "find frames that see the same surfaces, and optical flow between them",
    "synfeal pairs mydata --per-frame 20 --max-overlap 0.8 --flow",
    DATASET,
    option("--out", "directory to create (DATASET-pairs)", type=Path, metavar="FOLDER"),
    option(
        "--among",
        "frames to pair: within each split, within one of them, or all with all (each)",
        choices=("each", "train", "test", "all"),
        default="each",
    ),
    option(
        "--stride", "take every N-th frame of each sequence (1)", type=int, default=1, metavar="N"
    ),
    option("--min-overlap", "least overlap of a pair, 0 - 1 (0.1)", type=float, default=0.1),
    option("--max-overlap", "greatest overlap of a pair, 0 - 1 (1)", type=float, default=1.0),
    option("--per-frame", "keep only this many pairs per frame, by overlap (all)", type=int),
    option(
        "--tolerance",
        "largest relative difference of depth at which a point counts as visible (0.01)",
        type=float,
        default=0.01,
    ),
    option(
        "--grid",
        "grid of a frame's points that are looked up in the others (32 24)",
        type=int,
        nargs=2,
        default=(32, 24),
        metavar=("COLUMNS", "ROWS"),
    ),
    option("--flow", "write optical flow of each pair, both ways", action="store_true"),
    CAMERA,
    function="synfeal.api:pairs",
    was={"--every": "--stride"},
)
def pairs(arguments: argparse.Namespace) -> None:
    """Compare all frames of a data set by depth and poses, without rendering.

    Writes a table of overlaps, and optical flow if asked for.
    """
    from synfeal.pairing.choose import Choice
    from synfeal.pairing.run import PairsJob, find_pairs

    dataset: Path = arguments.dataset
    job = PairsJob(
        dataset=dataset,
        out=arguments.out or dataset.resolve().with_name(f"{dataset.resolve().name}-pairs"),
        among=arguments.among,
        choice=Choice(
            min_overlap=arguments.min_overlap,
            max_overlap=arguments.max_overlap,
            per_frame=arguments.per_frame,
        ),
        every=arguments.stride,
        tolerance=arguments.tolerance,
        grid=tuple(arguments.grid),
        flow=arguments.flow,
        camera_file=arguments.camera,
    )
    found = find_pairs(job)
    print(
        f"{job.out}: {len(found.table)} of {found.compared} pairs of {found.frames} frames"
        + ", with flow" * job.flow
    )


@command(
    "score estimated poses, yours or another program's",
    "synfeal evaluate mydata results_ace.txt --out scores",
    option(
        "dataset",
        "directory of seq-01 or seq-01.zip; or, as the reference, a capture (docs/captures.md) or a"
        " file of poses",
        type=Path,
        metavar="DATASET",
    ),
    option(
        "poses",
        "7-Scenes tree, TUM trajectory (or a directory of seq-01.txt, ...), KITTI, EuRoC, COLMAP"
        " model, kapture, result file of hloc, ACE, ACE0 or DSAC*, pseudo ground truth, pose table,"
        " poses.csv of synfeal localize",
        type=Path,
        metavar="POSES",
    ),
    option(
        "--format",
        "format of POSES (recognised by their content)",
        choices=POSE_FORMATS,
    ),
    option("--split", "frames to score (test)", choices=("test", "train", "all"), default="test"),
    option(
        "--align",
        "first align all poses, as a whole, to those of the data set (none)",
        choices=("none", "se3", "sim3"),
        default="none",
    ),
    option("--labels", "second reference poses, in any format", type=Path, metavar="POSES"),
    option(
        "--convention",
        "convention of POSES, where it is not that of their format",
        choices=(*CONVENTIONS, "opengl"),
    ),
    option(
        "--max-difference",
        "between two files of poses: largest difference of two times of a pair, seconds (0.01)",
        type=float,
        dest="max_difference_s",
        metavar="S",
    ),
    option(
        "--offset",
        "between two files of poses: seconds to add to the times of POSES (0)",
        type=float,
        dest="offset_s",
        metavar="S",
    ),
    option(
        "--rate",
        "with TUM and EuRoC: frames per second (30)",
        type=float,
        dest="rate_hz",
        metavar="HZ",
    ),
    CAMERA,
    option("--out", "directory for scores.csv, errors.csv and errors.png", type=Path),
    function="synfeal.api:evaluate",
)
def evaluate(arguments: argparse.Namespace) -> None:
    """Score poses of any common format against a data set: errors, recalls, reprojection error."""
    from synfeal.evaluation import run
    from synfeal.evaluation.text import FILES, report_text, write_files
    from synfeal.records.files import refuse_foreign

    out: Path | None = arguments.out
    if out:
        refuse_foreign(out, FILES, "an evaluation")
    settings = run.Settings(
        split=arguments.split,
        align=arguments.align,
        convention=arguments.convention,
        rate_hz=arguments.rate_hz,
        labels=arguments.labels,
        camera=arguments.camera,
        file_format=arguments.format,
        most_apart_s=(0.01 if arguments.max_difference_s is None else arguments.max_difference_s),
        offset_s=arguments.offset_s or 0.0,
    )
    found = run.evaluate(arguments.dataset, arguments.poses, settings)
    print(report_text(arguments.poses, settings, found), end="")
    if out:
        title = f"{arguments.poses} on {arguments.dataset}"
        write_files([out / name for name in FILES], title, found)
        print(f"\n{out}: {', '.join(FILES)}")
