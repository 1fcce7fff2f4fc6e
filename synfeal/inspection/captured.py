"""``synfeal inspect`` of a capture: what it holds, what is missing, photographs and path drawn."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from synfeal.camera.calibration import Calibration
from synfeal.captures.capture import Capture, CapturedFrame
from synfeal.captures.formats import capture_formats, read_capture
from synfeal.captures.views import has_lens
from synfeal.records.files import atomic_path, refuse_foreign, write_json

Array = NDArray[np.float64]

OUTPUTS = ("capture-inspect.json", "capture-frames.png", "capture-path.png")
SHOWN = 4  # photographs in the picture, with their depth
N_SAMPLED = 12  # depth images that the range is taken from
FARTHEST_SHOWN_M = 6.0
LONG_GAP = 5.0  # times the usual interval
DPI = 100
# Pixels at which photographs are drawn: their shape is what counts.
TILE_PX = 480


def inspect_capture(path: Path, out: Path, format: str | None = None) -> dict[str, Any]:  # noqa: A002
    """Write what a capture is: numbers, some photographs with their depth, the path from above.

    Args:
        path: Folder or file of the capture.
        out: Folder to write into; earlier files of these names are replaced.
        format: Of the capture; None finds out.

    Returns:
        The numbers, as in ``capture-inspect.json``.

    Raises:
        InputError: It is no capture, cannot be read, or ``out`` holds other files.
    """
    capture = read_capture(path, format)
    refuse_foreign(out, OUTPUTS, "an inspection")
    facts = capture_facts(capture)
    out.mkdir(parents=True, exist_ok=True)
    for name, figure in (
        (OUTPUTS[1], frames_figure(capture)),
        (OUTPUTS[2], path_figure(capture)),
    ):
        with atomic_path(out / name) as temporary:
            figure.savefig(temporary, format="png", dpi=DPI)
    write_json(out / OUTPUTS[0], facts)
    return facts


def capture_facts(capture: Capture) -> dict[str, Any]:
    """Count and measure what a capture holds; a sample of its depth is decoded."""
    frames = capture.frames
    with_depth = [frame for frame in frames if frame.read_depth_m is not None]
    position_m = capture.world_from_cam[:, :3, 3]
    steps_m = np.linalg.norm(np.diff(position_m, axis=0), axis=1)
    return {
        "capture": str(capture.path),
        "format": capture.format,
        "title": capture_formats()[capture.format].title,
        "frames": len(capture),
        "frames_with_depth": len(with_depth),
        "clock": clock_facts([frame.time_s for frame in frames]),
        "color": camera_facts([frame.camera for frame in frames]),
        "depth": depth_facts(with_depth),
        "extent_m": np.ptp(position_m, axis=0).round(3).tolist(),
        "path_m": round(float(steps_m.sum()), 3),
        "largest_step_m": round(float(steps_m.max()), 3) if len(steps_m) else 0.0,
        "up": None if capture.up is None else list(capture.up),
        "missing": missing_of(capture),
    }


def clock_facts(times_s: Sequence[float | None]) -> dict[str, float] | None:
    """Return span, usual interval and longest gap of a clock; None where frames have no times."""
    known = [time_s for time_s in times_s if time_s is not None]
    if len(known) < len(times_s) or len(known) < 2:
        return None
    intervals = np.diff(np.array(known, np.float64))
    return {
        "from_s": known[0],
        "span_s": round(known[-1] - known[0], 6),
        "interval_s": round(float(np.median(intervals)), 6),
        "longest_gap_s": round(float(intervals.max()), 6),
    }


def camera_facts(cameras: Sequence[Calibration]) -> dict[str, Any]:
    """Return sizes, range of focal lengths and kind of lens of cameras."""
    focal_px = [camera.fx for camera in cameras]
    sizes = sorted({(camera.width, camera.height) for camera in cameras})
    return {
        "sizes": [list(size) for size in sizes],
        "focal_px": [round(min(focal_px), 2), round(max(focal_px), 2)],
        "has_lens": any(has_lens(camera) for camera in cameras),
    }


def depth_facts(frames: Sequence[CapturedFrame]) -> dict[str, Any] | None:
    """Return cameras of depth images and, of a sample of them, range and share measured."""
    if not frames:
        return None
    some = np.unique(np.linspace(0, len(frames) - 1, N_SAMPLED).astype(np.int64))
    depth_m = np.concatenate([_depth_of(frames[index]).ravel() for index in some])
    measured = depth_m[depth_m > 0]
    percentiles = np.percentile(measured, [2, 50, 98]) if len(measured) else [0.0] * 3
    cameras = [frame.depth_camera for frame in frames if frame.depth_camera is not None]
    return {
        **camera_facts(cameras),
        "measured": round(len(measured) / len(depth_m), 4),
        "range_m": [round(float(value), 3) for value in percentiles],
    }


def _depth_of(frame: CapturedFrame) -> NDArray[np.float32]:
    assert frame.read_depth_m is not None
    return frame.read_depth_m()


def missing_of(capture: Capture) -> list[str]:
    """Say what a capture lacks, and what was left out when it was read."""
    said = list(capture.notes)
    with_depth = sum(frame.read_depth_m is not None for frame in capture.frames)
    if not with_depth:
        said.append("no depth: nothing can be scanned of it")
    elif with_depth < len(capture):
        said.append(f"{len(capture) - with_depth} frames have no depth")
    if capture.up is None:
        said.append("nothing says which way is up: scan finds it from level and plumb surfaces")
    clock = clock_facts([frame.time_s for frame in capture.frames])
    if clock is None:
        said.append("its frames have no times")
    elif clock["longest_gap_s"] > LONG_GAP * max(clock["interval_s"], 1e-3):
        said.append(
            f"a gap of {clock['longest_gap_s']:.1f} s between frames that are usually"
            f" {clock['interval_s']:.2f} s apart"
        )
    return said


def frames_figure(capture: Capture) -> Figure:
    """Draw some photographs with their depth below."""
    chosen = np.unique(np.linspace(0, len(capture) - 1, SHOWN).astype(np.int64))
    figure = Figure(figsize=(4.0 * len(chosen), 6.4), layout="constrained")
    axes = figure.subplots(2, len(chosen), squeeze=False)
    for column, index in enumerate(chosen):
        frame = capture.frames[index]
        step = max(1, max(frame.camera.width, frame.camera.height) // TILE_PX)
        upper, lower = axes[0, column], axes[1, column]
        upper.imshow(frame.read_color()[::step, ::step])
        upper.set_title(Path(frame.name).name, fontsize=9)
        if frame.read_depth_m is None:
            lower.text(0.5, 0.5, "no depth", ha="center", va="center")
        else:
            depth_m = frame.read_depth_m()
            shown = lower.imshow(
                np.where(depth_m > 0, depth_m, np.nan), vmin=0.0, vmax=FARTHEST_SHOWN_M
            )
            if column == len(chosen) - 1:
                figure.colorbar(shown, ax=axes[1], label="depth, m", shrink=0.9, extend="max")
        for each in (upper, lower):
            each.set_axis_off()
    return figure


def path_figure(capture: Capture) -> Figure:
    """Draw the path of the camera from above and from the side, with the way it looked.

    Colours run from the first frame, dark, to the last, bright.
    """
    right, forward, up = _axes_of(capture)
    position_m = capture.world_from_cam[:, :3, 3]
    looks = capture.world_from_cam[:, :3, 2]
    figure = Figure(figsize=(12.0, 6.0), layout="constrained")
    views = (("from above", right, forward), ("from the side", right, up))
    for axes, (title, across, along) in zip(figure.subplots(1, 2), views, strict=True):
        x, y = position_m @ across, position_m @ along
        axes.plot(x, y, color="0.6", linewidth=1.0)
        axes.quiver(
            x, y, looks @ across, looks @ along, np.arange(len(x)), width=0.003, cmap="viridis"
        )
        axes.plot(x[0], y[0], "o", color="black", markersize=5)
        axes.set(title=title, xlabel="m", ylabel="m")
        axes.set_aspect("equal", adjustable="datalim")
        axes.grid(alpha=0.3)
    return figure


def _axes_of(capture: Capture) -> tuple[Array, Array, Array]:
    """Return three directions of the capture's world: two level, the longer way first, and up.

    Where nothing says which way is up, z stands in.
    """
    up = np.array((0.0, 0.0, 1.0) if capture.up is None else capture.up, np.float64)
    up /= np.linalg.norm(up)
    position_m = capture.world_from_cam[:, :3, 3]
    level_m = position_m - position_m.mean(axis=0)
    level_m = level_m - np.outer(level_m @ up, up)
    _, extent, vt = np.linalg.svd(level_m, full_matrices=True)
    right = vt[0] if extent[0] > 1e-9 else np.linalg.svd(up[None])[2][1]
    right = right - (right @ up) * up
    right /= np.linalg.norm(right)
    return np.asarray(right), np.asarray(np.cross(up, right)), up


def capture_text(facts: dict[str, Any]) -> str:
    """Return the numbers as lines for a person."""
    color, depth, clock = facts["color"], facts["depth"], facts["clock"]
    lines = [f"{facts['frames']} frames of {facts['title']}", f"photographs  {_camera_text(color)}"]
    if depth is None:
        lines.append("depth        none")
    else:
        near, middle, far = depth["range_m"]
        lines += [
            f"depth        {_camera_text(depth)}, {facts['frames_with_depth']} frames",
            f"             {near:.2f} to {far:.2f} m, half within {middle:.2f} m;"
            f" {depth['measured']:.0%} of the pixels measured",
        ]
    if clock is not None:
        lines.append(
            f"clock        {clock['span_s']:.1f} s, a frame every {clock['interval_s']:.3g} s"
        )
    size = " x ".join(f"{side:.2f}" for side in facts["extent_m"])
    lines.append(f"cameras      in {size} m, a path of {facts['path_m']:.1f} m")
    lines += [f"note         {said}" for said in facts["missing"]]
    return "\n".join(lines)


def _camera_text(camera: dict[str, Any]) -> str:
    sizes = ", ".join(f"{width} x {height}" for width, height in camera["sizes"])
    low, high = camera["focal_px"]
    focal = f"{low:.0f}" if high - low < 0.5 else f"{low:.0f} to {high:.0f}"
    lens = ", with a lens to undo" if camera["has_lens"] else ""
    return f"{sizes} pixels, focal length {focal}{lens}"
