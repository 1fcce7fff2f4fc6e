"""Table 8, its sentences and its figures, from rows whose numbers are known."""

import math

import pytest

from reproduction.real.figures import draw_amount, draw_cover
from reproduction.real.findings import real_findings, real_headline, real_table
from reproduction.report.html.page import _real_table
from reproduction.tables.columns import write_side
from reproduction.tables.real import AMOUNT, COVER, NAME, SCHEMA, read_real, side_layout
from synfeal.records.tables import frame_of, write_frame

COUNTS = {"n_seeds": 3, "n_test": 500, "n_blocks": 10, "n_fused": 250, "correlation_frames": 31.0}


def around(name, value, end=""):
    ends = {"": 1.0, "_low": 0.5, "_high": 1.5}
    return {f"{name}{limit}{end}": factor * value for limit, factor in ends.items()}


def row(direction, trained_on, method, position_m, **further):
    return {
        "scene": "kitchen",
        "direction": direction,
        "labels": "given",
        "trained_on": trained_on,
        "method": method,
        **around("position_m", position_m),
        **around("orientation_deg", 40 * position_m),
        **around("recall_5cm_5deg", 0.25),
        **around("localized", 0.6),
        "position_m_worst": 1.1 * position_m,
        "orientation_deg_worst": 44 * position_m,
        **COUNTS,
        **further,
    }


@pytest.fixture
def root(tmp_path):
    rows = [
        row("forward", "photographs", "posenet2", 0.48),
        row("forward", "randomised", "posenet2", 0.12, **around("times_position", 4.0)),
        row("forward", "randomised", "posenet", 0.16, **around("times_position", 1.9)),
        row("forward", "rendered", "structure", math.inf),
        row("forward", "rendered", "structure-refined", 0.05),
        row("forward", "rendered", "retrieval", 0.31),
        row("forward", "rendered", "nearest", 0.21),
        row("forward", "photographs", "mean", 0.62),
        row("reverse", "photographs", "posenet2", 0.46),
        row("reverse", "randomised", "posenet2", 0.33, **around("times_position", 1.4)),
    ]
    write_frame(tmp_path / "tables" / f"{NAME}.csv", frame_of(rows, SCHEMA))
    return tmp_path


@pytest.fixture(autouse=True)
def _folder(tmp_path):
    (tmp_path / "tables").mkdir()


def test_infinite_errors_and_missing_yardsticks_are_read_back(root):
    table = read_real(root / "tables" / f"{NAME}.csv")
    assert math.isinf(table.position_m[3])
    assert table.position_m_sfm.isna().all()
    assert table.n_test.tolist() == [500] * 10


def test_sentences_give_the_numbers_of_their_rows(root):
    text = real_findings(root)
    assert "on 500 photographs, PoseNet2 is off by 0.120 m / 4.8° when trained only on rend" in text
    assert "by 0.480 m / 19.2° when trained on the scan's photographs" in text
    assert "it is 4.0 times as exact (95 % limits 2.0 to 6.0)" in text
    assert "1.4 times as exact" in text
    assert "errors from 0.120 m / 4.8° (PoseNet2) to 0.160 m / 6.4° (PoseNet)" in text
    # Limits are from half the value to one and a half times it.
    assert "They are 1.9 to 4.0 times as exact as the same networks trained on" in text
    assert "limits of 1 of the 2 ratios exclude 1." in text
    assert "Structure, with a map of renderings: half not localized, 25 % within 5 cm" in text
    assert "Structure, with a map of renderings, refined on the scan: 0.050 m / 2.0°" in text
    assert "the mean pose by 0.620 m / 24.8°" in text


@pytest.fixture
def others(tmp_path):
    path = tmp_path / "others.csv"
    path.write_text(
        "labels,method,position_m,orientation_deg,recall_5cm_5deg,n_test\n"
        "sfm,hloc,0.011,0.1,0.986,5000\n"
        "dslam,hloc,0.04,1.4,0.6188,5000\n"
        "dslam,dsac_rgb,0.039,1.2,0.65,5000\n"
    )
    return path


def short_rows(root, others):
    lines = real_headline(root, others).splitlines()
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines if "|" in line][2:]


