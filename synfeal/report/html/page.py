"""``report.html``: what a run has found, in one file that loads nothing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import pandas as pd
from markupsafe import Markup

from synfeal.config import Design
from synfeal.files import atomic_path
from synfeal.inspect.viewer_mesh import viewer_js
from synfeal.report import meshes
from synfeal.report.cells import read_cells
from synfeal.report.figures import CAPTIONS
from synfeal.report.html.claims import claims_table, read_claims, verdict_counts
from synfeal.report.html.figures import data_address, figure_files
from synfeal.report.html.origin import cost_sentence, origin_html, read_origin
from synfeal.report.html.render import render
from synfeal.report.html.rooms import room_html
from synfeal.report.html.side_tables import SIDE_TABLES, meshes_table
from synfeal.report.html.skipped import missing_figures, missing_rows, untested_claims
from synfeal.report.html.tables import score_table, table_title
from synfeal.report.summary import run_sentences

CLAIMS, PROVENANCE = "claims.csv", "provenance.json"


def write_report(design: Design, root: Path, out_html: Path) -> None:
    """Write the page, one file that opens without a network.

    Without claims, provenance or figures, their sections say so.
    """
    cells = {table: read_cells(table, design, root) for table in design.tables}
    claims = read_claims(root / CLAIMS) if (root / CLAIMS).exists() else []
    origin = read_origin(root / PROVENANCE) if (root / PROVENANCE).exists() else {}
    figures = figure_files(root / "figures", CAPTIONS)
    tables = list(_tables(cells, root))
    files = (CLAIMS, PROVENANCE, *(f"tables/{name}.csv" for name in (meshes.NAME, *SIDE_TABLES)))
    page = render(
        "page.html",
        profile=root.name,
        sentences=[*run_sentences(cells), *([cost_sentence(origin)] if origin else [])],
        counts=verdict_counts(claims) if claims else "",
        claims=claims_table(claims) if claims else "",
        tables=tables,
        figures=[
            {"name": name, "caption": CAPTIONS.get(name, name), "address": data_address(path)}
            for name, path in figures.items()
        ],
        rooms=[
            room_html(scene, root, design.rows)
            for scene in dict.fromkeys(row.scene for row in design.rows)
        ],
        origin=origin_html(origin) if origin else "",
        skipped=[
            *(f"{name} is missing." for name in files if not (root / name).exists()),
            *missing_rows(design.rows),
            *untested_claims(claims),
            *missing_figures(CAPTIONS, figures),
        ],
        viewer_js=Markup(viewer_js()),
    )
    with atomic_path(out_html) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _tables(cells: Mapping[str, pd.DataFrame], root: Path) -> Iterator[dict[str, str]]:
    """Name, title and HTML of every table; no HTML where its file is missing."""
    scored = {name: (table_title(name), score_table(name, found)) for name, found in cells.items()}
    for name, (title, table) in {meshes.NAME: ("Table 1", meshes_table), **SIDE_TABLES}.items():
        path = root / "tables" / f"{name}.csv"
        yield {"name": name, "title": title, "body": table(path) if path.exists() else ""}
        if name == meshes.NAME:
            for score_name, (score_title, body) in scored.items():
                yield {"name": score_name, "title": score_title, "body": body}
