"""``report.html``: what a run has found, in one file that loads nothing."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from markupsafe import Markup
from numpy.typing import NDArray
from PIL import Image

from reproduction.claims.tables import CLAIMS, EFFECTS, ClaimTables, has_claims, read_claims
from reproduction.claims.verdicts import Verdict
from reproduction.config.tables import KEYS
from reproduction.design.experiments import Design, Experiment
from reproduction.design.side_tables import SIDE_TABLES
from reproduction.figures.registry import CAPTIONS
from reproduction.report.claim_lines import TOLD_CLAIMS, claim_lines
from reproduction.report.findings import can_tell, findings
from reproduction.report.findings_figure import panels, picture
from reproduction.report.forest import forest_picture, read_forest
from reproduction.report.html.provenance import cost_sentence, origin_html, read_origin
from reproduction.report.html.tables import (
    claims_table,
    render,
    score_table,
    side_html,
    table_title,
    verdict_table,
)
from reproduction.report.paper_cells import paper_cells
from reproduction.report.paper_figure import paper_picture
from reproduction.report.summary import run_sentences
from reproduction.runs.published import REAL
from reproduction.tables import meshes, real
from reproduction.tables.cells import key_of, published_cells, read_cells
from reproduction.tables.layouts import BLOCKS, SOURCES, scene_title
from reproduction.tables.side import read_side_table
from synfeal.dataset.pose_table import PoseTable, read_pose_table
from synfeal.inspection.surface import SurfacePoints, viewer_js, viewer_mesh
from synfeal.mesh.load import load_mesh
from synfeal.records.files import write_text
from synfeal.records.provenance import generator_of

LARGEST_SVG = 1_000_000  # bytes; clouds of points are smaller as a picture
LARGEST_PNG = 250_000
LARGEST_SIDE_PX = 1800


def figure_files(folder: Path, captions: Mapping[str, str]) -> dict[str, Path]:
    """Find one file per figure of a folder, those with captions first and in their order."""
    found: dict[str, Path] = {}
    for path in sorted(folder.glob("*.png")) + sorted(folder.glob("*.svg")):
        is_large = path.suffix == ".svg" and path.stat().st_size > LARGEST_SVG
        if not (is_large and path.stem in found):
            found[path.stem] = path
    order = [*(name for name in captions if name in found), *sorted(found)]
    return {name: found[name] for name in dict.fromkeys(order)}


def data_address(path: Path) -> str:
    """Encode a picture as a ``data:`` address; large PNG files become WebP."""
    content, kind = path.read_bytes(), "svg+xml" if path.suffix == ".svg" else "png"
    if kind == "png" and len(content) > LARGEST_PNG:
        with Image.open(path) as image:
            picture = image.convert("RGB")
        picture.thumbnail((LARGEST_SIDE_PX, LARGEST_SIDE_PX))
        buffer = io.BytesIO()
        picture.save(buffer, "WEBP", quality=85, method=4)
        content, kind = buffer.getvalue(), "webp"
    return f"data:image/{kind};base64,{base64.b64encode(content).decode('ascii')}"


PROVENANCE = "provenance.json"
HARD_CASES = (
    "Functions that all of this rests on are tested where textbook formulas lose precision:"
    " tests/hard_cases."
)
REAL_CAPTIONS = {
    "real_amount": "Photographs that were not scanned: errors of PoseNet2 against the number of"
    " rendered frames, and against the number of photographs that were scanned.",
    "real_cover": "The same errors against the share of a photograph that the scan covers.",
}


def write_report(
    design: Design, root: Path, out_html: Path, side_tables: Sequence[str] = tuple(SIDE_TABLES)
) -> None:
    """Write the page, one file that opens without a network.

    Without claims, provenance or figures, their sections say so. Side tables that the run has no
    rows for are left out, and named under what is not here.

    Args:
        design: What was run.
        root: Results of the profile.
        out_html: File to write.
        side_tables: Side tables that the run has rows for.
    """
    rowless = [name for name in SIDE_TABLES if name not in side_tables]
    cells = {table: read_cells(table, design, root) for table in design.tables}
    claims = read_claims(root) if has_claims(root) else None
    origin = read_origin(root / PROVENANCE) if (root / PROVENANCE).exists() else {}
    figures = figure_files(root / "figures", CAPTIONS)
    figures |= figure_files(root.with_name(REAL) / "figures", REAL_CAPTIONS)
    files = (CLAIMS, EFFECTS, PROVENANCE, *(f"tables/{name}.csv" for name in side_tables))
    page = render(
        "page.html",
        profile=root.name,
        opening=opening(root),
        found=found_in(root, claims),
        sentences=[
            *run_sentences(cells),
            *([cost_sentence(origin)] if origin else []),
            HARD_CASES,
        ],
        counts=verdict_table(claims) if claims else "",
        claims=claims_table(claims) if claims else "",
        tables=[*_tables(cells, side_tables, root), *_real_table(root.with_name(REAL))],
        figures=[
            {
                "name": name,
                "caption": (CAPTIONS | REAL_CAPTIONS).get(name, name),
                "address": data_address(path),
            }
            for name, path in figures.items()
        ],
        rooms=[room_html(s, root, design) for s in dict.fromkeys(r.scene for r in design.rows)],
        origin=origin_html(origin) if origin else "",
        skipped=[
            *(f"{name} is missing." for name in files if not (root / name).exists()),
            *(
                [f"Without rows in this run: {'; '.join(map(table_title, rowless))}."]
                * bool(rowless)
            ),
            *missing_rows(design.rows),
            *(untested(claims) if claims else []),
            *(
                f"Not drawn, for lack of its data in this profile: figure {name}."
                for name in CAPTIONS
                if name not in figures
            ),
        ],
        viewer_js=Markup(viewer_js()),
    )
    write_text(out_html, page)


def found_in(root: Path, claims: ClaimTables | None) -> list[dict[str, str]]:
    """List what the run found: of the paper's effects, then of methods and errors of our own."""
    lines = claim_lines(claims) if claims else []
    told = [
        {"headline": f"{line.outcome}.", "evidence": line.numbers, "table": "claims-table"}
        for line in lines
    ]
    for finding in findings(root) if can_tell(root) else []:
        evidence = f"{finding.evidence} Measured against {finding.against}."
        told.append(
            {"headline": finding.headline, "evidence": evidence, "table": finding.source.stem}
        )
    return told