def test_the_short_table_has_the_best_localizer_and_the_main_direction_alone(root, others):
    lines = real_headline(root, others).splitlines()
    errors = {tuple(row[1:3]): row[3] for row in short_rows(root, others)}
    assert errors["PoseNet2", "photographs of the scan"] == "48.0 cm (24 – 72), 19.2°"
    assert errors["PoseNet2 (best of five)", "randomised renderings"] == "12.0 cm (6 – 18), 4.8°"
    assert errors["Structure", "renderings"] == "half not localized"
    assert errors["Structure, refined on the scan", "renderings"].startswith("5.0 cm (2")
    assert errors["*hloc*\\*", "photographs, of other sequences"] == "4.0 cm, 1.4°"
    assert len(errors) == 7
    assert "500 photographs" in lines[0]
    assert "33.0" not in real_headline(root, others)  # of the reverse direction


def test_the_short_table_leads_with_the_chain_on_the_labels_of_sfm_scored_by_them(root, others):
    assert {row[0] for row in short_rows(root, others)} == {"depth SLAM"}
    path = root / "tables" / f"{NAME}.csv"
    of_sfm = row("forward", "rendered", "structure", 0.04, labels="sfm")
    of_sfm |= around("position_m", 0.014, "_sfm") | around("recall_5cm_5deg", 0.996, "_sfm")
    of_sfm["orientation_deg_sfm"] = 0.33
    write_frame(path, frame_of([*read_real(path).to_dict("records"), of_sfm], SCHEMA))
    first, second, third = short_rows(root, others)[:3]
    assert first[:2] == ["SfM", "Structure"]
    assert first[3].startswith("1.4 cm (0.7 – 2.1), 0.3°")
    assert first[4].startswith("99.6 %")
    assert second[:2] == ["SfM", "*hloc*\\*"]
    assert second[4] == "99 %"  # of 98.6
    assert third[0] == "depth SLAM"


def test_what_renderings_are_worth_is_told_where_both_kinds_were_learned_from(root, others):
    assert "as exact" not in real_headline(root, others)
    path = root / "tables" / f"{NAME}.csv"
    table = read_real(path)
    plain = row("forward", "rendered", "posenet2", 0.4, **around("times_position", 1.2))
    write_frame(path, frame_of([*table.to_dict("records"), plain], SCHEMA))
    assert "is 4.0 times as exact" in real_headline(root, others)
    assert "as they are, 1.2 times (95 % limits 0.6 to 1.8)" in real_headline(root, others)


def test_the_table_is_the_same_on_page_on_paper_and_in_markdown(root):
    table = side_layout(read_real(root / "tables" / f"{NAME}.csv"))
    write_side(root / "table.tex", table)
    tex = (root / "table.tex").read_text()
    (shown,) = _real_table(root)
    for text in (tex, str(shown["body"]), real_table(root)):
        assert text.count("Scan of the second half, photographs of the first") >= 1
        assert "0.120 m" in text
        assert "half not localized" in text
        assert "SfM" not in text  # nothing was scored against it
    assert shown["title"] == "Table 8"


def test_a_report_without_such_a_run_has_no_such_table(tmp_path):
    assert list(_real_table(tmp_path)) == []


def test_figures_show_every_point_and_mark_single_runs():
    points = [
        {"kind": kind, "trained_on": trained_on, "amount": amount, "n_seeds": seeds}
        | around("position_m", error)
        | around("orientation_deg", 30 * error)
        for kind, trained_on, amount, seeds, error in (
            ("frames", "randomised", 100, 1, 0.4),
            ("frames", "randomised", 3000, 3, 0.12),
            ("photographs", "photographs", 500, 3, 0.46),
            ("photographs", "randomised", 50, 1, 0.5),
        )
    ]
    panel = draw_amount(frame_of(points, AMOUNT)).axes[0]
    line, *_, hollow = panel.get_lines()
    assert line.get_xydata().tolist() == [[100, 0.4], [3000, 0.12]]
    assert hollow.get_xydata().tolist() == [[100, 0.4]]


def test_bins_of_few_photographs_are_not_drawn():
    bins = [
        {
            "direction": "forward",
            "trained_on": "randomised",
            "share_low": share - 0.05,
            "share_high": share + 0.05,
            "share": share,
            "n_test": count,
            "position_m": 0.1 / share,
            "orientation_deg": 4.0,
        }
        for share, count in ((0.45, 3), (0.75, 40), (0.95, 400))
    ]
    (line,) = draw_cover(frame_of(bins, COVER)).axes[0].get_lines()
    assert line.get_xdata().tolist() == [75.0, 95.0]
