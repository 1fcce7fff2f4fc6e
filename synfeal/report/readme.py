"""The generated parts of the read-me: every number there comes from a tracked result file.

A part stands between ``<!-- NAME -->`` and ``<!-- /NAME -->``. ``python -m synfeal.report.readme``
writes all of them anew; with ``--check`` it says whether that would change anything.
"""

from __future__ import annotations

import argparse
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
from synfeal.report.layouts import SOURCES, TITLES, scene_title
from synfeal.report.results import read_table, read_text

README = Path("README.md")
ROOT = Path("results/published/mini")
DIFFICULTY = Path("results/benchmarks/scene_difficulty")
Row = Mapping[str, str]


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


def findings(root: Path) -> str:
    """What the summary says of the run, sentence by sentence."""
    lines = read_text(root / "summary.md").splitlines()
    return "\n".join(line for line in lines if line.startswith("- "))


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


def difficulty(folder: Path = DIFFICULTY) -> str:
    """How hard the scenes are for localisation, one line per scene that was measured."""
    head = "| scene | pixels near a keypoint | keypoints | best match far away | assisted batches |"
    names = sorted(path.name.removesuffix("-sift.csv") for path in folder.glob("*-sift.csv"))
    return "\n".join([head, "|---|---|---|---|---|", *(_difficulty(folder, n) for n in names)])


PARTS: dict[str, Callable[[Path], str]] = {
    "findings": findings,
    "size": size_table,
    "labels": labels_table,
    "assistance": assistance,
    "claims": claims,
    "difficulty": lambda root: difficulty(root.parent.parent / "benchmarks" / "scene_difficulty"),
}


def rewritten(text: str, parts: Mapping[str, str]) -> str:
    """The text with each of its generated parts replaced.

    Raises:
        InputError: a part has no place in the text.
    """
    for name, part in parts.items():
        pattern = re.compile(rf"(<!-- {name} -->).*?(<!-- /{name} -->)", re.DOTALL)
        found = pattern.search(text)
        if found is None:
            raise InputError(f"{README}: has no '<!-- {name} -->' … '<!-- /{name} -->'")
        text = f"{text[: found.end(1)]}\n\n{part}\n\n{text[found.start(2) :]}"
    return text


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
    own = "failed"
    if row["position_m_true"]:
        own = f"{float(row['position_m_true']):.2f} m, {float(row['orientation_deg_true']):.1f}°"
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


def main(argv: Sequence[str] | None = None) -> int:
    """Write the generated parts of the read-me, or check them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="exit 1 if anything would change")
    arguments = parser.parse_args(argv)
    old = README.read_text(encoding="utf-8")
    try:
        new = rewritten(old, {name: part(ROOT) for name, part in PARTS.items()})
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    if arguments.check:
        print(f"{README}: {'up to date' if new == old else 'run python -m synfeal.report.readme'}")
        return int(new != old)
    with atomic_path(README) as temporary:
        temporary.write_text(new, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
