"""Numbers of the pages, recomputed from tracked tables by code that shares nothing with ours."""

import csv
import math
import re
from collections import defaultdict
from statistics import mean, median

import pytest

from tests import ROOT

PUBLISHED = ROOT / "results/published"
CLAIMS = PUBLISHED / "replications"
MODELS = ("posenet", "poselstm", "hourglass", "posenet2resnet", "posenet2")
KEYS = {
    "table2_ground_truth": ("labels",),
    "table3_inconsistencies": ("block", "noise_m", "noise_deg"),
    "table4_size": ("scene", "size"),
    "table5_from_scratch": ("scene", "size"),
}


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def part(page, name, profile):
    text = (ROOT / page).read_text()
    return text.split(f"<!-- {name} {profile} -->")[1].split(f"<!-- /{name} -->")[0].strip()


def numbers(text):
    return [float(found) for found in re.findall(r"[+-]?\d+(?:\.\d+)?", text.replace("−", "-"))]


@pytest.mark.parametrize("run", ["night", "mini"])
@pytest.mark.parametrize("name", KEYS)
def test_every_cell_of_a_page_is_that_of_the_table(name, run):
    number = name[len("table")]
    profile = {"night": "headline"}.get(run, run)
    shown = part(f"docs/paper/table{number}.md", f"table{number}", profile).splitlines()[2:]
    cells = defaultdict(dict)
    for row in rows_of(PUBLISHED / run / f"tables/{name}.csv"):
        cells[tuple(row[key] for key in KEYS[name])][row["model"]] = row
    assert len(shown) == len(cells)
    for line, key in zip(shown, cells, strict=True):
        texts = [text.strip() for text in line.strip("|").split("|")][1:]
        for text, model in zip(texts, MODELS, strict=True):
            row = cells[key][model]
            ours, _, printed = text.partition("*(")
            # The root mean square over three axes is the distance over the square root of 3.
            expected = [float(row["position_m"]) / math.sqrt(3), float(row["orientation_deg"])]
            assert numbers(ours) == pytest.approx(expected, abs=0.0501), (key, model)
            assert numbers(ours)[0] == pytest.approx(expected[0], abs=0.00501), (key, model)
            if row["published_position_m"]:
                expected = [row["published_position_m"], row["published_orientation_deg"]]
                assert numbers(printed)[:2] == pytest.approx([*map(float, expected)], abs=0.00501)
            else:
                assert not printed


def deciding_effects(claim, against="true"):
    """Rows that decide a claim: not those of single replications."""
    return [
        row
        for row in rows_of(CLAIMS / "claim_effects.csv")
        if row["claim"] == claim
        and row["against"] in (against, "")
        and row["replication"] == "pooled"
    ]


def test_every_claim_shows_its_effects_and_verdicts():
    shown = part("docs/results.md", "verdicts", "headline").splitlines()[2:]
    lines = [line for line in shown if line.startswith("|")]
    claims = {line.split(" | ")[0].strip("| "): line.split(" | ") for line in lines}
    assert [*claims] == [f"C{n}" for n in range(1, 17)]
    verdicts = defaultdict(dict)
    for row in rows_of(CLAIMS / "claims.csv"):
        verdicts[row["claim"]][row["against"]] = row["verdict"]
    for claim, (*_, told, verdict) in claims.items():
        expected = [
            float(row[name]) * (100 if row["unit"] == "share" else 1)
            for row in deciding_effects(claim)
            for name in ("value", "low", "high")
            if row[name]
        ]
        if claim == "C6":  # told as the harm of the noise
            expected = [100 / (1 + number / 100) - 100 for number in expected]
        # "6k", "80k", "g2o" and "PoseNet2" are names.
        found = numbers(re.sub(r"\b\d+k\b|g2o|Net2\w*", "", told))
        if claim == "C12":  # the nearest rival alone
            assert all(min(abs(number - n) for n in expected) < 0.501 for number in found)
        else:
            assert sorted(found) == pytest.approx(sorted(expected), abs=0.501), claim
        for one in verdicts[claim].values():
            assert one in verdict


def test_the_rules_page_tells_the_verdicts_of_the_table():
    text = (ROOT / "docs/rules.md").read_text().split("### Result")[1].split("\n## ")[0]
    told = {}
    for line in text.splitlines():
        if line.startswith("- *"):
            heading, _, rest = line.removeprefix("- *").partition("*: ")
            told |= dict.fromkeys(re.findall(r"\bC\d+", rest.partition(".")[0]), heading.lower())
    found = defaultdict(set)
    for row in rows_of(CLAIMS / "claims.csv"):
        found[row["claim"]].add(row["verdict"])
    assert found.pop("best network") == {"refuted"}
    assert found.pop("C16") == {"holds by construction"}
    assert {*told} == {*found}
    for claim, verdicts in found.items():
        (verdict,) = verdicts  # the same against the labels and against the truth
        assert verdict.removesuffix(" here") in re.split(", or | or ", told[claim]), claim


