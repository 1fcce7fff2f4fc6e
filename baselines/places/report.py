"""One page that shows a place: the scan beside photographs, coverage, what to expect."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from numpy.typing import NDArray
from PIL import Image

from baselines.places.check import CLOSE_M
from baselines.places.place import Place
from synfeal.dataset.images import read_image
from synfeal.evaluation.coverage import WIDE_LEVEL
from synfeal.evaluation.metrics import POSITION
from synfeal.geometry.poses import inverse
from synfeal.records.files import atomic_path, read_json

# Widest picture of the page, pixels, and its quality as JPEG: the page is one file to send.
WIDEST_PX, QUALITY = 1600, 85
PLAN_PX, EDGE_PX = 640.0, 14.0
# Side of the plot of stated errors, and the share at which its axes begin.
STATED_PX, LEAST_SHARE = 300.0, 0.4
# Edge of that plot on the sides of its labels, and the shares that are labelled.
LABELS_PX, TICKS = 60.0, (0.5, 0.7, 0.9)
SCALE_STEPS_M = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)


class Dot(NamedTuple):
    """A picture on the plan: where it was taken, in pixels, and how far off the map puts it."""

    x_px: float
    y_px: float
    kind: str
    error_m: float | None


class CoverageLine(NamedTuple):
    """A line of the plot of stated errors.

    Attributes:
        kind: Classes of the line: ``trial`` or ``check``, and ``position`` or ``orientation``.
        points: Corners of the line in pixels, as SVG writes them.
    """

    kind: str
    points: str


class Plan(NamedTuple):
    """The pictures of the check seen from above.

    Attributes:
        height_px: Of the plan, which is ``PLAN_PX`` wide.
        dots: The pictures.
        scale_m: Length of the bar.
        scale_px: The same in pixels.
    """

    height_px: float
    dots: tuple[Dot, ...]
    scale_m: float
    scale_px: float


def write_report(place: Place, record: dict[str, Any]) -> None:
    """Write ``report.html`` of a place that is finished; it needs no other file.

    Args:
        place: Its folder.
        record: Content of ``place.json``.
    """
    scan = read_json(place.scan.with_suffix(".json")) if place.scan.is_file() else None
    shown = place.rendered / "preview.png" if scan is None else place.scan.with_suffix(".png")
    world_from_check = np.eye(4) if scan is None else inverse(np.array(scan["sequence_from_world"]))
    pages = Environment(
        loader=PackageLoader("baselines.places", "."), autoescape=True, undefined=StrictUndefined
    )
    page = pages.get_template("report.html.j2").render(
        name=place.folder.resolve().name,
        record=record,
        check=record["check"],
        scan=scan,
        picture=picture_data(shown),
        plan=plan_of(record["check"]["places"], world_from_check),
        plan_px=PLAN_PX,
        lines=coverage_lines(record),
        # How much of the position's error the 95 % radius holds, and how wide it is.
        of_frames=_at_95(record["trial"]["stated"]),
        of_halves=_at_95(record["check"].get("halves", {})),
        of_pictures=_at_95(record["check"]["stated"]),
        stated_px=STATED_PX,
        ends_px=(_along_px(LEAST_SHARE), _along_px(1.0)),
        ticks=[(share, _along_px(share)) for share in TICKS],
        close_cm=100 * CLOSE_M,
        folder=place.folder,
    )
    with atomic_path(place.report) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _at_95(stated: Mapping[str, list[dict[str, float]]]) -> dict[str, float] | None:
    """Select what the position's radius of 95 % came to; None where nothing is known of it."""
    levels = stated.get(POSITION, [])
    return next((level for level in levels if level["level"] == WIDE_LEVEL), None)


def coverage_lines(record: dict[str, Any]) -> tuple[CoverageLine, ...]:
    """Draw the share of errors within stated radii against the share that these are said to hold.

    Of photographs, as one half of them widens the radii of the other; where they are too few for
    that, by the radii of frames of the map alone.

    Args:
        record: Content of ``place.json``.
    """
    lines = []
    of_pictures = record["check"].get("halves") or record["check"]["stated"]
    for of, found in (("trial", record["trial"]["stated"]), ("check", of_pictures)):
        for name, levels in found.items():
            corners = [(_along_px(one["level"]), _along_px(one["held"])) for one in levels]
            points = " ".join(f"{x:.1f},{STATED_PX - y:.1f}" for x, y in corners)
            lines.append(CoverageLine(f"{of} {name.partition('_')[0]}", points))
    return tuple(lines)


def _along_px(share: float) -> float:
    """Place a share on an axis of the plot of stated errors."""
    along = (max(share, LEAST_SHARE) - LEAST_SHARE) / (1.0 - LEAST_SHARE)
    return LABELS_PX + (STATED_PX - LABELS_PX - EDGE_PX) * along


def picture_data(path: Path) -> str:
    """Return a picture as JPEG in base64, no wider than the page needs."""
    image = Image.fromarray(np.asarray(read_image(path))).convert("RGB")
    if image.width > WIDEST_PX:
        height = round(image.height * WIDEST_PX / image.width)
        image = image.resize((WIDEST_PX, height), Image.Resampling.LANCZOS)
    stream = io.BytesIO()
    image.save(stream, "JPEG", quality=QUALITY)
    return base64.b64encode(stream.getvalue()).decode("ascii")


def plan_of(places: list[dict[str, Any]], world_from_check: NDArray[np.float64]) -> Plan:
    """Draw where pictures were taken, seen from above.

    Args:
        places: Known position of each picture and its error, None where it was not localized.
        world_from_check: Rigid motion (4, 4) to the world whose z is up.
    """
    known = np.array([place["position_m"] for place in places], np.float64)
    seen = known @ world_from_check[:2, :3].T + world_from_check[:2, 3]
    if np.ptp(seen[:, 0]) < np.ptp(seen[:, 1]):  # the longer side lies across the page
        seen = seen[:, ::-1] * [1.0, -1.0]
    low, extent = seen.min(axis=0), np.maximum(np.ptp(seen, axis=0), 0.1)
    px_per_m = (PLAN_PX - 2 * EDGE_PX) / extent[0]
    dots = []
    for (x_m, y_m), place in zip(seen - low, places, strict=True):
        error_m = place["error_m"]
        kind = "lost" if error_m is None else "close" if error_m <= CLOSE_M else "far"
        top_px = EDGE_PX + (extent[1] - y_m) * px_per_m
        dots.append(Dot(EDGE_PX + x_m * px_per_m, float(top_px), kind, error_m))
    scale_m = max((m for m in SCALE_STEPS_M if m <= extent[0] / 2), default=SCALE_STEPS_M[0])
    return Plan(
        height_px=float(extent[1] * px_per_m + 2 * EDGE_PX + 30.0),
        dots=tuple(dots),
        scale_m=scale_m,
        scale_px=float(scale_m * px_per_m),
    )
