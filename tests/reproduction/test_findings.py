"""Every sentence of the findings, recomputed from the published tables by other code."""

import math
import re
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from reproduction.config.load import load_config
from reproduction.report import findings_figure
from reproduction.report.claim_findings import (
    FINDINGS,
    claim_findings,
    label_errors_are_small,
    more_frames_help,
    noise_is_mostly_the_yardsticks,
)
from reproduction.report.findings import (
    OF_RUN,
    can_tell,
    findings,
    sentences,
    shared_errors_stay,
    short_sentences,
)
from reproduction.report.intervals import Interval, cell_interval
from reproduction.statistics.seeds import half_width
from reproduction.tables.layouts import TITLES

REPOSITORY = Path(__file__).parents[2]
NIGHT = REPOSITORY / "results/published/night"
SINGLE_RUNS = NIGHT.with_name("single_runs")
SEED_DEVIATIONS = REPOSITORY / "reproduction/statistics/published/seed_deviations.csv"
POSITION, ORIENTATION = "position_m_true", "orientation_deg_true"


def table(name, root=NIGHT):
    return pd.read_csv(root / f"tables/{name}.csv")


def numbers(text):
    """All numbers of a text in order, with sign; names of sizes, as 6k, are none."""
    plain = re.sub(r"\b\d+k\b", "", text.replace("−", "-").replace(",", ""))
    return [float(found) for found in re.findall(r"(?<![\w.])[+-]?\d+(?:\.\d+)?", plain)]


@pytest.fixture(scope="module")
def told():
    return {function.__name__: function(NIGHT) for function in OF_RUN}


def test_all_findings_say_what_is_measured_against_what_and_where_to_look(told):
    assert all(told.values())
    assert [*told.values()] == findings(NIGHT)
    found = [*findings(NIGHT), *claim_findings(SINGLE_RUNS)]
    assert len(found) == len(OF_RUN) + len(FINDINGS)
    for finding in found:
        assert "truth" in finding.against
        assert finding.source.is_file()
    for text in (*sentences(found, "../"), *short_sentences(found)):
        assert text.endswith(".csv))")


def reference_row(root, method, labels="synfeal"):
    rows = table("references", root)
    chosen = (rows.scene == "large_room") & (rows["size"] == "6k") & (rows.labels == labels)
    (row,) = rows[chosen & (rows.method == method)].to_dict("records")
    return row


def best_network(root):
    cells = table("table2_ground_truth", root).query("labels == 'synfeal'")
    return cells.loc[cells[POSITION].idxmin()]


def with_limits(row, measure):
    """Value and limits over the test paths and the training runs of a cell.

    One run borrows its deviation. Limits of three in old tables are made of the normal
    distribution; they are due Student's t with two degrees of freedom.
    """
    value, low, high = (row[f"{measure}{end}"] for end in ("", "_low", "_high"))
    sd = row.get(f"{measure}_sd")  # not in tables of single runs
    if row.get("limits_of") == "paths and seeds":
        return [value, low, high]
    if row["n_seeds"] == 1:
        lent = pd.read_csv(SEED_DEVIATIONS).set_index(["model", "measure"])
        known = lent.loc[(row["model"], measure)]
        error, degrees, removed = known.relative_sd * value, known.degrees_of_freedom, 0.0
    else:
        error, degrees = sd / math.sqrt(3), 2
        removed = 1.96 * error
    ends = []
    for sign, distance in ((-1, value - low), (1, high - value)):
        of_paths = math.sqrt(distance**2 - removed**2)
        ends.append(value + sign * half_width(of_paths, error, degrees))
    return [value, *ends]


def near(found, expected, digits=2):
    """Whether printed numbers are the expected ones, rounded to so many digits that count."""
    assert len(found) == len(expected)
    for printed, value in zip(found, expected, strict=True):
        assert printed == pytest.approx(value, rel=0.51 * 10 ** (1 - digits), abs=1e-9), expected