def percents(claim, part, against="true", turned=False):
    """Changes of both errors with limits, and the printed ones, percent."""
    rows = {row["quantity"]: row for row in deciding_effects(claim, against) if row["part"] == part}
    names = ("value", "high", "low") if turned else ("value", "low", "high")
    own = [float(rows[q][name]) for q in ("position", "orientation") for name in names]
    printed = [float(rows[q]["printed"]) for q in ("position", "orientation")]
    if turned:  # the error with noise over the one without
        own, printed = ([100 / (1 + n / 100) - 100 for n in group] for group in (own, printed))
    return own, printed


def test_the_first_lines_of_the_readme_follow_from_the_tables():
    size, noise, networks, labels, start = part("README.md", "reproduced", "headline").splitlines()

    def told(line):
        plain = re.sub(r"\*\*.*?\*\*|\b\d+k\b|Net2|Table 3", "", line)
        return numbers(plain)

    room, sanctuary = percents("C7", "80k, not 6k"), percents("C8", "95k, not 6k")
    expected = [*room[0], *room[1], *sanctuary[0], *sanctuary[1]]
    assert told(size) == pytest.approx(expected, abs=0.51)

    of_noise = "C6", "no noise, not the most"
    seen, harm = (percents(*of_noise, against, turned=True) for against in ("labels", "true"))
    assert told(noise) == pytest.approx([*harm[0], *seen[0], *seen[1]], abs=0.51)

    own, _ = percents("C2", "exact labels, not sfm")
    seen, printed = percents("C2", "exact labels, not sfm", "labels")
    assert told(labels) == pytest.approx([*own, *seen, *printed], abs=0.51)
    small, more = (percents("C10", f"from scratch, {size}") for size in ("6k", "20k"))
    expected = [*small[0], *small[1], *more[0], *more[1]]
    assert told(start.split(" All surely in")[0]) == pytest.approx(expected, abs=0.51)

    by_replication = defaultdict(lambda: defaultdict(dict))
    for row in rows_of(CLAIMS / "claim_effects.csv"):
        if row["claim"] == "networks" and row["replication"] != "pooled":
            pair = float(row["printed"]), float(row["value"])
            by_replication[row["quantity"]][row["replication"]][row["part"]] = pair
    for quantity, replications in by_replication.items():
        found = mean(
            rank_correlation(*zip(*(pairs[model] for model in MODELS), strict=True))
            for pairs in replications.values()
        )
        (text,) = re.findall(rf"([+−][\d.]+) in {quantity}", networks)
        assert numbers(text) == pytest.approx([found], abs=0.006)


def test_matching_by_size_of_the_image_is_told_as_it_was_measured():
    benchmarks = ROOT / "results/benchmarks"
    matched = {int(row["width_px"]): row for row in rows_of(benchmarks / "image_size.csv")}
    cm = {
        name: 100 * float(matched[64][name]) for name in matched[64] if name.startswith("position")
    }
    ends = "{position_m:.1f} cm ({position_m_low:.1f} to {position_m_high:.1f})".format(**cm)
    networks = [
        100 * float(row["position_m"])
        for row in rows_of(benchmarks / "gpu_errors.csv")
        if (row["localizer"], row["input_px"]) == ("posenet2", "64")
    ]
    assert len(networks) == 6
    told = f"{min(networks):.0f} to {max(networks):.0f}"
    objections, results = (
        (ROOT / f"docs/{name}.md").read_text() for name in ("objections", "results")
    )
    assert f"matching is off by {ends}, PoseNet2 of 64 × 64 by {told} cm" in objections
    times = [network / cm["position_m"] for network in networks]
    assert f"{min(times):.0f} to {max(times):.0f} times" in objections
    small = 100 * float(matched[88]["position_m"])
    assert f"off by {ends}, of 88 × 66 by {small:.1f}, PoseNet2 of 64 × 64 by {told}." in results
    assert f"it is off by {cm['position_m']:.1f} cm" in (ROOT / "README.md").read_text()


def ranks(values):
    """Ranks from 1; equal values share the mean of theirs."""
    ordered = sorted(values)
    return [ordered.index(v) + (ordered.count(v) + 1) / 2 for v in values]


def rank_correlation(first, second):
    a, b = ranks(first), ranks(second)
    a, b = [x - mean(a) for x in a], [x - mean(b) for x in b]
    return sum(x * y for x, y in zip(a, b, strict=True)) / math.sqrt(
        sum(x * x for x in a) * sum(y * y for y in b)
    )