def untested(claims: ClaimTables) -> list[str]:
    """Say which claims the run could not test, and why."""
    reasons = {
        claim: claims.reasons[claim, against]
        for (claim, against), verdict in claims.verdicts.items()
        if verdict == Verdict.NOT_TESTABLE
    }
    return [f"{claim} is not testable here: {reason}" for claim, reason in reasons.items()]


def opening(root: Path) -> list[dict[str, str]]:
    """Draw what a report opens with, as ``data:`` addresses: the paper beside ours, what was found.

    A picture whose rows the run lacks is left out.
    """
    cells = paper_cells(root)
    pictures = {}
    if len(cells):
        pictures["Every cell of Tables 2 to 5, printed against ours"] = paper_picture(cells)
    forest = read_forest(root).of_claims(TOLD_CLAIMS) if has_claims(root) else None
    if forest and forest.changes:
        pictures["Effects that the paper's claims are about: print and ours"] = forest_picture(
            forest
        )
    drawn = panels(root) if can_tell(root) else []
    if drawn:
        title = "Feature matching against regression, and errors of labels by their shape"
        pictures[title] = picture(drawn)
    return [
        {"title": title, "address": f"data:image/png;base64,{base64.b64encode(png).decode()}"}
        for title, png in pictures.items()
    ]


def _tables(
    cells: Mapping[str, pd.DataFrame], side_tables: Sequence[str], root: Path
) -> Iterator[dict[str, Any]]:
    """Yield name, title and HTML of every table; no HTML where its file is missing."""
    for name in side_tables:
        path = root / "tables" / f"{name}.csv"
        body = path.exists() and side_html(read_side_table(name, path)[1])
        yield {"name": name, "title": table_title(name), "body": body}
        for design_table, scores in cells.items() if name == meshes.NAME else ():
            body = score_table(design_table, scores)
            yield {"name": design_table, "title": table_title(design_table), "body": body}


