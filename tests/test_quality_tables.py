"""Tables of mutants and of lines, from records written by hand."""

import csv
import json

import pytest

from benchmarks import line_coverage, mutation

SOURCE = """
def x_double__mutmut_orig(value, factor=2):
    return value * factor


def x_double__mutmut_1(value, factor=3):
    return value * factor


def x_double__mutmut_2(value, factor=2):
    return value / factor


class Box:
    def xǁBoxǁside__mutmut_orig(self):
        return 1

    def xǁBoxǁside__mutmut_1(self):
        return 2
"""
DIVIDED = mutation.Change("box.double", "return value * factor", "return value / factor")
LONGER = mutation.Change("box.Box.side", "return 1", "return 2")
TRIPLED = mutation.Change("box.double", "(value, factor=2):", "(value, factor=3):")


@pytest.fixture
def left(tmp_path, monkeypatch):
    """A directory in which mutmut ran; statuses of its three mutants."""

    def leave(*codes):
        keys = ["box.x_double__mutmut_1", "box.x_double__mutmut_2", "box.xǁBoxǁside__mutmut_1"]
        record = {
            "exit_code_by_key": dict(zip(keys, codes, strict=True)),
            "durations_by_key": dict.fromkeys(keys, 0.5),
        }
        (tmp_path / "mutants").mkdir(exist_ok=True)
        (tmp_path / "mutants" / "box.py").write_text(SOURCE)
        (tmp_path / "mutants" / "box.py.meta").write_text(json.dumps(record))
        monkeypatch.setattr(mutation, "SURVIVORS", tmp_path / "survivors.csv")
        monkeypatch.chdir(tmp_path)
        return tmp_path

    return leave


def known(folder, *changes):
    with (folder / "survivors.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["function", "before", "after", "reason"])
        writer.writerows((*change, "equal") for change in changes)


def test_every_survivor_is_told_by_what_it_changes(left):
    module = mutation.module_of(left(0, 33, 5) / "mutants" / "box.py.meta")
    assert module == mutation.Module("box", 3, (TRIPLED, DIVIDED, LONGER), 1.5)
    assert mutation.module_of(left(1, -24, 3) / "mutants" / "box.py.meta").killed == 3


def test_the_table_counts_modules_and_all_of_them():
    first = mutation.Module("a", 4, (LONGER,), 1.25)
    second = mutation.Module("b", 6, (), 2.0)
    rows = [list(row.values()) for row in mutation.rows_of([second, first])]
    assert rows == [
        ["a", 4, 3, 1, 0.75, 1.2],
        ["b", 6, 6, 0, 1.0, 2.0],
        ["all", 10, 9, 1, 0.9, 3.2],
    ]


def test_a_run_is_right_when_each_survivor_has_a_reason(left):
    folder = left(1, 1, 0)
    known(folder, LONGER)
    with pytest.raises(SystemExit) as ended:
        mutation.main(["--out", "table.csv"])
    assert str(ended.value) == "66.7% killed, 85% wanted"
    assert (folder / "table.csv").read_text().splitlines()[1] == "box,3,2,1,0.666667,1.5"
    left(1, 1, 1)
    known(folder)
    with pytest.raises(SystemExit) as ended:
        mutation.main(["--out", "table.csv"])
    assert ended.value.code is None


def test_a_survivor_without_a_reason_is_named_and_so_is_a_reason_without_one(left):
    modules = [mutation.Module("box", 10, (DIVIDED,), 0.0)]
    found = mutation.complaints(modules, {LONGER: "equal"})
    assert [text.partition(":")[0] for text in found] == [
        "survived, reason unknown",
        "killed, but listed",
    ]
    assert "value / factor" in found[0]


def test_a_run_that_was_cut_short_is_no_result(left):
    with pytest.raises(ValueError, match="not all mutants were run"):
        mutation.module_of(left(1, None, 1) / "mutants" / "box.py.meta")


def test_lines_are_added_up_by_package(tmp_path, monkeypatch):
    counts = {
        "synfeal/files.py": (10, 9),
        "synfeal/render/base.py": (5, 5),
        "synfeal/render/opengl/part.py": (15, 10),
        "baselines/__init__.py": (0, 0),
    }
    files = {
        name: {"summary": {"num_statements": lines, "covered_lines": run}}
        for name, (lines, run) in counts.items()
    }
    (tmp_path / "coverage.json").write_text(json.dumps({"files": files}))
    monkeypatch.chdir(tmp_path)
    line_coverage.main(["--out", "table.csv"])
    assert (tmp_path / "table.csv").read_text().splitlines() == [
        "package,lines,run,share",
        "synfeal,10,9,0.9",
        "synfeal.render,20,15,0.75",
        "all,30,24,0.8",
    ]