def test_structure_against_regression(told):
    finding = told["structure_beats_regression"]
    root = NIGHT
    matched, network = reference_row(root, "structure-rays"), best_network(root)
    (factor,) = numbers(finding.headline)
    near(numbers(finding.short)[1:], [100 * row[POSITION] for row in (matched, network)])
    assert factor == pytest.approx(network[POSITION] / matched[POSITION], rel=0.05)
    frames, *printed = numbers(finding.evidence)
    assert frames == network.n_train
    ends = ("", "_low", "_high")
    expected = [100 * matched[f"{POSITION}{end}"] for end in ends]
    expected += [matched[f"{ORIENTATION}{end}"] for end in ends]
    expected += [100 * end for end in with_limits(network, POSITION)]
    expected += with_limits(network, ORIENTATION)
    near([n for n in printed if n != 2], expected)  # but that of "PoseNet2"
    assert f"{TITLES[network.model]}, is off" in finding.evidence


def test_a_map_from_noisy_labels(told):
    finding = told["a_map_beats_exact_labels"]
    root = NIGHT
    adjusted = reference_row(root, "structure-adjusted", "noise-p0.3-r20")
    network = best_network(root)
    noise_cm, noise_deg, *printed = numbers(finding.evidence)
    assert (noise_cm, noise_deg) == (30, 20)
    expected = [100 * adjusted[f"{POSITION}{end}"] for end in ("", "_low", "_high")]
    expected += [adjusted[f"{ORIENTATION}{end}"] for end in ("", "_low", "_high")]
    expected += [100 * end for end in with_limits(network, POSITION)]
    near(printed, expected + with_limits(network, ORIENTATION))
    near(numbers(finding.short), [30, 20, expected[0], expected[6]])
    assert adjusted[f"{POSITION}_high"] < with_limits(network, POSITION)[1]


def test_shapes_of_label_errors(told):
    finding = told["shared_errors_stay"]
    noise_cm, noise_deg, *printed = numbers(finding.evidence)
    assert (noise_cm, noise_deg) == (30, 20)
    by_shape = table("shape_changes").query("error == 'orientation'").set_index("change")
    ends = ["percent", "percent_low", "percent_high"]
    expected = [n for shape in ("noise", "offset", "bend") for n in by_shape.loc[shape, ends]]
    assert printed == [round(number) for number in expected]
    cells = table("table6_label_errors")
    clean = cells[cells.labels == "synfeal"].set_index("model")[ORIENTATION]
    for place, shape in enumerate(("noise", "offset", "bend")):
        worst = cells[(cells.labels == shape) & (cells.noise_m == 0.3)].set_index("model")
        ratio = math.prod(worst[ORIENTATION] / clean) ** 0.2
        assert printed[3 * place] == pytest.approx(100 * (ratio - 1), abs=1.5)
    of_frames, of_paths, of_space = (printed[start : start + 3] for start in (0, 3, 6))
    assert of_space[1] > of_frames[2]
    assert ("frames share do not" in finding.headline) == (of_paths[1] > of_frames[2])
    assert numbers(finding.short)[2:] == [of_frames[0], of_space[0]]


def copy_of(folder, tmp_path):
    return Path(shutil.copytree(folder, tmp_path / folder.name))


def test_what_is_found_of_a_run_follows_its_tables(tmp_path):
    root = copy_of(NIGHT, tmp_path)
    path = root / "tables/shape_changes.csv"
    changes = pd.read_csv(path)
    bent = (changes.change == "bend") & (changes.error == "orientation")
    changes.loc[bent, ["percent", "percent_low", "percent_high"]] = [20.0, 16.0, 24.0]
    changes.to_csv(path, index=False)
    # Where bent space does no more harm than noise, nothing is found.
    assert shared_errors_stay(root) is None
    assert len(findings(root)) == len(OF_RUN) - 1
    (*_, shapes) = findings_figure.panels(root)
    assert shapes.title.startswith("3  Label errors by their shape")
    path.unlink()
    assert shared_errors_stay(root) is None
    assert can_tell(root)
    (root / "tables/references.csv").unlink()
    assert not can_tell(root)


def test_metres_are_those_that_labels_truly_moved_by(tmp_path):
    root = copy_of(NIGHT, tmp_path)
    for name in ("table3_inconsistencies", "table6_label_errors"):
        path = root / f"tables/{name}.csv"
        cells = pd.read_csv(path)
        cells.assign(moved_m=3**0.5 * cells.noise_m).to_csv(path, index=False)
    plain, moved = (
        [f"{one.headline} {one.evidence} {one.short}" for one in findings(r)] for r in (NIGHT, root)
    )
    assert moved == [text.replace("30 cm and 20°", "52 cm and 20°") for text in plain]
    assert moved != plain
    drawn = [panel.title for panel in findings_figure.panels(root)]
    assert any("labels 52 cm, 20° off" in " ".join(title.split()) for title in drawn)