def _real_table(root: Path) -> Iterator[dict[str, Any]]:
    """Yield the table of `make real`, where that was run."""
    path = root / "tables" / f"{real.NAME}.csv"
    if path.exists():
        body = side_html(real.side_layout(real.read_real(path)))
        yield {"name": real.NAME, "title": table_title(real.NAME), "body": body}


def missing_rows(rows: Sequence[Experiment]) -> list[str]:
    """List by table the paper's rows that this run's table of experiments leaves out."""
    sentences = []
    for table in KEYS:
        own = {key_of(row, "")[:-1] for row in rows if row.table == table}
        printed = dict.fromkeys(key[:-1] for key in published_cells(table))
        absent = [_row_name(table, key) for key in printed if key not in own]
        if absent and len(absent) == len(printed):
            sentences.append(
                f"{table_title(table)}: none of the paper's {len(printed)} rows is in this"
                " profile's table of experiments."
            )
        elif absent:
            sentences.append(
                f"{table_title(table)}: {len(absent)} of the paper's {len(printed)} rows are not in"
                f" this profile's table of experiments: {'; '.join(absent)}."
            )
    return sentences


def _row_name(table: str, key: tuple[Any, ...]) -> str:
    block, scene, size, labels, noise_m, noise_deg, _ = key
    if block:
        return f"{BLOCKS[block]} {noise_m:g} m, {noise_deg:g}°"
    which = f", {SOURCES[labels]}" if table.startswith("table2") else f" {size}"
    return f"{scene_title(scene)}{which}"


SPLITS = {"train": ("Cameras, training", (0, 114, 178)), "test": ("Cameras, test", (213, 94, 0))}
# Okabe and Ito's colours that are left, for label sets that were estimated.
LABEL_RGB = ((204, 121, 167), (0, 158, 115), (230, 159, 0), (86, 180, 233), (0, 0, 0))
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trajectory:
    """Camera paths that are shown or hidden together."""

    title: str  # what stands beside the box to tick
    rgb: tuple[int, int, int]  # colour, 0 to 255
    paths_m: tuple[Array, ...]  # one polyline (N, 3) per path, world, metres
    is_shown: bool  # from the start


def room_html(scene: str, root: Path, design: Design) -> Markup:
    """Build the view of one scene, ready for ``report.js``.

    Args:
        scene: Name of the scene.
        root: Results of the profile.
        design: Its table of experiments, which tells the scene's label sets.
    """
    mesh = load_mesh(root / "scenes" / scene / "mesh.glb")
    small = viewer_mesh(mesh, SurfacePoints.of(mesh, generator_of(0, "report", scene)))
    drawn = trajectories(scene, root, design)
    data = small.scene([(path, one.rgb) for one in drawn for path in one.paths_m])
    return render("room.html", scene=scene, title=scene_title(scene), drawn=drawn, data=data)


def trajectories(scene: str, root: Path, design: Design) -> list[Trajectory]:
    """List the planned cameras of both splits, then every estimated label set of the scene.

    Args:
        scene: Name of the scene.
        root: Results of the profile.
        design: Its table of experiments, which tells the scene's label sets.

    Returns:
        Trajectories, of which only planned ones are shown from the start.
    """
    found = [
        Trajectory(title, rgb, paths_of(read_pose_table(path)), True)
        for split, (title, rgb) in SPLITS.items()
        if (path := root / "plans" / scene / f"{split}.csv").exists()
    ]
    sets = [(size, labels) for where, size, labels in design.estimated if where == scene]
    for (size, labels), rgb in zip(sets, LABEL_RGB * len(sets), strict=False):
        folder = root / "labels" / scene / size / labels
        tables = [read_pose_table(folder / f"{split}.csv") for split in SPLITS]
        paths = tuple(path for table in tables for path in paths_of(table))
        found.append(Trajectory(f"{SOURCES[labels]} labels, {size}", rgb, paths, False))
    return found


def paths_of(table: PoseTable) -> tuple[Array, ...]:
    """Return camera centres (N, 3) of each path that has more than one frame."""
    starts = np.flatnonzero(np.diff(table.path)) + 1
    return tuple(path for path in np.split(table.position_m, starts) if len(path) > 1)
