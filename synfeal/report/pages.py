"""The generated parts of pages: every number there comes from a tracked result file.

A part stands between ``<!-- NAME PROFILE -->`` and ``<!-- /NAME -->`` and shows the published
results of that profile; ``headline`` is the largest profile that is published.
``python -m synfeal.report.pages`` writes all parts anew, and the figure of the read-me; with
``--check`` it says whether that would change anything.
"""

from __future__ import annotations

import argparse
import math
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from pathlib import Path

from synfeal.config import MODELS
from synfeal.errors import InputError
from synfeal.files import atomic_path
from synfeal.report.assistance import TOTAL
from synfeal.report.claims.table import claims_markdown
from synfeal.report.findings import effects, sentences
from synfeal.report.findings_figure import is_drawn_from, write_findings_figure
from synfeal.report.layouts import SOURCES, TITLES, scene_title
from synfeal.report.publish import PUBLISHED, RESULTS
from synfeal.report.results import read_result, read_table

PAGES = (Path("README.md"), Path("docs/results.md"), Path("docs/scenes.md"))
FIGURE = Path("docs/images/findings.png")
HEADLINES = ("night", "mini")
PAPER_FRAMES = {"6k": 6000}
Row = Mapping[str, str]


def headline() -> str:
    """The profile whose results the read-me shows."""
    return next((name for name in HEADLINES if (PUBLISHED / name).is_dir()), HEADLINES[-1])


def findings(root: Path) -> str:
    """What the run found, a sentence each."""
    return "\n".join(f"- {sentence}" for sentence in sentences(root))


def origin(root: Path) -> str:
    """Which run the numbers are of."""
    record = read_result(root / "provenance.json", ("commit", "machine", "stages"), "publish again")
    first = read_table(root / "tables" / "table4_size.csv")[0]
    share = PAPER_FRAMES[first["size"]] / int(first["n_train"])
    frames = "the paper's frames" if share == 1 else f"1/{share:.3g} of the paper's frames"
    return (
        f"Profile `{root.name}`: {frames}, {counted_seeds(first)}, at commit"
        f" `{record['commit'][:9]}` on {record['machine']['usable_cores']} cores"
        f" ({record['machine']['processor']})."
    )


def counted_seeds(row: Row) -> str:
    """As in ``3 training runs per cell``."""
    return f"{row['n_seeds']} training run{'s' * (row['n_seeds'] != '1')} per cell"


def size_table(root: Path) -> str:
    """Table 4: errors against the true poses, published errors in brackets."""
    return _localizer_table(
        read_table(root / "tables" / "table4_size.csv"),
        "scene, size (frames here)",
        lambda row: (
            f"{scene_title(row['scene'])} {row['size']} ({row['n_train']}, {row['n_test']})"
        ),
    )


def labels_table(root: Path) -> str:
    """Table 2: errors against the true poses, published errors in brackets."""
    return _localizer_table(
        read_table(root / "tables" / "table2_ground_truth.csv"),
        "labels from",
        lambda row: SOURCES.get(row["labels"], row["labels"]),
    )


def assistance(root: Path) -> str:
    """Batches that needed assistance, and how good the labels are."""
    head = "| labels from | batches | assisted | median error, training | median error, test |"
    errors = {
        (row["method"], row["split"]): row
        for row in read_table(root / "tables" / "label_error.csv")
        if row["assistance"] == "after"
    }
    rows = [
        f"| {SOURCES[row['method']]} | {row['batches']} | {row['assisted']}{_published(row)}"
        f" | {_median(errors[row['method'], 'train'])} | {_median(errors[row['method'], 'test'])} |"
        for row in read_table(root / "tables" / "assistance.csv")
        if row["split"] == TOTAL
    ]
    return "\n".join([head, "|---|---|---|---|---|", *rows])


def _published(row: Row) -> str:
    if not row["published_assisted"]:
        return ""
    return f" *({row['published_assisted']} of {row['published_batches']})*"


def claims(root: Path) -> str:
    """Every claim with its verdict under both scores."""
    return claims_markdown(read_table(root / "claims.csv", ["id"])).rstrip()


def difficulty(folder: Path = RESULTS / "benchmarks" / "scene_difficulty") -> str:
    """How hard the scenes are for localisation, one line per scene that was measured."""
    head = "| scene | pixels near a keypoint | keypoints | best match far away | assisted batches |"
    names = sorted(path.name.removesuffix("-sift.csv") for path in folder.glob("*-sift.csv"))
    return "\n".join([head, "|---|---|---|---|---|", *(_difficulty(folder, n) for n in names)])