def test_sfm_models_of_the_replications_are_told_as_they_were_measured():
    page = (ROOT / "docs/estimation.md").read_text()
    told = page.split("### In the replications")[1].split("\nTo add a method")[0]
    rows = [
        {name: float(row[name]) for name in ("rmse_m", "explained")}
        for row in rows_of(ROOT / "results/benchmarks/explained.csv")
        if row["profile"].startswith("replication_")
    ]
    wrong = [row for row in rows if row["rmse_m"] > 0.2]
    sound = [row for row in rows if row["rmse_m"] <= 0.2]
    words = {7: "seven", 11: "eleven", 3: "three"}
    off_m = [row["rmse_m"] for row in wrong]
    off_cm = [100 * row["rmse_m"] for row in sound]
    assert f"have {len(rows)} training batches" in told
    assert f"models of {len(sound)} are off by {median(off_cm):.1f} cm in the median" in told
    assert f"squares, {max(off_cm):.1f} cm at most" in told
    assert f"The other {words[len(wrong)]}, {min(off_m):.1f} to {max(off_m):.1f} m off" in told
    ranges = [
        [round(100 * end(row["explained"] for row in some)) for end in (min, max)]
        for some in (wrong, sound)
    ]
    assert (
        "{} to {} % of the matched points, the sound ones {} to {} %".format(*ranges[0], *ranges[1])
        in told
    )
    doubtful = [row for row in rows if row["explained"] < 0.85]
    among = sum(row["rmse_m"] > 0.2 for row in doubtful)
    assert (
        f"Below 85 % are {words[len(doubtful)]} batches, {words[among]} of the {words[len(wrong)]}"
        " among them" in told
    )


def test_rows_of_real_photographs_are_those_of_the_tables():
    scored = {
        (row["labels"], row["trained_on"], row["method"]): row
        for row in rows_of(PUBLISHED / "real/tables/table8_real.csv")
        if row["direction"] == "forward"
    }
    others = {
        (row["labels"], row["method"]): row
        for row in rows_of(ROOT / "results/benchmarks/published_poses.csv")
    }
    labels = {"SfM": ("sfm", "sfm", "_sfm"), "depth SLAM": ("given", "dslam", "")}
    names = {
        "Structure": "structure",
        "PoseNet2": "posenet2",
        "hloc": "hloc",
        "Active Search": "as",
    }
    sources = {"renderings": "rendered", "randomised renderings": "randomised"}
    for line in part("README.md", "real_short", "real").splitlines()[2:]:
        told, method, source, errors, share = (cell.strip() for cell in line.strip("|").split("|"))
        own, of_others, end = labels[told]
        name = names[method.strip("*\\")]
        limits = ("", "_low", "_high")
        if source in sources:
            row = scored[own, sources[source], name]
            expected = [row[f"position_m{limit}{end}"] for limit in limits]
            shares = [row[f"recall_5cm_5deg{limit}{end}"] for limit in limits]
            degrees = row[f"orientation_deg{end}"]
        else:
            row = others[of_others, name]
            expected, shares = [row["position_m"]], [row["recall_5cm_5deg"]]
            degrees = row["orientation_deg"]
        *position_cm, orientation_deg = numbers(re.sub("within|–", " ", errors))
        assert position_cm == pytest.approx([100 * float(n) for n in expected], abs=0.501)
        assert position_cm[0] == pytest.approx(100 * float(expected[0]), abs=0.0501)
        assert orientation_deg == pytest.approx(float(degrees), abs=0.0501)
        shown = numbers(share.replace("–", " "))
        assert shown == pytest.approx([100 * float(n) for n in shares], abs=0.501)


def test_sfm_models_by_other_settings_are_told_as_they_were_measured():
    page = (ROOT / "docs/estimation.md").read_text()
    measured = defaultdict(list)
    for row in rows_of(ROOT / "results/benchmarks/sfm_failures.csv"):
        cm = [100 * float(row[name]) for name in ("median_m", "max_m")]
        measured[f"{row['seed']}, {row['batch']}"] += [round(cm[0], 1), round(cm[1])]
    assert len(measured) == 3
    for key, expected in measured.items():
        (line,) = (line for line in page.splitlines() if line.startswith(f"  | {key} |"))
        assert numbers(line.split("|", 2)[2].replace(",", " ")) == expected


def test_what_a_shared_machine_took_is_told_as_it_was_measured():
    page = (ROOT / "docs/cost.md").read_text()
    (row,) = rows_of(ROOT / "results/benchmarks/reproduce_shared.csv")
    assert f"took {float(row['run_s']) / 3600:.1f} hours" in page
    assert f"left {row['packages_gb']} GB of packages" in page
    assert f"{row['results_gb']} GB of results" in page
    assert f"took {float(row['largest_job_mb']) / 1000:.1f} GB of memory" in page
