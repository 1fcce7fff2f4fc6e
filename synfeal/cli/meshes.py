"""Commands about meshes: ``synfeal scan``, ``collect`` and ``inspect``."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

from synfeal.camera.projection import Projection
from synfeal.cli.options import MESH_OPTIONS, command, option, options_among
from synfeal.config.collection import CollectionConfig
from synfeal.config.dataset import RenderConfig, Shade
from synfeal.config.options import KEYS, dataset_config, options_named, scene_config
from synfeal.errors import InputError
from synfeal.records.files import read_json

# Of synfeal.scanning.camera, which --help need not load.
PRESETS = ("7scenes", "tum-fr1", "tum-fr2", "tum-fr3")
POSES_ARE = ("world_from_cam", "cam_from_world", "opengl")
MARGIN_M, MARGIN_DEG = 0.2, 10.0  # of --like

if TYPE_CHECKING:
    from synfeal.collection.run import CollectJob
    from synfeal.config.dataset import CameraConfig
    from synfeal.planning.like import Like

BACKENDS = get_args(RenderConfig.model_fields["backend"].annotation)
SHADES = get_args(Shade)
DETAILS = get_args(RenderConfig.model_fields["detail"].annotation)
PROJECTIONS = get_args(Projection)
MODES = get_args(CollectionConfig.model_fields["mode"].annotation)
RANGE: dict[str, Any] = {"type": float, "nargs": 2, "metavar": ("FROM", "TO")}
FILE: dict[str, Any] = {"type": Path, "metavar": "FILE"}

# Calibrations of posed photographs with depth; `synfeal map` takes the same.
RGBD_OPTIONS = (
    option(
        "--poses-are",
        "direction of the poses, or opengl: world_from_cam of cameras that look along -z, y up"
        " (world_from_cam)",
        choices=POSES_ARE,
    ),
    option("--preset", "known calibrations of colour and depth", choices=PRESETS),
    option("--color-camera", "calibration of the photographs (docs/cameras.md)", **FILE),
    option("--depth-camera", "calibration of the depth images (that of colour)", **FILE),
    option("--color-focal", "focal length in place of a file, pixels", type=float, metavar="PX"),
    option("--depth-focal", "the same for depth", type=float, metavar="PX"),
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
    "synfeal collect --mesh scan.glb --frames 5000 --test-frames 1000 --out mydata",
    option("--mesh", "GLB, glTF, OBJ or PLY file", type=Path, required=True),
    option("--frames", "number of training frames", type=int, required=True),
    option("--out", "directory to create", type=Path, required=True),
    option("--test-frames", "number of test frames (0)", type=int, default=0),
    option("--depth", "write depth images too", action="store_true"),
    option("--normals", "write surface normals too (docs/layers.md)", action="store_true"),
    option("--masks", "write masks of parts and objects too", action="store_true"),
    option("--seed", "seed of all random numbers (0)", type=int),
    *MESH_OPTIONS,
    option("--spacing", "distance between frames, metres (0.03)", type=float),
    option("--roll", "bounds of the camera's roll, degrees (-29.8 29.8)", **RANGE),
    option("--pitch", "bounds of its pitch, degrees; positive is down (-29.8 29.8)", **RANGE),
    option("--yaw", "bounds of its heading, degrees; 0 is world x, 90 is y (0 360)", **RANGE),
    option("--min-view-distance", "least free view at the end of a path, metres (1.2)", type=float),
    option(
        "--min-seen",
        "least share of the view that the mesh fills (0; 0.85 with --like)",
        type=float,
    ),
    option("--min-clearance", "least distance of cameras from surfaces, metres (0)", type=float),
    option(
        "--min-path", "least length of a path, metres; shorter ones are redrawn (1.5)", type=float
    ),
    option(
        "--test-paths", "least number of paths among the test frames (8)", type=int, metavar="N"
    ),
    option(
        "--mode",
        "straight paths, independent (random) poses, or those of --poses (path)",
        choices=MODES,
    ),
    option(
        "--poses",
        "with --mode repeat: data set, 7-Scenes frames, pose table (.csv) or TUM trajectory",
        **FILE,
    ),
    option(
        "--like",
        "posed photographs whose camera, box and angles to take over; poses are independent"
        " (docs/scanning.md)",
        type=Path,
        metavar="SEQUENCE",
    ),
    option(
        "--like-frames",
        "with --like: first frame and one past the last (all)",
        type=int,
        nargs=2,
        metavar=("START", "STOP"),
    ),
    option("--margin", "with --like: metres added around the box (0.2)", type=float),
    option("--angle-margin", "with --like: degrees added around the angles (10)", type=float),
    option("--camera", "calibration: OpenCV or ROS .yaml or .json, COLMAP cameras.txt", **FILE),
    option(
        "--projection",
        "a lens in place of a perspective camera; depth is then along the ray (docs/cameras.md)",
        choices=PROJECTIONS,
    ),
    option(
        "--fisheye-k",
        "distortion coefficients of a fisheye, as in OpenCV (0 0 0 0)",
        type=float,
        nargs=4,
        metavar=("K1", "K2", "K3", "K4"),
    ),
    option(
        "--stereo",
        "also render a second camera this far to the right, metres",
        type=float,
        metavar="BASELINE_M",
    ),
    option("--width", "image width, pixels (640, or that of --camera)", type=int),
    option("--height", "image height, pixels (480, or that of --camera)", type=int),
    option("--fov", "horizontal field of view, degrees (60; fisheye 180)", type=float),
    option("--backend", "renderer (auto)", choices=BACKENDS),
    option("--supersampling", "N x N samples per pixel, 1 - 4 (2)", type=int, metavar="N"),
    option(
        "--detail",
        "level of detail that colours are drawn with: by resolution, or the full mesh (auto)",
        choices=DETAILS,
    ),
    option(
        "--shade",
        "light for meshes without texture: a lamp at the camera, or ambient light baked into the"
        " mesh (none)",
        choices=SHADES,
    ),
    option(
        "--background",
        "colour where nothing is hit, 0 - 255 each (0 0 0)",
        type=int,
        nargs=3,
        metavar=("R", "G", "B"),
    ),
    option(
        "--effects",
        "YAML: light, motion blur, exposure, noise and more (docs/variation.md)",
        **FILE,
    ),
    option(
        "--clutter",
        "YAML: objects to place in the scene, your own or cartons (docs/variation.md)",
        **FILE,
    ),
    option("--workers", "number of rendering processes (1)", type=int, default=1),
    option("--sequence-frames", "frames per sequence (500)", type=int, metavar="N"),
    option("--archive", "write each sequence as one seq-XX.zip", action="store_true"),
    option("--packed", "write frames of PX x PX in one .npy too", type=int, metavar="PX"),
    option(
        "--print-config",
        "only print a configuration from which the workflow makes the same data set, on several"
        " machines if need be (docs/collecting.md)",
        action="store_true",
    ),
)
def collect(arguments: argparse.Namespace) -> None:
    """Plan camera paths through the free space of a mesh and render them as a 7-Scenes data set.

    After an interruption, the same command continues where it stopped.
    """
    options = options_among(arguments, KEYS)
    camera = None
    if arguments.like is not None:
        options, camera = _like_options(arguments, options)
    for name in ("like_frames", "margin", "angle_margin"):
        if arguments.like is None and getattr(arguments, name) is not None:
            raise InputError(f"--{name.replace('_', '-')}: goes with --like SEQUENCE")
    config = dataset_config(options, arguments.out)
    if camera is not None:
        pair = {"stereo_baseline_m": config.network_camera.stereo_baseline_m}
        config = config.model_copy(update={"network_camera": camera.model_copy(update=pair)})
    from synfeal.collection.run import CollectJob, configuration_text, with_backend
    from synfeal.collection.run import collect as run_collection

    job = CollectJob(with_backend(config), arguments.packed, arguments.out)
    if arguments.print_config:
        print(configuration_text(job), end="")
        return
    with options_named():
        run_collection(job, arguments.workers)
    print(f"{job.out}: {frames_text(job)}")
    print(coverage_text(read_json(job.out / "coverage.json")["train"]))


def frames_text(job: CollectJob) -> str:
    """Say how many frames a data set has, and on how many straight paths they lie, if any."""
    from synfeal.collection.run import SPLITS, n_paths
    from synfeal.dataset.pose_table import read_pose_table

    texts = []
    for split, name in zip(SPLITS, ("training", "test"), strict=True):
        count = job.counts[split]
        text = f"{count} {name} frames"
        if job.config.collection.mode == "path" and count:
            paths = n_paths(read_pose_table(job.out / f"{split}.csv"))
            text += f" on {paths} {'path' if paths == 1 else 'paths'}"
        texts.append(text)
    return " and ".join(texts)


def _like_options(
    arguments: argparse.Namespace, options: dict[str, Any]
) -> tuple[dict[str, Any], CameraConfig | None]:
    """Fill options that are not given from ``--like``, with its camera where that is to be used.

    Says what is taken.
    """
    from synfeal.planning.like import MIN_SEEN, MIN_VIEW_DISTANCE_M, like_trajectory, resized

    frames = arguments.like_frames
    if frames is not None and not 0 <= frames[0] < frames[1]:
        raise InputError(f"--like-frames: {frames[0]} to {frames[1]} holds no frame")
    like = like_trajectory(
        mesh=arguments.mesh,
        sequence=arguments.like,
        frames=None if frames is None else slice(*frames),
        margin_m=MARGIN_M if arguments.margin is None else arguments.margin,
        margin_deg=MARGIN_DEG if arguments.angle_margin is None else arguments.angle_margin,
    )
    taken = {
        "box": [like.box],
        "roll": like.roll_deg,
        "pitch": like.pitch_deg,
        "yaw": like.yaw_deg,
        "mode": "random",
        "min_view_distance": MIN_VIEW_DISTANCE_M,
        "min_seen": MIN_SEEN,
    }
    given = {name: value for name, value in options.items() if value is not None}
    chosen = {**options, **taken, **given}
    if not arguments.print_config:
        print(like_text(like, arguments.like))
    if given.keys() & {"camera", "fov", "projection"}:
        return chosen, None
    if like.camera is None:
        raise InputError(
            f"--like: {arguments.like}: nothing says what its camera is; give --camera FILE"
        )
    # The sides are those of the camera now, which has its own.
    return chosen, resized(like.camera, chosen.pop("width"), chosen.pop("height"))


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
    "describe a mesh in numbers, a picture and a 3D view",
    "synfeal inspect scan.glb",
    option("mesh", "GLB, glTF, OBJ or PLY file", type=Path, metavar="MESH"),
    option("--out", "directory to write to (<name of the mesh>-inspect)", type=Path),
    *MESH_OPTIONS,
)
def inspect(arguments: argparse.Namespace) -> None:
    """Show what a mesh is and where cameras can be in it, before anything is collected.

    Writes numbers, a picture and an offline 3D page, and prints the command to collect a data set.
    """
    from synfeal.inspection.run import inspect_mesh

    out = arguments.out or Path(f"{arguments.mesh.stem}-inspect")
    scene = scene_config(options_among(arguments, KEYS))
    with options_named():
        text = inspect_mesh(scene, out, arguments.unit_m is not None)
    print(f"{out}: inspect.html, inspect.png and inspect.json\n")
    print(text)


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
        "--frames",
        "first frame and one past the last (all)",
        type=int,
        nargs=2,
        metavar=("START", "STOP"),
    ),
    option("--stride", "fuse every N-th frame (2)", type=int, default=2, metavar="N"),
    option("--voxel", "edge of a voxel, metres (0.01)", type=float, default=0.01),
    option("--max-depth", "ignore depth beyond this, metres (4)", type=float, default=4.0),
    option(
        "--min-piece",
        "drop loose pieces smaller than this, square metres (0.02)",
        type=float,
        default=0.02,
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
)
def scan(arguments: argparse.Namespace) -> None:
    """Fuse posed RGB-D frames into one upright mesh, z up, in metres.

    Also writes a picture of it beside photographs from the same poses, and the motion between its
    world and that of the sequence.
    """
    if arguments.gravity and arguments.keep_axes:
        raise InputError("--keep-axes: contradicts --gravity; leave one of the two out")
    from synfeal.scanning.camera import CameraOptions
    from synfeal.scanning.run import ScanJob
    from synfeal.scanning.run import scan as make_scan

    start, stop = arguments.frames or (0, None)
    offset = arguments.depth_from_color
    job = ScanJob(
        sequence=arguments.sequence,
        out=arguments.out,
        cameras=CameraOptions(
            preset=arguments.preset,
            color_camera=arguments.color_camera,
            depth_camera=arguments.depth_camera,
            color_focal_px=arguments.color_focal,
            depth_focal_px=arguments.depth_focal,
            depth_from_color=None if offset is None else tuple(offset),
            depth_units_per_m=arguments.depth_scale,
        ),
        start=start,
        stop=stop,
        stride=arguments.stride,
        voxel_m=arguments.voxel,
        max_depth_m=arguments.max_depth,
        min_piece_m2=arguments.min_piece,
        poses_are=arguments.poses_are or "world_from_cam",
        gravity=tuple(arguments.gravity)
        if arguments.gravity
        else ("keep" if arguments.keep_axes else "find"),
        keep_calibration=arguments.keep_calibration,
    )
    made = make_scan(job)
    print(scan_text(job.out, made.record))


def scan_text(out: Path, record: Mapping[str, Any]) -> str:
    """Describe what was made of how many frames, and how near it comes to photographs."""
    color, photographs = record["camera"]["color"], record["photographs"]
    agreement, disagreement = record["depth_agreement"], record["color_disagreement"]
    depth = "not compared" if agreement is None else f"{agreement:.0%} agree"
    between = "photographs between the fused ones" if photographs["held_out"] else "photographs"
    return (
        f"{out}: {record['faces']:,} triangles from {record['frames']['fused']} frames\n"
        f"depth and poses: {depth}, best at a focal length of {record['depth_best_focal_px']:.0f}"
        f" px ({record['camera']['depth']['fx']:.0f} px used)\n"
        f"photographs: disagree by {disagreement['given']:.3f} as given, {disagreement['best']:.3f}"
        f" at the best; used {color['fx']:.1f} px, centre ({color['cx']:.1f}, {color['cy']:.1f})\n"
        f"renderings: {photographs['difference']:.1f} grey levels from {photographs['compared']}"
        f" {between}, {photographs['covered']:.1%} of their pixels covered;"
        f" see {out.with_suffix('.png')}"
    )