def effects_row(folder, claim, part, quantity, against="true"):
    rows = pd.read_csv(folder / "claim_effects.csv", keep_default_na=False, na_values=[""])
    found = rows[(rows.claim == claim) & (rows.part == part) & (rows.quantity == quantity)]
    (row,) = found[found.against == against].to_dict("records")
    return [row["value"], row["low"], row["high"]]


def change_effects(folder, claim, part, quantity, against, values):
    path = folder / "claim_effects.csv"
    rows = pd.read_csv(path, keep_default_na=False, na_values=[""])
    own = (rows.claim == claim) & (rows.part == part) & (rows.quantity == quantity)
    rows.loc[own & (rows.against == against), ["value", "low", "high"]] = values
    rows.to_csv(path, index=False)


QUANTITIES = ("position", "orientation")


def test_noise_of_test_labels_is_told_from_the_harm_of_noise(tmp_path):
    finding = noise_is_mostly_the_yardsticks(SINGLE_RUNS)
    expected = [
        round(number)
        for against in ("labels", "true")
        for quantity in QUANTITIES
        for number in effects_row(SINGLE_RUNS, "C5", "both", quantity, against)
    ]
    assert numbers(finding.evidence)[2:] == expected
    assert numbers(finding.short) == [expected[3], expected[9]]
    # 25 % is more than half of 41 %, as both are factors.
    folder = copy_of(SINGLE_RUNS, tmp_path)
    change_effects(folder, "C5", "both", "position", "true", [25.0, 20.0, 30.0])
    assert noise_is_mostly_the_yardsticks(folder) is None
    # Nor is it sure where limits reach that far.
    change_effects(folder, "C5", "both", "position", "true", [10.0, -4.0, 26.0])
    assert noise_is_mostly_the_yardsticks(folder) is None
    change_effects(folder, "C5", "both", "position", "true", [10.0, 6.0, 14.0])
    assert noise_is_mostly_the_yardsticks(folder) is not None
    change_effects(folder, "C5", "both", "position", "true", [np.inf, -100.0, np.inf])
    assert noise_is_mostly_the_yardsticks(folder) is None


def test_frames_are_told_from_images(tmp_path):
    finding = more_frames_help(SINGLE_RUNS)
    frames = [effects_row(SINGLE_RUNS, "C7", "80k, not 6k", q) for q in QUANTITIES]
    images = [effects_row(SINGLE_RUNS, "images", "twice the images", q)[0] for q in QUANTITIES]
    expected = [round(number) for number in (*frames[0], *frames[1], *images)]
    # Profile `controls` showed 144,000 images of the largest set and 60,000 of the smallest.
    assert numbers(finding.evidence) == [2.4, *expected]
    assert numbers(finding.short) == [2.4, expected[0], expected[6]]
    shown = load_config(Path("config/config.yaml"), Path("config/replication.yaml"))
    samples = shown.training.samples_seen
    assert samples["80k"] / samples["6k"] == 2.4
    folder = copy_of(SINGLE_RUNS, tmp_path)
    change_effects(folder, "images", "twice the images", "position", "true", [-50.0, -55.0, -46.0])
    assert more_frames_help(folder) is None
    # 2.4 times the images may do by themselves what frames do: 0.8 to the power of 1.26 is 0.75.
    change_effects(folder, "images", "twice the images", "position", "true", [-13.0, -20.0, -5.0])
    change_effects(folder, "C7", "80k, not 6k", "position", "true", [-27.0, -30.0, -24.0])
    assert more_frames_help(folder) is None
    change_effects(folder, "C7", "80k, not 6k", "position", "true", [-29.0, -32.0, -26.0])
    assert more_frames_help(folder) is not None
    change_effects(folder, "C7", "80k, not 6k", "position", "true", [-27.0, -30.0, -24.0])
    assert len(claim_findings(folder)) == len(FINDINGS) - 1


