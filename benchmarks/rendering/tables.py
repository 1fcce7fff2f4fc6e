"""The three tables: frames on disk, frames in memory, and error against time per frame."""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.rendering.clock import interleaved
from benchmarks.rendering.plain import PlainPyrender
from synfeal.config.models import CameraConfig, RenderConfig
from synfeal.dataset.packed import new_packed
from synfeal.dataset.pose_table import PoseTable
from synfeal.dataset.render_sequence import write_sequence
from synfeal.mesh.model import TexturedMesh
from synfeal.render import choose, open_renderer
from synfeal.render.base import Renderer
from synfeal.render.reference import reference_images

ROUNDS = 5
SIZES = ((128, 96), (320, 240), (640, 480))
SUPERSAMPLING = (1, 2, 3)
PACKED_PX = 128


def on_disk(mesh: TexturedMesh, poses: PoseTable, camera: CameraConfig) -> Iterator[str]:
    """Colour and pose files: a plain loop around pyrender, and what `auto` takes here."""
    plain = PlainPyrender(mesh, camera)
    with contextlib.ExitStack() as stack:
        root = Path(stack.enter_context(tempfile.TemporaryDirectory()))

        renderer = stack.enter_context(open_renderer(mesh, camera))
        ways: dict[str, Callable[[int], object]] = {
            "plain pyrender loop": lambda _: plain.write(poses.world_from_cam, fresh(root) / "seq"),
            "synfeal": lambda _: write_sequence(renderer, poses, fresh(root) / "seq-01", False),
        }
        yield from speed_rows(f"{camera.width}x{camera.height} on disk", ways, len(poses))


def in_memory(mesh: TexturedMesh, poses: PoseTable) -> Iterator[str]:
    """Square frames as networks take them, into one array."""
    camera = CameraConfig(width=PACKED_PX, height=PACKED_PX)
    with contextlib.ExitStack() as stack:
        root = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        packed = stack.enter_context(new_packed(root / "frames.npy", len(poses), PACKED_PX))

        def fill(name: str) -> Callable[[int], None]:
            renderer = stack.enter_context(open_renderer(mesh, camera, RenderConfig(backend=name)))

            def once(_: int) -> None:
                for index, pose in enumerate(poses.world_from_cam):
                    packed[index] = renderer.render(pose)

            return once

        ways: dict[str, Callable[[int], object]] = {name: fill(name) for name in working()}
        yield from speed_rows(f"{PACKED_PX}x{PACKED_PX} packed", ways, len(poses))


def speed_rows(
    title: str, ways: dict[str, Callable[[int], object]], n_frames: int
) -> Iterator[str]:
    """A table of frames per second; the first way is what the others are compared with."""
    yield f"| {title} | frames/s | times the first | processor ms/frame |"
    yield "|---|---|---|---|"
    taken = interleaved(ways, range(ROUNDS))
    first = next(iter(taken.values()))
    for name, (wall_s, cpu_s) in taken.items():
        yield (
            f"| {name} | {n_frames / wall_s:.1f} | {first.wall_s / wall_s:.2f}"
            f" | {cpu_s / n_frames * 1e3:.1f} |"
        )


def quality(mesh: TexturedMesh, poses: PoseTable) -> Iterator[str]:
    """Time per frame, and mean error and PSNR against 64 samples per pixel."""
    yield "| size | backend | ms/frame | processor ms/frame | mean error | PSNR, dB |"
    yield "|---|---|---|---|---|---|"
    for width, height in SIZES:
        camera = CameraConfig(width=width, height=height)
        references = list(reference_images(sampled(mesh, 1), camera, poses.world_from_cam))
        with contextlib.ExitStack() as stack:
            renderers: dict[str, Renderer | PlainPyrender] = {
                name: stack.enter_context(opened(camera)) for name, opened in settings(mesh).items()
            }
            renderers["plain pyrender"] = PlainPyrender(mesh, camera)
            ways: dict[str, Callable[[int], object]] = {
                name: lambda number, renderer=renderer: renderer.render(  # type: ignore[misc]
                    poses.world_from_cam[number]
                )
                for name, renderer in renderers.items()
            }
            taken = interleaved(ways, range(len(poses)))
            for name, renderer in renderers.items():
                images = [renderer.render(pose) for pose in poses.world_from_cam]
                mean, psnr = error_of(images, references)
                wall_ms, cpu_ms = (1e3 * value for value in taken[name])
                yield (
                    f"| {width}x{height} | {name} | {wall_ms:.1f} | {cpu_ms:.1f} | {mean:.3f}"
                    f" | {psnr:.1f} |"
                )


def settings(mesh: TexturedMesh) -> dict[str, Callable[[CameraConfig], Renderer]]:
    """What is compared: every backend, and ours with several numbers of samples."""
    found = {f"opengl, {k}x{k} samples": sampled(mesh, k) for k in SUPERSAMPLING}
    for name in working()[1:]:
        found[name] = lambda camera, name=name: open_renderer(  # type: ignore[misc]
            mesh, camera, RenderConfig(backend=name)
        )
    return found


def sampled(mesh: TexturedMesh, supersampling: int) -> Callable[[CameraConfig], Renderer]:
    """How to open the OpenGL backend with a number of samples along each axis."""
    render = RenderConfig(backend="opengl", supersampling=supersampling)
    return lambda camera: open_renderer(mesh, camera, render)


def error_of(
    images: list[NDArray[np.uint8]], references: list[NDArray[np.float32]]
) -> tuple[float, float]:
    """Mean absolute difference in levels of 0 to 255, and peak signal-to-noise ratio in dB."""
    difference = np.stack([a - b for a, b in zip(images, references, strict=True)])
    return (
        float(np.abs(difference).mean()),
        float(10.0 * np.log10(255.0**2 / np.mean(difference**2, dtype=np.float64))),
    )


def working() -> list[str]:
    """Names of the backends that work here, fastest first."""
    return [name for name in choose.BACKENDS if choose.why_not(name) is None]


def fresh(root: Path) -> Path:
    """A new empty directory."""
    return Path(tempfile.mkdtemp(dir=root))
