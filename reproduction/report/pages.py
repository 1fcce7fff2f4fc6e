"""The generated parts of pages: every number there comes from a tracked result file.

A part stands between ``<!-- NAME PROFILE -->`` and ``<!-- /NAME -->`` and shows the published
results of that profile; ``headline`` is the largest profile that is published.
``python -m reproduction.report.pages`` writes all parts anew, and the figure of the read-me; with
``--check`` it says whether that would change anything.
"""

from __future__ import annotations

import argparse
import math
import re
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pandas as pd

from reproduction.claims.tables import has_claims, read_claims
from reproduction.claims.verdicts import published_claims
from reproduction.real.findings import real_findings, real_headline, real_short, real_table
from reproduction.replications.pooling import REPLICATIONS
from reproduction.report.claim_lines import as_markdown, claim_lines
from reproduction.report.claims_table import claims_table
from reproduction.report.effects_figure import effects_digest, effects_picture
from reproduction.report.findings import (
    CONTROLS,
    MEASURES,
    can_tell,
    noise_changes,
    read_table,
    sentences,
    short_sentences,
    verdict_sentence,
)
from reproduction.report.findings_figure import is_drawn_from, panels, write_findings_figure
from reproduction.report.forest import read_forest, write_forest
from reproduction.report.fresh import fresh_claims
from reproduction.report.paper_cells import TABLES, paper_cells
from reproduction.report.paper_figure import cells_digest, paper_picture
from reproduction.report.paper_tables import (
    by_localizer,
    cells_beside_print,
    making,
    meshes_beside_print,
)
from reproduction.report.publish import PUBLISHED, RESULTS
from reproduction.report.published_claims import (
    claims_markdown,
    read_published,
    rows_now,
    rules_note,
)
from reproduction.report.realisations import PAPER_FRAMES, realisations_table
from reproduction.report.reproduced import effects, reproduced
from reproduction.report.run_anew import run_anew, training_runs
from reproduction.report.stamped import shows, write_stamped
from reproduction.runs.results import read_result
from reproduction.tables.assistance import SCHEMA as ASSISTANCE
from reproduction.tables.assistance import TOTAL
from reproduction.tables.label_error import SCHEMA as LABEL_ERROR
from reproduction.tables.layouts import SOURCES, scene_title
from reproduction.tables.sheet import markdown_table
from synfeal.errors import InputError, exit_status
from synfeal.records.files import write_text
from synfeal.records.tables import (
    COUNT,
    NUMBER,
    TEXT,
    read_frame,
    records_of,
    rows_of,
)

PAGES = (
    Path("README.md"),
    *map(Path, ("docs/results.md", "docs/runs.md", "docs/scenes.md")),
    *(Path(f"docs/paper/table{number}.md") for number in range(1, 6)),
)
# Shows a run that needs photographs which are not ours to pass on: nothing until one is published.
REAL_PAGE, REAL = Path("docs/real.md"), "real"
# Scores of what others published, which `make publish` does not make anew.
OTHERS_POSES = Path("results/benchmarks/published_poses.csv")
FIGURE = Path("docs/images/findings.png")
PAPER_FIGURE = Path("docs/images/paper_against_ours.png")
FOREST_FIGURE = Path("docs/images/claims.png")
EFFECTS_FIGURE = Path("docs/images/effects.png")
HEADLINES = ("night", "mini")
LIMITS_NOTE = (
    "Brackets hold 95 % limits over test paths and training runs. The changes with label errors by"
    " shape, with noise and with the size of the data set, and those of PoseNet2, have limits from"
    " errors compared frame by frame, most of them as claims are judged ([this run's"
    " claims](runs.md#claims-judged-by-the-first-run), [claims with fresh"
    " seeds](runs.md#claims-judged-with-fresh-seeds)). Limits of other changes are computed as if"
    " the two errors had been measured on different frames, which makes them wide."
)
NOISE_HEADINGS = {
    "published": "published",
    "labels": "against the labels",
    "yardstick": "the yardstick alone",
    "true": "against the true poses",
}
SIFT = dict.fromkeys(
    ("covered_share_mean", "covered_share_q10", "covered_share_q90", "keypoints_mean"), NUMBER
)