def test_labels_of_estimators_beside_networks(tmp_path):
    finding = label_errors_are_small(SINGLE_RUNS)
    errors = pd.read_csv(SINGLE_RUNS / "label_errors.csv").set_index("method")
    off, rmse = errors.position_m, errors.position_m_rmse
    cells = pd.read_csv(SINGLE_RUNS / "cell_errors.csv")
    assert len(cells) == 5
    rivals = ("sfm", "rgbd-toro", "rgbd-g2o")
    changes = [
        effects_row(SINGLE_RUNS, "C1", f"exact labels, not {rival}", quantity)
        for rival in rivals
        for quantity in QUANTITIES
    ]
    cm = [100 * off[[*rivals]].min(), 100 * off[[*rivals]].max()]
    networks = [100 * cells.position_m.min(), 100 * cells.position_m.max()]
    squares = [100 * rmse[[*rivals]].min(), 100 * rmse[[*rivals]].max()]
    medians, both = [round(n, 1) for n in cm], [round(n) for n in networks]
    levels = [*medians, *(round(n, 1) for n in squares), *both]
    text = finding.evidence.replace("g2o", "g")
    # Halves of a percent may be rounded either way.
    expected = [*levels, *(n for change in changes for n in change)]
    assert numbers(text) == pytest.approx(expected, abs=0.501)
    ends = [end for change in changes for end in change[1:]]
    values = [change[0] for change in changes]
    told = [round(end(changed)) for changed in (values, ends) for end in (min, max)]
    assert numbers(finding.short.replace("95 %", "")) == [*medians, *both, *told]
    folder = copy_of(SINGLE_RUNS, tmp_path)
    path = folder / "claim_effects.csv"
    rows = pd.read_csv(path, keep_default_na=False)
    rows[rows.part != "exact labels, not rgbd-g2o"].to_csv(path, index=False)
    assert label_errors_are_small(folder) is None
    folder = copy_of(SINGLE_RUNS, tmp_path / "failing")
    errors.loc["rgbd-g2o", "position_m"] = 0.6
    errors.to_csv(folder / "label_errors.csv")
    assert label_errors_are_small(folder) is None


def test_a_single_run_borrows_its_spread_over_seeds():
    cells = table("table6_label_errors")
    (row,) = cells[(cells.labels == "bend") & (cells.noise_m == 0.3)].iloc[:1].itertuples()
    interval = cell_interval(row, POSITION)
    assert interval.low < row.position_m_true_low
    assert interval.high > row.position_m_true_high


def test_a_ratio_of_independent_errors_has_the_spread_of_both():
    ratio = Interval(4.0, 2.0, 8.0) / Interval(1.0, 0.5, 2.0)
    # Both are known to a factor of two: together to 2 to the power of the root of two.
    assert ratio == pytest.approx((4.0, 4 / 2 ** math.sqrt(2), 4 * 2 ** math.sqrt(2)))


def test_the_figure_shows_what_the_findings_say(tmp_path):
    drawn = findings_figure.panels(NIGHT)
    (errors, changes) = drawn
    root = NIGHT
    noisy = table("table3_inconsistencies", root).query("block == 'both' and noise_m == 0.3")
    expected_m = [
        reference_row(root, "structure-rays")[POSITION],
        reference_row(root, "structure-adjusted", "noise-p0.3-r20")[POSITION],
        best_network(root)[POSITION],
        noisy[POSITION].min(),
    ]
    shown_cm = [row.interval.value for row in errors.rows]
    assert shown_cm == pytest.approx([100 * error for error in expected_m])
    assert [round(row.interval.value) for row in changes.rows] == numbers(
        findings(NIGHT)[2].evidence
    )[2::3]
    third = findings(NIGHT)[2].headline.removesuffix(".")
    assert f"3 {third} (labels 30 cm, 20° off)" == " ".join(changes.title.split())
    assert all("truth" in row.against for panel in drawn for row in panel.rows)
    out = tmp_path / "findings.png"
    findings_figure.write_findings_figure(drawn, out)
    assert findings_figure.is_drawn_from(out, drawn)
    moved = errors.rows[0]._replace(interval=Interval(1.0, 0.5, 2.0))
    assert not findings_figure.is_drawn_from(out, [errors._replace(rows=[moved]), changes])
