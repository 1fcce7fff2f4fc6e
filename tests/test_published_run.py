"""The tracked results of the published run are those its provenance file vouches for."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

from synfeal.report.readme import ROOT

TRACKED = Path(__file__).parent.parent / ROOT


def test_tracked_files_are_those_of_the_run() -> None:
    expected: dict[str, str] = json.loads((TRACKED / "provenance.json").read_text())["files"]
    found = {
        name: hashlib.sha256((TRACKED / name).read_bytes()).hexdigest()
        for name in expected
        if (TRACKED / name).is_file()
    }
    assert found == expected


def test_every_tracked_table_and_figure_is_vouched_for() -> None:
    expected = json.loads((TRACKED / "provenance.json").read_text())["files"]
    results = [*(TRACKED / "tables").glob("*.csv"), *(TRACKED / "figures").glob("*.*g")]
    assert {path.relative_to(TRACKED).as_posix() for path in results} <= set(expected)
    assert {"claims.csv", "summary.md"} <= set(expected)


def test_the_run_says_where_it_comes_from() -> None:
    record = json.loads((TRACKED / "provenance.json").read_text())
    assert len(record["commit"]) >= 40
    assert record["stages"]
