"""Commands about meshes: ``synfeal scan``, ``collect``, ``plan`` and ``inspect``."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from synfeal.cli.options import command, given, keywords, option, options_of
from synfeal.config.collect import CollectConfig, LikeConfig, PlaceConfig, checked
from synfeal.records.files import read_json

# Of synfeal.scanning.camera, which --help need not load.
PRESETS = ("7scenes", "tum-fr1", "tum-fr2", "tum-fr3")
POSES_ARE = ("world_from_cam", "cam_from_world", "opengl")

if TYPE_CHECKING:
    from synfeal.planning.like import Like

FILE: dict[str, Any] = {"type": Path, "metavar": "FILE"}

# Calibrations of posed photographs with depth; `synfeal map` takes the same.
RGBD_OPTIONS = (
    option(
        "--convention",
        "direction of the poses, or opengl: world_from_cam of cameras that look along -z, y up"
        " (world_from_cam)",
        choices=POSES_ARE,
    ),
    option("--preset", "known calibrations of colour and depth", choices=PRESETS),
    option("--color-camera", "calibration of the photographs (docs/cameras.md)", **FILE),
    option("--depth-camera", "calibration of the depth images (that of colour)", **FILE),
    option(
        "--color-focal",
        "focal length in place of a file, pixels",
        type=float,
        dest="color_focal_px",
        metavar="PX",
    ),
    option("--depth-focal", "the same for depth", type=float, dest="depth_focal_px", metavar="PX"),
    option(
        "--depth-from-color",
        "transform from the colour to the depth camera: rotation vector, degrees, and translation,"
        " metres (none)",
        type=float,
        nargs=6,
        metavar=("RX", "RY", "RZ", "X", "Y", "Z"),
    ),
    option("--depth-scale", "stored value of a depth of 1 m (1000; TUM 5000)", type=float),
)


@command(
    "render a data set from a textured mesh",
    "synfeal collect scan.glb --frames 5000 --test-frames 1000 --out mydata",
    *options_of(CollectConfig, positional="mesh"),
    *options_of(LikeConfig),
    option("--out", "directory to create", type=Path, required=True),
    option("--cores", "number of rendering processes (1)", type=int, default=1, metavar="N"),
    function="synfeal.api:collect",
    was={"--mesh": "", "--workers": "--cores", "--like-frames": "--like-range"},
)
def collect(arguments: argparse.Namespace) -> None:
    """Plan camera paths through the free space of a mesh and render them as a 7-Scenes data set.

    After an interruption, the same command continues where it stopped.
    """
    from synfeal.collection.run import collect as run_collection
    from synfeal.collection.settings import collect_config

    config, like = collect_config(given(arguments, CollectConfig, LikeConfig))
    if like is not None:
        print(like_text(like, arguments.like))
    run_collection(config, arguments.out, arguments.cores)
    print(f"{arguments.out}: {frames_text(config, arguments.out)}")
    print(coverage_text(read_json(arguments.out / "coverage.json")["train"]))


@command(
    "plan the poses of a data set without rendering",
    "synfeal plan scan.glb --frames 5000 --out poses.csv",
    *options_of(CollectConfig, positional="mesh"),
    *options_of(LikeConfig),
    option("--out", "pose table to write", type=Path, required=True, metavar="FILE"),
    function="synfeal.api:plan",
)
def plan(arguments: argparse.Namespace) -> None:
    """Write the training poses that collect would render with the same options.

    A table of poses can be edited and given to collect --mode repeat --poses.
    """
    from synfeal.collection.run import n_paths, plan_training
    from synfeal.collection.settings import collect_config
    from synfeal.dataset.pose_table import write_pose_table
    from synfeal.records.files import refuse_existing, refuse_unwritable

    refuse_existing(arguments.out)
    refuse_unwritable(arguments.out)
    config, _ = collect_config(given(arguments, CollectConfig, LikeConfig))
    table = plan_training(config)
    write_pose_table(arguments.out, table)
    print(f"{arguments.out}: {len(table)} poses on {n_paths(table)} paths")


def frames_text(config: CollectConfig, out: Path) -> str:
    """Say how many frames a data set has, and on how many straight paths they lie, if any."""
    from synfeal.collection.run import SPLITS, n_paths
    from synfeal.dataset.pose_table import read_pose_table

    texts = []
    for split, name in zip(SPLITS, ("training", "test"), strict=True):
        count = config.counts[split]
        text = f"{count} {name} frames"
        if config.mode == "path" and count:
            paths = n_paths(read_pose_table(out / f"{split}.csv"))
            text += f" on {paths} {'path' if paths == 1 else 'paths'}"
        texts.append(text)
    return " and ".join(texts)


def like_text(like: Like, sequence: Path) -> str:
    """Describe what is taken from a trajectory, margins included."""
    x0, x1, y0, y1, z0, z1 = like.box
    angles = ", ".join(
        f"{name} {low:.0f} to {high:.0f}"
        for name, (low, high) in (
            ("roll", like.roll_deg),
            ("pitch", like.pitch_deg),
            ("yaw", like.yaw_deg),
        )
    )
    return (
        f"like {sequence}, {like.n_frames} frames: box {x0:.2f} {x1:.2f} {y0:.2f} {y1:.2f}"
        f" {z0:.2f} {z1:.2f} m, {angles} degrees"
    )


def coverage_text(coverage: Mapping[str, Any]) -> str:
    """Describe from ``coverage.json`` what training frames cover and how much of them is empty."""
    space, surface, empty = coverage["free_space"], coverage["surface"], coverage["empty_pixels"]
    pixels = (
        f"empty pixels: {empty['share']:.1%}, {empty['worst_frame_share']:.0%} of the emptiest"
        f" frame; {empty['mostly_empty_frames']:.1%} of the frames are more than half empty"
    )
    if space["positions_share"] is None:
        return f"coverage: no free space found in the sampling box\n{pixels}"
    return (
        f"coverage: {space['positions_share']:.0%} of the free space,"
        f" {space['headings_share']:.0%} of its headings;"
        f" {surface['seen_share']:.0%} of the visible surface,"
        f" {surface['seen_often_share']:.0%} three times or more\n{pixels}"
    )


@command(
    "describe a mesh in numbers, a picture and a 3D view; or a capture",
    "synfeal inspect scan.glb",
    *options_of(PlaceConfig, positional="mesh"),
    option("--out", "directory to write to (<name of the mesh>-inspect)", type=Path),
    option("--format", "format of a capture, where its files fit several", metavar="NAME"),
    function="synfeal.api:inspect",
)
def inspect(arguments: argparse.Namespace) -> None:
    """Show what a mesh is and where cameras can be in it, before anything is collected.

    Writes numbers, a picture and an offline 3D page, and prints the command to collect a data set.
    Of a capture (docs/captures.md), its frames, cameras, clock and extent, and two pictures.
    """
    from synfeal.captures.formats import may_be_capture
    from synfeal.inspection.run import inspect_mesh

    if arguments.format is not None or may_be_capture(arguments.mesh):
        _inspect_capture(arguments)
        return

    out = arguments.out or Path(f"{arguments.mesh.stem}-inspect")
    place = checked(PlaceConfig, given(arguments, PlaceConfig))
    unit_is_given, wording = "unit_m" in place.model_fields_set, arguments.wording.text
    text = inspect_mesh(place.scene, out, unit_is_given, wording=wording)
    print(f"{out}: inspect.html, inspect.png and inspect.json\n")
    print(text)


def _inspect_capture(arguments: argparse.Namespace) -> None:
    from synfeal.api import inspect
    from synfeal.inspection.captured import OUTPUTS, capture_text

    out = arguments.out or Path(f"{arguments.mesh.resolve().stem}-inspect")
    facts = inspect(out=out, format=arguments.format, **given(arguments, PlaceConfig))
    print(f"{out}: {', '.join(OUTPUTS)}\n")
    print(capture_text(facts))
    if facts["depth"] is not None:
        print(f"\nsynfeal build {arguments.mesh} --out place")


@command(
    "fuse posed photographs with depth into a coloured mesh",
    "synfeal scan redkitchen/seq-01 --preset 7scenes --out scan.glb",
    option(
        "sequence",
        "7-Scenes frames, folder of seq-01, ..., or TUM RGB-D sequence",
        type=Path,
        metavar="SEQUENCE",
    ),
    option("--out", "GLB to write; .json and .png beside it", type=Path, required=True),
    *RGBD_OPTIONS,
    option(
        "--range",
        "first frame and one past the last (all)",
        type=int,
        nargs=2,
        metavar=("START", "STOP"),
    ),
    option("--stride", "fuse every N-th frame (2)", type=int, default=2, metavar="N"),
    option(
        "--voxel",
        "edge of a voxel, metres (0.01)",
        type=float,
        default=0.01,
        dest="voxel_m",
        metavar="M",
    ),
    option(
        "--max-depth",
        "ignore depth beyond this, metres (4)",
        type=float,
        default=4.0,
        dest="max_depth_m",
        metavar="M",
    ),
    option(
        "--min-piece",
        "drop loose pieces smaller than this, square metres (0.02)",
        type=float,
        default=0.02,
        dest="min_piece_m2",
        metavar="M2",
    ),
    option(
        "--gravity",
        "direction of gravity in the world of the poses (found from the scene)",
        type=float,
        nargs=3,
        metavar=("X", "Y", "Z"),
    ),
    option("--keep-axes", "keep the axes of the poses' world", action="store_true"),
    option(
        "--keep-calibration",
        "use the calibration of the photographs as given, without fitting it",
        action="store_true",
    ),
    function="synfeal.api:scan",
    was={"--frames": "--range", "--poses-are": "--convention"},
)
def scan(arguments: argparse.Namespace) -> None:
    """Fuse posed RGB-D frames into one upright mesh, z up, in metres.

    Also writes a picture of it beside photographs from the same poses, and the motion between its
    world and that of the sequence.
    """
    from synfeal.api import scan as fuse

    made = fuse(**keywords(arguments, scan))
    print(scan_text(arguments.out, made.record))


def scan_text(out: Path, record: Mapping[str, Any]) -> str:
    """Describe what was made of how many frames, and how near it comes to photographs."""
    color, photographs = record["camera"]["color"], record["photographs"]
    agreement, disagreement = record["depth_agreement"], record["color_disagreement"]
    depth = "not compared"
    if agreement is not None:
        depth = (
            f"{agreement:.0%} agree, best at a focal length of {record['depth_best_focal_px']:.0f}"
            f" px ({record['camera']['depth']['fx']:.0f} px used)"
        )
    between = "photographs between the fused ones" if photographs["held_out"] else "photographs"
    return (
        f"{out}: {record['faces']:,} triangles from {record['frames']['fused']} frames\n"
        f"depth and poses: {depth}\n"
        f"photographs: disagree by {disagreement['given']:.3f} as given, {disagreement['best']:.3f}"
        f" at the best; used {color['fx']:.1f} px, centre ({color['cx']:.1f}, {color['cy']:.1f})\n"
        f"renderings: {photographs['difference']:.1f} grey levels from {photographs['compared']}"
        f" {between}, {photographs['covered']:.1%} of their pixels covered;"
        f" see {out.with_suffix('.png')}"
    )