def headline() -> str:
    """Return the profile whose results the read-me shows."""
    return next((name for name in HEADLINES if (PUBLISHED / name).is_dir()), HEADLINES[-1])


def findings(root: Path, top: str) -> str:
    """Say what the run found, most important first, and how far its limits reach.

    Args:
        root: Published results.
        top: Path from the page to the top of the repository, ending in a slash.
    """
    if not can_tell(root):
        return verdict_sentence(root)
    found = sentences(root, f"{top}{root.as_posix()}")
    items = "\n".join(f"{n}. {text}" for n, text in enumerate(found, start=1))
    return f"{items}\n\n{LIMITS_NOTE}"


def found(root: Path) -> str:
    """List what the run found, a sentence each."""
    if not can_tell(root):
        return verdict_sentence(root)
    texts = short_sentences(root, root.as_posix())
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


def size_table(root: Path) -> str:
    """Format Table 4: errors against the true poses, published errors in brackets."""
    cells = read_table(root, "table4_size")
    frames = "(" + cells.n_train.astype(str) + ", " + cells.n_test.astype(str) + ")"
    labels = cells.scene.map(scene_title) + " " + cells["size"] + " " + frames
    return by_localizer(cells, "scene, size (frames here)", list(labels), _cell)


def labels_table(root: Path) -> str:
    """Format Table 2, the same way."""
    cells = read_table(root, "table2_ground_truth")
    sources = [SOURCES.get(name, name) for name in cells.labels]
    return by_localizer(cells, "labels from", sources, _cell)


def noise_table(root: Path) -> str:
    """Format Table 3 as changes from no noise, means over the localizers."""
    rows = rows_of(noise_changes(root))
    table = {"noise": [_noise_level(row) for row in rows]}
    for score, heading in NOISE_HEADINGS.items():
        position, orientation = (
            [_change(getattr(row, f"{score}_{measure}")) for row in rows] for measure in MEASURES
        )
        table[heading] = [f"p {m}, o {deg}" for m, deg in zip(position, orientation, strict=True)]
    return markdown_table(pd.DataFrame(table))


def assistance(root: Path) -> str:
    """Say which batches needed assistance, and how good the labels are."""
    errors = read_table(root, "label_error", LABEL_ERROR)
    errors = errors[errors.assistance == "after"]
    position, orientation = 100 * errors.position_m_median, errors.orientation_deg_median
    errors["text"] = position.map("{:.1f} cm, ".format) + orientation.map("{:.2f}°".format)
    rms_cm, rms_deg = 100 * errors.position_m_rmse, errors.orientation_deg_rmse
    errors["text"] += rms_cm.map("; {:.1f} cm, ".format) + rms_deg.map("{:.2f}°".format)
    errors["text"] += (100 * (1 - errors.share_filled)).map("; {:.0f} %".format)
    shown = errors.pivot(index=["scene", "method"], columns="split", values="text")
    counts = read_table(root, "assistance", ASSISTANCE)
    counts = counts[counts.split == TOTAL].join(shown, on=["scene", "method"])
    published = [
        ""
        if pd.isna(row.published_assisted)
        else f" *({row.published_assisted} of {row.published_batches})*"
        for row in rows_of(counts)
    ]
    return markdown_table(
        pd.DataFrame(
            {
                "scene": counts.scene.map(scene_title),
                "labels from": counts.method.map(SOURCES),
                "batches": counts.batches,
                "assisted": counts.assisted.astype(str) + published,
                "training: median; RMSE; registered": counts["train"],
                "test: median; RMSE; registered": counts["test"],
            }
        )
    )


