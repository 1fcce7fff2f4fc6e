"""``report.html``: what a run has found, in one file that loads nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template

from synfeal.config import Design, Experiment
from synfeal.files import atomic_path
from synfeal.inspect.viewer_mesh import viewer_js
from synfeal.report import meshes
from synfeal.report.cells import Cell, read_cells
from synfeal.report.figures import CAPTIONS
from synfeal.report.hard_cases.table import NAME as HARD_CASES
from synfeal.report.html.claims import Claims, claims_table, read_claims, verdict_counts
from synfeal.report.html.figures import figure_files, figure_html
from synfeal.report.html.hard_cases import hard_cases_table
from synfeal.report.html.labels import label_error_table
from synfeal.report.html.markup import bullets
from synfeal.report.html.origin import Record, cost_sentence, origin_html, read_origin
from synfeal.report.html.recall import recall_table
from synfeal.report.html.references import references_table
from synfeal.report.html.rooms import room_html
from synfeal.report.html.side_tables import assistance_table, meshes_table, speed_table
from synfeal.report.html.skipped import missing_figures, missing_rows, untested_claims
from synfeal.report.html.tables import score_table
from synfeal.report.label_error import NAME as LABEL_ERROR
from synfeal.report.recall import NAME as RECALL
from synfeal.report.references import NAME as REFERENCES
from synfeal.report.summary import alive_sentences, runs_sentence

CLAIMS, PROVENANCE = "claims.csv", "provenance.json"
SIDE_TABLES = (
    *(meshes.NAME, REFERENCES, RECALL, "assistance", LABEL_ERROR, "speed_vs_error", HARD_CASES),
)


@dataclass(frozen=True)
class Section:
    """One section of the page.

    Attributes:
        name: identifier, for links.
        title: its heading.
        body: HTML.
        parts: identifiers and titles of what the table of contents lists below it.
    """

    name: str
    title: str
    body: str
    parts: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Results:
    """What a run has left behind, as the sections need it.

    Attributes:
        root: results directory of the profile.
        rows: the whole design of the profile.
        cells: by table, the cells of tables 2 to 5.
        claims: rows of ``claims.csv``; empty without that file.
        origin: ``provenance.json``; empty without that file.
        figures: file of each figure, in reading order.
    """

    root: Path
    rows: Sequence[Experiment]
    cells: Mapping[str, Sequence[Cell]]
    claims: Claims
    origin: Record
    figures: Mapping[str, Path]

    @classmethod
    def read(cls, design: Design, root: Path) -> Results:
        """Read everything but meshes and trajectories.

        Raises:
            InputError: a run's scores are missing, or a file cannot be read.
        """
        cells = {table: read_cells(table, design, root) for table in design.tables}
        claims, origin = root / CLAIMS, root / PROVENANCE
        return cls(
            root,
            design.rows,
            cells,
            read_claims(claims) if claims.exists() else [],
            read_origin(origin) if origin.exists() else {},
            figure_files(root / "figures", CAPTIONS),
        )


def write_report(design: Design, root: Path, out_html: Path) -> None:
    """Write the page.

    Args:
        design: of the profile.
        root: results directory of the profile. Without claims, provenance or figures, their
            sections say so.
        out_html: one file; it opens without a network.

    Raises:
        InputError: a run's scores, a mesh or a plan are missing, or a file cannot be read.
    """
    sections = list(sections_of(Results.read(design, root)))
    page = Template(_resource("report.html")).substitute(
        profile=escape(root.name),
        style=_resource("report.css"),
        contents="".join(map(_contents, sections)),
        sections="\n".join(
            f'<section id="{section.name}"><h2>{section.title}</h2>\n{section.body}</section>'
            for section in sections
        ),
        script=f"{viewer_js()}\n{_resource('report.js')}",
    )
    with atomic_path(out_html) as temporary:
        temporary.write_text(page, encoding="utf-8")


def sections_of(found: Results) -> Iterator[Section]:
    """The sections in reading order."""
    yield Section("summary", "Summary", _summary(found))
    yield Section("claims", "The paper’s claims", _claims(found))
    yield _tables(found)
    yield Section("figures", "Figures", _figures(found))
    yield Section("scenes", "Scenes and camera paths", _scenes(found))
    yield Section("provenance", "Provenance and cost", _provenance(found))
    yield Section("skipped", "What is not here", _skipped(found))


def _summary(found: Results) -> str:
    sentences = [runs_sentence(found.cells), *alive_sentences(found.cells)]
    if found.origin:
        sentences.append(cost_sentence(found.origin))
    return bullets(sentences) + (verdict_counts(found.claims) if found.claims else "")


def _claims(found: Results) -> str:
    return claims_table(found.claims) if found.claims else _absent(CLAIMS)


def _tables(found: Results) -> Section:
    bodies = {meshes.NAME: ("Table 1", _side_table(found, meshes.NAME, meshes_table))}
    for name, cells in found.cells.items():
        bodies[name] = (name.split("_")[0].replace("table", "Table "), score_table(name, cells))
    bodies[REFERENCES] = ("References", _side_table(found, REFERENCES, references_table))
    bodies[RECALL] = ("Recall", _side_table(found, RECALL, recall_table))
    bodies["assistance"] = ("Assistance", _side_table(found, "assistance", assistance_table))
    bodies[LABEL_ERROR] = ("Label errors", _side_table(found, LABEL_ERROR, label_error_table))
    speed = _side_table(found, "speed_vs_error", speed_table)
    bodies["speed_vs_error"] = ("Speed against error", speed)
    bodies[HARD_CASES] = ("Hard cases", _side_table(found, HARD_CASES, hard_cases_table))
    parts = {name: title for name, (title, _) in bodies.items()}
    return Section("tables", "Tables", "\n".join(body for _, body in bodies.values()), parts)


def _side_table(found: Results, name: str, table: Callable[[Path], str]) -> str:
    path = found.root / "tables" / f"{name}.csv"
    return table(path) if path.exists() else _absent(f"tables/{path.name}")


def _figures(found: Results) -> str:
    pictures = [figure_html(name, path, CAPTIONS) for name, path in found.figures.items()]
    return "\n".join(pictures) or _absent("figures")


def _scenes(found: Results) -> str:
    scenes = dict.fromkeys(row.scene for row in found.rows)
    return "\n".join(room_html(scene, found.root, found.rows) for scene in scenes)


def _provenance(found: Results) -> str:
    return origin_html(found.origin) if found.origin else _absent(PROVENANCE)


def _skipped(found: Results) -> str:
    files = (CLAIMS, PROVENANCE, *(f"tables/{name}.csv" for name in SIDE_TABLES))
    sentences = [
        *(f"{name} is missing." for name in files if not (found.root / name).exists()),
        *missing_rows(found.rows),
        *untested_claims(found.claims),
        *missing_figures(CAPTIONS, found.figures),
    ]
    return bullets(sentences) if sentences else "<p>Nothing was left out.</p>"


def _contents(section: Section) -> str:
    parts = "".join(f'<li><a href="#{n}">{title}</a></li>' for n, title in section.parts.items())
    inner = f"<ul>{parts}</ul>" if parts else ""
    return f'<li><a href="#{section.name}">{section.title}</a>{inner}</li>'


def _absent(name: str) -> str:
    return f'<p class="absent">{escape(name)} is missing from this run.</p>'


def _resource(name: str) -> str:
    return files("synfeal.report.html").joinpath(name).read_text(encoding="utf-8")