PARTS: dict[str, Callable[[Path], str]] = {
    "findings": findings,
    "origin": origin,
    "size": size_table,
    "labels": labels_table,
    "assistance": assistance,
    "claims": claims,
    "difficulty": lambda root: difficulty(),
}


def rewritten(text: str, part: Callable[[str, str], str]) -> str:
    """The text with each of its generated parts replaced.

    Args:
        text: a page in Markdown.
        part: what stands there instead, by name and profile.
    """
    pattern = re.compile(r"<!-- (\w+) (\w+) -->.*?<!-- /\1 -->", re.DOTALL)

    def fresh(found: re.Match[str]) -> str:
        name, profile = found.groups()
        return f"<!-- {name} {profile} -->\n\n{part(name, profile)}\n\n<!-- /{name} -->"

    return pattern.sub(fresh, text)


def part_of(name: str, profile: str) -> str:
    """A part of a page.

    Raises:
        InputError: there is no such part, or its results are not published.
    """
    if name not in PARTS:
        raise InputError(f"<!-- {name} {profile} -->: no such part; known: {', '.join(PARTS)}")
    return PARTS[name](PUBLISHED / (headline() if profile == "headline" else profile))


def _localizer_table(rows: Sequence[Row], heading: str, label: Callable[[Row], str]) -> str:
    lines = [
        f"| {heading} | {' | '.join(TITLES[model] for model in MODELS)} |",
        f"|---|{'---|' * len(MODELS)}",
    ]
    for name, group in groupby(rows, key=label):
        cells = {row["model"]: _cell(row) for row in group}
        lines.append(f"| {name} | {' | '.join(cells[model] for model in MODELS)} |")
    return "\n".join(lines)


def _cell(row: Row) -> str:
    """Both errors in the paper's unit, positions as root mean squares over the axes."""
    own = "failed"
    if row["position_m_true"]:
        position_rms_m = float(row["position_m_true"]) / math.sqrt(3)
        own = f"{position_rms_m:.2f} m, {float(row['orientation_deg_true']):.1f}°"
    if not row["published_position_m"]:  # a row the paper has not
        return own
    printed = float(row["published_position_m"]), float(row["published_orientation_deg"])
    return f"{own} *({printed[0]:.2f} m, {printed[1]:.2f}°)*"


def _median(row: Row) -> str:
    position_m, orientation_deg = row["position_m_median"], row["orientation_deg_median"]
    return f"{100 * float(position_m):.1f} cm, {float(orientation_deg):.2f}°"


def _difficulty(folder: Path, name: str) -> str:
    (sift,) = read_table(folder / f"{name}-sift.csv")
    (repetition,) = read_table(folder / f"{name}-repetition.csv")
    share, low, high = (
        f"{100 * float(sift[f'covered_share_{which}']):.0f} %" for which in ("mean", "q10", "q90")
    )
    methods = [
        f"{SOURCES[row['method']]} {row['assisted']} of {row['batches']}"
        for row in read_table(folder / f"{name}-assistance.csv")
    ]
    return (
        f"| {scene_title(name)} | {share} (10 % of the frames below {low}, 10 % above {high})"
        f" | {float(sift['keypoints_mean']):.0f}"
        f" | {100 * float(repetition['far_share']):.1f} % of the frames | {', '.join(methods)} |"
    )


def stale(check: bool) -> list[Path]:
    """Pages, and the figure, that did not show the published results; written unless checking."""
    found = effects(PUBLISHED / headline())
    changed = []
    for page in PAGES:
        old = page.read_text(encoding="utf-8")
        new = rewritten(old, part_of)
        if new != old:
            changed.append(page)
            if not check:
                with atomic_path(page) as temporary:
                    temporary.write_text(new, encoding="utf-8")
    if not is_drawn_from(FIGURE, found):
        changed.append(FIGURE)
        if not check:
            write_findings_figure(found, FIGURE)
    return changed


def main(argv: Sequence[str] | None = None) -> int:
    """Write the generated parts of the pages, or check them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="exit 1 if anything would change")
    check = parser.parse_args(argv).check
    try:
        changed = stale(check)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    for path in changed:
        print(f"{path}: {'run python -m synfeal.report.pages' if check else 'written anew'}")
    return int(check and bool(changed))


if __name__ == "__main__":
    sys.exit(main())
