"""The generated parts of pages: every number there comes from a tracked result file.

A part stands between ``<!-- NAME PROFILE -->`` and ``<!-- /NAME -->`` and shows the published
results of that profile; ``headline`` is the largest profile that is published.
``python -m reproduction.report.pages`` writes all parts anew, and the figure of the read-me; with
``--check`` it says whether that would change anything.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import pandas as pd

from reproduction.claims.tables import ClaimTables, read_claims
from reproduction.claims.verdicts import published_claims
from reproduction.real.findings import real_findings, real_headline, real_short, real_table
from reproduction.report.claim_changes import changes_since_single_runs
from reproduction.report.claim_findings import claim_findings
from reproduction.report.claim_lines import (
    TOLD_CLAIMS,
    as_markdown,
    claim_lines,
    claims_beside_print,
    networks_beside_print,
)
from reproduction.report.findings import Finding, can_tell, findings, sentences, short_sentences
from reproduction.report.findings_figure import is_drawn_from, panels, write_findings_figure
from reproduction.report.forest import read_forest, write_forest
from reproduction.report.paper_cells import TABLES, best_known_cells
from reproduction.report.paper_figure import cells_digest, paper_picture
from reproduction.report.paper_tables import (
    cells_beside_print,
    label_quality,
    making,
    meshes_beside_print,
    pooled_beside_print,
)
from reproduction.report.published import headline, read_table
from reproduction.report.stamped import shows, write_stamped
from reproduction.runs.published import PUBLISHED, REAL, REPLICATIONS
from reproduction.runs.results import read_result
from reproduction.tables.layouts import SOURCES, scene_title
from reproduction.tables.sheet import markdown_table
from synfeal.errors import InputError, exit_status
from synfeal.records.files import write_text
from synfeal.records.tables import COUNT, NUMBER, TEXT, read_frame, records_of

PAGES = (
    Path("README.md"),
    *map(Path, ("docs/results.md", "docs/scenes.md")),
    *(Path(f"docs/paper/table{number}.md") for number in range(1, 6)),
)
# Shows a run that needs photographs which are not ours to pass on: nothing until one is published.
REAL_PAGE = Path("docs/real.md")
# Scores of what others published, which `make publish` does not make anew.
OTHERS_POSES = Path("results/benchmarks/published_poses.csv")
DIFFICULTY = Path("results/benchmarks/scene_difficulty")
FIGURE = Path("docs/images/findings.png")
PAPER_FIGURE = Path("docs/images/paper_against_ours.png")
# Every claim, and those of the lines that the read-me opens with.
FOREST_FIGURE, EFFECTS_FIGURE = Path("docs/images/claims.png"), Path("docs/images/effects.png")
PAPER_FRAMES = 6000  # of the smallest set of each room
LIMITS_NOTE = (
    "Brackets hold 95 % limits. Findings 1 to 3 are of one run, `night`, with limits over its test"
    " paths and training runs; the others are of the replications, with limits over them."
)
SIFT = dict.fromkeys(
    ("covered_share_mean", "covered_share_q10", "covered_share_q90", "keypoints_mean"), NUMBER
)


def answer(root: Path, top: str) -> str:
    """Say what was found, most important first, and how far its limits reach.

    Args:
        root: Published results of one run; claims are told by the folder beside it.
        top: Path from the page to the top of the repository, ending in a slash.
    """
    return f"{_numbered(sentences(_found(root), top))}\n\n{LIMITS_NOTE}"


def found(root: Path) -> str:
    """List what was found, a sentence each."""
    return _numbered(short_sentences(_found(root)))


def _found(root: Path) -> list[Finding]:
    of_run = findings(root) if can_tell(root) else []
    return [*of_run, *claim_findings(root.with_name(REPLICATIONS))]


def _numbered(texts: Sequence[str]) -> str:
    return "\n".join(f"{n}. {text}" for n, text in enumerate(texts, start=1))


def origin(root: Path) -> str:
    """Name the run that the numbers are of."""
    record = read_result(root / "provenance.json", ("commit", "machine", "stages"), "publish again")
    cells = read_table(root, "table4_size")
    share = PAPER_FRAMES / cells.n_train.min()
    frames = "the paper's frames" if share == 1 else f"1/{share:.3g} of the paper's frames"
    span = training_runs(cells)
    runs = f"{span} training run{'' if span == '1' else 's'} per cell"
    return (
        f"Profile `{root.name}`: {frames}, {runs}, at commit"
        f" `{record['commit'][:9]}` on {record['machine']['usable_cores']} cores"
        f" ({record['machine']['processor']})."
    )


def training_runs(cells: pd.DataFrame) -> str:
    """Say how many training runs the cells of a table have, as in `3` or `1 to 3`."""
    fewest, most = int(cells.n_seeds.min()), int(cells.n_seeds.max())
    return str(fewest) if fewest == most else f"{fewest} to {most}"


def difficulty(folder: Path = DIFFICULTY) -> str:
    """Say how hard the scenes are for localization, a line for each that was measured."""
    names = sorted(path.name.removesuffix("-sift.csv") for path in folder.glob("*-sift.csv"))
    return markdown_table(pd.DataFrame([_difficulty(folder, name) for name in names]))


def lines(root: Path) -> str:
    """Tell what was reproduced, by the effects of the claims."""
    return as_markdown(claim_lines(_claims_beside(root)))


def verdicts(root: Path) -> str:
    """Tell each claim in a line, and what is unclear about it in print."""
    notes = [f"- {claim.id}: {claim.footnote}" for claim in published_claims() if claim.footnote]
    return "\n".join([claims_beside_print(_claims_beside(root)), "", *notes])


def _claims_beside(root: Path) -> ClaimTables:
    return read_claims(root.with_name(REPLICATIONS))


def pooled(root: Path, name: str) -> str:
    """Tell a table by the pooled replications, which lie beside the run."""
    return pooled_beside_print(root.with_name(REPLICATIONS), name)


PAPERS = {name.partition("_")[0]: name for name in TABLES}  # `table2` to `table5`
PARTS: dict[str, Callable[[Path], str]] = {
    "found": found,
    "reproduced": lines,
    "answer": partial(answer, top="../"),
    "origin": origin,
    # Of all published runs together, whatever profile the mark names.
    "verdicts": verdicts,
    "networks": lambda root: networks_beside_print(_claims_beside(root).effects),
    "changed": lambda root: changes_since_single_runs(root.parent),
    "label_quality": lambda root: label_quality(root.with_name(REPLICATIONS)),
    "meshes": meshes_beside_print,
    **{part: partial(cells_beside_print, name=name) for part, name in PAPERS.items()},
    **{
        part.replace("table", "pooled"): partial(pooled, name=name) for part, name in PAPERS.items()
    },
    **{part.replace("table", "cost"): partial(making, name=name) for part, name in PAPERS.items()},
    "difficulty": lambda root: difficulty(),
    "real": real_findings,
    "real_headline": lambda root: real_headline(root, OTHERS_POSES),
    "real_short": lambda root: real_short(root, OTHERS_POSES),
    "photographs": real_table,
}


def rewritten(text: str, part: Callable[[str, str], str]) -> str:
    """Replace the generated parts of a page by ``part``, called with name and profile.

    Raises:
        InputError: A part has no end.
    """
    start = r"<!-- (\w+) (\w+) -->"

    def fresh(found: re.Match[str]) -> str:
        name, profile = found.groups()
        return f"<!-- {name} {profile} -->\n\n{part(name, profile)}\n\n<!-- /{name} -->"

    page, n_parts = re.subn(rf"{start}.*?<!-- /\1 -->", fresh, text, flags=re.DOTALL)
    if n_parts != len(re.findall(start, text)):
        raise InputError("a generated part of a page has no end; close it with <!-- /NAME -->")
    return page


def part_of(name: str, profile: str) -> str:
    """Generate a part of a page.

    Raises:
        InputError: There is no such part.
    """
    if name not in PARTS:
        raise InputError(f"<!-- {name} {profile} -->: no such part; known: {', '.join(PARTS)}")
    return PARTS[name](headline() if profile == "headline" else PUBLISHED / profile)


def _difficulty(folder: Path, name: str) -> dict[str, str]:
    sift = read_frame(folder / f"{name}-sift.csv", SIFT).iloc[0]
    far = read_frame(folder / f"{name}-repetition.csv", {"far_share": NUMBER}).far_share[0]
    share, low, high = (f"{100 * sift[column]:.0f} %" for column in list(SIFT)[:3])
    counts = {"method": TEXT, "assisted": COUNT, "batches": COUNT}
    methods = [
        f"{SOURCES[row['method']]} {row['assisted']} of {row['batches']}"
        for row in records_of(read_frame(folder / f"{name}-assistance.csv", counts))
    ]
    return {
        "scene": scene_title(name),
        "pixels near a keypoint": f"{share} (10 % of the frames below {low}, 10 % above {high})",
        "keypoints": f"{sift.keypoints_mean:.0f}",
        "best match far away": f"{100 * far:.1f} % of the frames",
        "assisted batches": ", ".join(methods),
    }


def stale(check: bool) -> list[Path]:
    """List pages, and the figure, that are out of date; rewrite them unless checking."""
    writers: dict[Path, Callable[[], None]] = {}
    for page in (*PAGES, *([REAL_PAGE] if (PUBLISHED / REAL).is_dir() else [])):
        old = page.read_text(encoding="utf-8")
        new = rewritten(old, part_of)
        if new != old:
            writers[page] = partial(write_text, page, new)
    shown = headline()
    drawn = panels(shown) if can_tell(shown) else []
    if drawn and not is_drawn_from(FIGURE, drawn):
        writers[FIGURE] = partial(write_findings_figure, drawn, FIGURE)
    folder = PUBLISHED / REPLICATIONS
    forest = read_forest(folder)
    pictures = {FOREST_FIGURE: forest, EFFECTS_FIGURE: forest.of_claims(TOLD_CLAIMS)}
    for picture, rows in pictures.items():
        if not shows(picture, rows.digest):
            writers[picture] = partial(write_forest, rows, picture)
    cells = best_known_cells(shown, folder)
    if len(cells) and not shows(PAPER_FIGURE, cells_digest(cells)):
        content = paper_picture(cells)
        writers[PAPER_FIGURE] = partial(write_stamped, content, PAPER_FIGURE)
    for write in () if check else writers.values():
        write()
    return list(writers)


def main(argv: Sequence[str] | None = None) -> int:
    """Write the generated parts of the pages, or check them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="exit 1 if anything would change")
    check = parser.parse_args(argv).check
    changed: list[Path] = []
    status = exit_status(lambda: changed.extend(stale(check)), "run it again")
    for path in changed:
        print(f"{path}: {'run python -m reproduction.report.pages' if check else 'written anew'}")
    return status or int(check and bool(changed))


if __name__ == "__main__":
    sys.exit(main())
