"""Python interface to the commands of this package, which ``synfeal`` has under the same names."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from baselines.config.learning import ModelName
from synfeal.camera.photograph import PhotographCamera
from synfeal.config.photometric import PhotometricConfig
from synfeal.errors import Argument, InputError

if TYPE_CHECKING:
    from baselines.references.localized import LocalizedInMap
    from baselines.references.mapped import StructureMap
    from baselines.training.localize import Localized
    from baselines.training.train import TrainedModel
    from synfeal.geometry.axes import PosesAre


AnyPath = str | Path
World = Literal["sequence", "mesh"]
Device = Literal["auto", "cpu", "cuda"]
MOST_SEED = 2**63 - 1


def train(
    datasets: AnyPath | Sequence[AnyPath],
    out: AnyPath,
    *,
    localizer: ModelName = "posenet2",
    images: int | None = None,
    minutes: float | None = None,
    range: Sequence[tuple[int, int]] = (),  # noqa: A002 (the word of the command)
    held_out: float = 0.1,
    randomisation: AnyPath | PhotometricConfig = "on",
    camera: AnyPath | None = None,
    focal_px: float | None = None,
    exif: bool = True,
    input_px: int | None = None,
    width: float | None = None,
    batch: int = 64,
    start: AnyPath | None = None,
    device: Device = "auto",
    seed: int = 0,
) -> TrainedModel:
    """Train a localizer on data sets; after an interruption, the same call continues.

    Args:
        datasets: Data sets of ``collect``, or sequences of photographs with poses; one or several.
        out: Directory of the model.
        localizer: Localizer to train.
        images: Images to train on, repeats included; None for 30,000, or for ``minutes``.
        minutes: Train for about this long instead.
        range: Ranges of photographs to take, each from its first to before its last; none: all.
        held_out: Share of the paths that is held out to measure the error.
        randomisation: ``on``: vary light, lens and sensor each time an image is shown; ``off``; or
            ranges, themselves or as a YAML file.
        camera: Calibration of the photographs.
        focal_px: Focal length of the photographs in their pixels, in place of a calibration.
        exif: Read the focal length from EXIF if neither is given.
        input_px: Side of the network's image; None for 64 on a processor, 224 on a GPU.
        width: Factor on the network's channels; None for 0.25 on a processor, 1 on a GPU.
        batch: Images per step.
        start: Weights that the backbone starts from; None for those of the package at width 0.25.
        device: Where to train.
        seed: Seed of all random numbers.

    Raises:
        InputError: A data set or a setting cannot be used, or ``out`` holds something else.
    """
    from baselines.training.own_frames import FrameRange
    from baselines.training.train import DEFAULT_IMAGES, TrainJob
    from baselines.training.train import train as learn

    if images is not None and minutes is not None:
        raise InputError(
            Argument("minutes"), "`images` say how long already", "give one of the two"
        )
    _check_seed(seed)
    default = None if minutes is not None else DEFAULT_IMAGES
    job = TrainJob(
        datasets=_paths(datasets),
        out=Path(out),
        localizer=localizer,
        images=default if images is None else images,
        minutes=minutes,
        ranges=tuple(FrameRange(first, end) for first, end in range),
        photographs=_photographs(camera, focal_px, exif),
        held_out=held_out,
        randomisation=_randomisation(randomisation),
        input_px=input_px,
        width=width,
        batch=batch,
        start=None if start is None else Path(start),
        device=device,
        seed=seed,
    )
    return learn(job)


def map(  # noqa: A001 (the name of the command)
    dataset: AnyPath,
    out: AnyPath,
    *,
    range: tuple[int, int] | None = None,  # noqa: A002 (the word of the command)
    stride: int = 1,
    most: int = 1000,
    preset: str | None = None,
    color_camera: AnyPath | None = None,
    depth_camera: AnyPath | None = None,
    color_focal_px: float | None = None,
    depth_focal_px: float | None = None,
    depth_from_color: tuple[float, float, float, float, float, float] | None = None,
    depth_scale: float | None = None,
    convention: PosesAre = "world_from_cam",
    seed: int = 0,
) -> StructureMap:
    """Build a map of image features, placed in space by depth, from renderings or photographs.

    Features of photographs without depth are triangulated.

    Args:
        dataset: Data set with depth, posed photographs, or a capture in any format of
            :mod:`synfeal.captures`, such as a COLMAP model with its photographs.
        out: Folder to write.
        range: First frame and one past the last; None for all.
        stride: Take every such frame.
        most: Largest number of frames; of more, so many are taken, spread evenly.
        preset: Known calibrations of colour and depth, such as ``7scenes``.
        color_camera: Calibration of the photographs.
        depth_camera: Calibration of the depth images; None for that of colour.
        color_focal_px: Focal length in place of a file.
        depth_focal_px: The same for depth.
        depth_from_color: Transform from the colour to the depth camera: rotation vector, degrees,
            and translation, metres.
        depth_scale: Stored value of a depth of 1 m.
        convention: Direction of the poses, or ``opengl`` for ``world_from_cam`` of cameras that
            look along -z, y up.
        seed: Seed of the vocabulary that retrieval learns.

    Raises:
        InputError: The frames or a setting cannot be used, or ``out`` exists.
    """
    from baselines.references.captured import as_sequence
    from baselines.references.map_frames import FrameChoice, read_map_frames
    from baselines.references.mapped import build_map
    from baselines.references.stated_errors import write_trial
    from synfeal.api import rgbd_cameras

    _check_seed(seed)
    start, stop = range or (0, None)
    choice = FrameChoice(start, stop, every=stride, most=most)
    cameras = rgbd_cameras(
        preset,
        color_camera,
        depth_camera,
        color_focal_px,
        depth_focal_px,
        depth_from_color,
        depth_scale,
    )
    with as_sequence(Path(dataset)) as sequence:
        frames = read_map_frames(
            folder=sequence.folder, choice=choice, cameras=cameras, poses_are=convention
        )
        named = sequence.named(frames)
        made = build_map(named, Path(out), seed)
        write_trial(made, named, Path(out), seed)
        return made


def build(
    source: AnyPath,
    out: AnyPath,
    *,
    format: str | None = None,  # noqa: A002 (the word of the command)
    frames: int = 1000,
    width: int = 320,
    train: bool = False,
    cores: int = 1,
    seed: int = 0,
) -> dict[str, Any]:
    """Build a place from a capture or a mesh; after an interruption, the same call continues.

    Args:
        source: Folder or file of a capture in any format of :mod:`synfeal.captures`, or a textured
            mesh, of which nothing is scanned.
        out: Folder of the place.
        format: Format of the capture; None finds out.
        frames: Frames that are rendered of the scan for the map.
        width: Their width, pixels.
        train: Train a localizer on them, too.
        cores: Rendering processes.
        seed: Seed of all random numbers.

    Returns:
        What was chosen and measured, as ``place.json`` holds it.

    Raises:
        InputError: The source or a setting cannot be used, or ``out`` holds something else.
    """
    from baselines.places.build import PlaceJob
    from baselines.places.build import build as make

    for name, value in (("frames", frames), ("cores", cores)):
        if value < 1:
            raise InputError(Argument(name), f"must be at least 1, found {value}")
    if not 64 <= width <= 4096:
        raise InputError(Argument("width"), f"must be 64 to 4096 pixels, found {width}")
    _check_seed(seed)
    job = PlaceJob(
        source=Path(source),
        out=Path(out),
        format=format,
        frames=frames,
        width=width,
        train=train,
        cores=cores,
        seed=seed,
    )
    return make(job)


def localize(
    model: AnyPath,
    images: AnyPath | Sequence[AnyPath],
    *,
    out: AnyPath = "poses.csv",
    camera: AnyPath | None = None,
    focal_px: float | None = None,
    exif: bool = True,
    world: World = "sequence",
    turns: int | None = None,
    confidence: float | None = None,
    refine: AnyPath | None = None,
    device: Device | None = None,
) -> Localized | LocalizedInMap:
    """Estimate where pictures were taken, with a model or a map of that place.

    Args:
        model: Folder of ``build`` or of ``map``, or ``model.pt`` of ``train`` or of the benchmark.
        images: PNG, JPEG or HEIC of any size, or directories of them.
        out: CSV file to write.
        camera: Calibration of the photographs.
        focal_px: Focal length of the photographs in their pixels, in place of a calibration.
        exif: Read the focal length from EXIF if neither is given.
        world: World that poses are written in, where the place was scanned from a sequence.
        turns: With a model: pairs of virtual rotations that a pose is averaged over; None for 8.
        confidence: With a map: least confidence of a pose; None for 0.99.
        refine: With a map: mesh that it shows, to refine poses on.
        device: With a model: where to run; None for ``auto``.

    Raises:
        InputError: The model or a picture cannot be used, or ``out`` cannot be written.
    """
    place = Path(model)
    photographs = _photographs(camera, focal_px, exif)
    if place.is_dir():
        reason = "is for models, and a map is a folder"
        _refuse(place, reason, turns=turns, device=device)
        from baselines.places.place import open_map
        from baselines.references.confidence import LEAST_CONFIDENCE
        from baselines.references.localized import localize_in_map

        place, photographs = open_map(place, photographs)
        return localize_in_map(
            place,
            _paths(images),
            Path(out),
            camera=photographs,
            world=world,
            least_confidence=LEAST_CONFIDENCE if confidence is None else confidence,
            refine=None if refine is None else Path(refine),
        )
    _refuse(place, "is for maps, which are folders", confidence=confidence, refine=refine)
    from baselines.training.localize import DEFAULT_TURNS
    from baselines.training.localize import localize as estimate

    return estimate(
        place,
        _paths(images),
        Path(out),
        device or "auto",
        camera=photographs,
        world=world,
        turns=DEFAULT_TURNS if turns is None else turns,
    )


def serve(
    place: AnyPath,
    *,
    camera: AnyPath | None = None,
    focal_px: float | None = None,
    exif: bool = True,
    world: World = "sequence",
    confidence: float | None = None,
    refine: AnyPath | None = None,
    host: str = "127.0.0.1",
    port: int = 8000,
    cores: int = 1,
    queue: int = 16,
    megabytes: int = 32,
    megapixels: int = 64,
) -> None:
    """Answer over HTTP where photographs were taken, until Ctrl-C or SIGTERM.

    Args:
        place: Folder of ``build`` or of ``map``.
        camera: Calibration of photographs that come without one.
        focal_px: Focal length of such photographs in their pixels, in place of a calibration.
        exif: Read the focal length from EXIF if neither is given.
        world: World that poses are given in, where the place was scanned from a sequence.
        confidence: Least confidence of a pose; None for 0.99.
        refine: Mesh that the map shows, to refine poses on.
        host: Address to listen on; ``0.0.0.0`` is every one of this machine.
        port: Port to listen on; 0 for one that is free.
        cores: Photographs that are localized at once.
        queue: Photographs that may wait; who sends another is told to come again.
        megabytes: Largest request.
        megapixels: Largest photograph.

    Raises:
        InputError: The place or a setting cannot be used, the address cannot be listened on, or the
            extra ``serve`` is not installed.
    """
    from baselines.references.confidence import LEAST_CONFIDENCE
    from baselines.serving.job import ServeJob
    from baselines.serving.run import serve as run

    folder = Path(place)
    if folder.is_file():
        raise InputError(
            folder, "is a file, and places and maps are folders", "give one of build or map"
        )
    job = ServeJob(
        place=folder,
        camera=_photographs(camera, focal_px, exif),
        world=world,
        least_confidence=LEAST_CONFIDENCE if confidence is None else confidence,
        refine=None if refine is None else Path(refine),
        host=host,
        port=port,
        cores=cores,
        queue=queue,
        megabytes=megabytes,
        megapixels=megapixels,
    )
    run(job)


def _paths(some: AnyPath | Sequence[AnyPath]) -> list[Path]:
    return [Path(each) for each in ([some] if isinstance(some, str | Path) else some)]


def _photographs(camera: AnyPath | None, focal_px: float | None, exif: bool) -> PhotographCamera:
    return PhotographCamera.read(None if camera is None else Path(camera), focal_px, exif)


def _check_seed(seed: int) -> None:
    if not 0 <= seed <= MOST_SEED:
        raise InputError(Argument("seed"), f"must be 0 to 2^63 - 1, found {seed}")


def _refuse(model: Path, reason: str, **settings: object) -> None:
    """Refuse settings that would have no effect."""
    for name, value in settings.items():
        if value is not None:
            raise InputError(Argument(name), f"{reason}, such as {model}", "leave it out")


def _randomisation(ranges: AnyPath | PhotometricConfig) -> PhotometricConfig | None:
    """Read the ranges that a setting stands for.

    Raises:
        InputError: The file cannot be read, or holds other keys or values.
    """
    if isinstance(ranges, PhotometricConfig):
        return ranges
    if ranges in ("on", "off"):
        return PhotometricConfig() if ranges == "on" else None
    from pydantic import ValidationError

    from synfeal.config.load import describe, read_yaml

    path = Path(ranges)
    try:
        return PhotometricConfig.model_validate(read_yaml(path))
    except ValidationError as error:
        raise InputError(path, describe(error)) from error