def claims(root: Path) -> str:
    """Count verdicts, and list them under both scores, with the rules they were made by."""
    rows = read_published(root)
    listed = claims_markdown(rows_now(rows, root)).rstrip()
    return f"{verdict_sentence(root)} {rules_note(rows, root)}\n\n{listed}"


def difficulty(folder: Path = RESULTS / "benchmarks" / "scene_difficulty") -> str:
    """Say how hard the scenes are for localization, a line for each that was measured."""
    names = sorted(path.name.removesuffix("-sift.csv") for path in folder.glob("*-sift.csv"))
    return markdown_table(pd.DataFrame([_difficulty(folder, name) for name in names]))


def lines(root: Path) -> str:
    """Tell what was reproduced: by the pooled replications, once there are any."""
    replications = root.with_name(REPLICATIONS)
    if has_claims(replications):
        return as_markdown(claim_lines(read_claims(replications)))
    return reproduced(root)


def verdicts(root: Path) -> str:
    """Tell each claim in a line, and what is unclear about it in print."""
    notes = [f"- {claim.id}: {claim.footnote}" for claim in published_claims() if claim.footnote]
    return "\n".join([claims_table(root), "", *notes])


PAPERS = {name.partition("_")[0]: name for name in TABLES}  # `table2` to `table5`
PARTS: dict[str, Callable[[Path], str]] = {
    "found": found,
    "reproduced": lines,
    "answer": partial(findings, top="../"),
    "origin": origin,
    "size": size_table,
    "labels": labels_table,
    "noise": noise_table,
    "assistance": assistance,
    "claims": claims,
    "anew": run_anew,
    # Of all published runs together, whatever profile the mark names.
    "fresh": lambda root: fresh_claims(root.parent),
    "realisations": lambda root: realisations_table(root.parent),
    "verdicts": verdicts,
    "meshes": meshes_beside_print,
    **{part: partial(cells_beside_print, name=name) for part, name in PAPERS.items()},
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
    return PARTS[name](PUBLISHED / (headline() if profile == "headline" else profile))


def _change(factor: float) -> str:
    """Format a factor as a change in percent; the paper has none for rows of our own."""
    return "–" if math.isnan(factor) else f"{round(100 * (factor - 1)):+d} %"


def _noise_level(row: Any) -> str:
    """Name a row of Table 3 by how far its labels were moved and turned."""
    parts = {"position": f"{row.moved_m:.2f} m", "orientation": f"{row.noise_deg:g}°"}
    return parts.get(row.block) or " and ".join(parts.values())


def _cell(cell: Any) -> str:
    """Format both errors in the paper's unit, positions as root mean squares over the axes."""
    own = "failed"
    if not pd.isna(cell.position_m_true):
        position_rms_m = cell.position_m_true / math.sqrt(3)
        own = f"{position_rms_m:.2f} m, {cell.orientation_deg_true:.1f}°"
    if pd.isna(cell.published_position_m):  # a row the paper has not
        return own
    return f"{own} *({cell.published_position_m:.2f}, {cell.published_orientation_deg:.2f})*"


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
    shown = PUBLISHED / headline()
    drawn = panels(shown) if can_tell(shown) else []
    if drawn and not is_drawn_from(FIGURE, drawn):
        writers[FIGURE] = partial(write_findings_figure, drawn, FIGURE)
    if has_claims(PUBLISHED / REPLICATIONS):
        forest = read_forest(PUBLISHED / REPLICATIONS)
        if not shows(FOREST_FIGURE, forest.digest):
            writers[FOREST_FIGURE] = partial(write_forest, forest, FOREST_FIGURE)
    if (PUBLISHED / CONTROLS).is_dir():
        of_claims = effects(shown)
        if not shows(EFFECTS_FIGURE, effects_digest(of_claims)):
            content = effects_picture(of_claims)
            writers[EFFECTS_FIGURE] = partial(write_stamped, content, EFFECTS_FIGURE)
    cells = paper_cells(shown)
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
