"""The summary of a run: one page of Markdown, and a few lines for the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from synfeal.config import Design
from synfeal.files import atomic_path
from synfeal.report.alive import check_scenes, sentences
from synfeal.report.cells import Cell, read_cells
from synfeal.report.crossing import crossing_findings
from synfeal.report.layouts import grid_of
from synfeal.report.markdown import markdown_of
from synfeal.report.meshes import meshes_grid, read_mesh_facts
from synfeal.report.recall import NAME as RECALL
from synfeal.report.recall import read_recall_table, recall_grid
from synfeal.report.references import NAME as REFERENCES
from synfeal.report.references import read_references, references_grid

INTRO = """\
# Results of profile `{profile}`

Every cell is a median error over the test frames. Lines *paper* are the values the paper printed,
on its own meshes and at its own scale. Errors are against the labels the test set carries (the
paper's protocol) and against the true poses of the simulator. The same numbers with limits and
frame counts are in `tables/*.csv`, and as LaTeX in `tables/*.tex`.
"""


def write_summary(design: Design, root: Path, out_md: Path) -> str:
    """Write the summary of a profile's results.

    Args:
        design: of the profile.
        root: results directory of the profile.
        out_md: the page: checks, then every table beside the paper's.

    Returns:
        A short text for the terminal at the end of a run.

    Raises:
        InputError: a result file is missing or unreadable.
    """
    cells = {name: read_cells(name, design, root) for name in design.tables}
    findings = [runs_sentence(cells), *alive_sentences(cells)]
    meshes = {
        scene: read_mesh_facts(root, scene) for scene in dict.fromkeys(r.scene for r in design.rows)
    }
    references = root / "tables" / f"{REFERENCES}.csv"
    grids = [meshes_grid(meshes), *(grid_of(name, found) for name, found in cells.items())]
    if references.exists():
        table = read_references(references)
        findings += crossing_findings(table)
        grids.append(references_grid(table))
    recalls = root / "tables" / f"{RECALL}.csv"
    if recalls.exists():
        grids.append(recall_grid(design, read_recall_table(recalls)))
    parts = [
        INTRO.format(profile=root.name),
        "## Do the localizers localize?\n",
        "".join(f"- {finding}\n" for finding in findings),
        "## Tables\n",
        *map(markdown_of, grids),
    ]
    with atomic_path(out_md) as temporary:
        temporary.write_text("\n".join(parts), encoding="utf-8")
    return terminal_text(root, out_md, findings)


def runs_sentence(cells: Mapping[str, Sequence[Cell]]) -> str:
    """How many cells have a score, and which have none."""
    every = [(name, cell) for name, found in cells.items() for cell in found]
    failed = [
        f"{name} {cell.row.scene} {cell.row.size} {cell.row.label_id} {cell.model}"
        for name, cell in every
        if not cell.own.n_finished
    ]
    which = f"; without one: {', '.join(failed)}" if failed else ""
    return f"{len(every) - len(failed)} of {len(every)} table cells have a score{which}."


def alive_sentences(cells: Mapping[str, Sequence[Cell]]) -> list[str]:
    """The findings of Table 4, scene by scene; none when the profile has no such table."""
    checks = check_scenes(cells.get("table4_size", ()))
    return [sentence for check in checks for sentence in sentences(check)]


def terminal_text(root: Path, summary: Path, findings: Sequence[str]) -> str:
    """What a person sees when the run ends: findings, and where the tables are."""
    places = {
        "Report": root / "report.html",
        "Tables": root / "tables",
        "Figures": root / "figures",
        "Summary": summary,
    }
    lines = [f"{name + ':':<8} {path}" for name, path in places.items()]
    lines[0] += "   (one page with everything; open it in a browser)"
    return "\n".join([*(f"- {finding}" for finding in findings), *lines]) + "\n"
