"""The rules of the verdicts are frozen: a change takes a dated entry, here and on the page."""

import re
from pathlib import Path

import pytest

from reproduction.claims import rules
from reproduction.claims.rules import RULES, digest_of_rules, frozen_rules, rules_history

PAGE = Path("docs/rules.md")


def test_the_rules_are_those_of_the_last_dated_entry():
    """If this fails, the rules have changed: add a row to rules.csv, and say why in docs/rules.md.

    ``python -c "from reproduction.claims.rules import digest_of_rules as d; print(d())"`` prints
    the digest that the new row takes. Verdicts published before keep the tag they were made by.
    """
    assert frozen_rules().digest == digest_of_rules()


def test_every_entry_is_dated_in_order_and_explained_on_the_page():
    tags = [entry.tag for entry in rules_history()]
    assert tags == sorted(set(tags))
    assert all(re.fullmatch(r"\d{4}-\d\d-\d\d[a-z]?", tag) for tag in tags)
    headings = re.findall(r"^### (\S+)", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert headings == tags


CHANGES = [
    ("claims/verdicts.py", "smallest: float = 5.0", "smallest: float = 4.0", True),
    ("claims/training.py", "is_order=True", "is_order=False", True),
    ("statistics/seeds.py", "WELCH_SHARE = 0.4", "WELCH_SHARE = 0.5", True),
    ("tables/published/claims.csv", "below a third", "below a half", True),
    ("claims/verdicts.py", "# Percent.", "# Per cent.", False),
    ("claims/verdicts.py", '"""Judge a claim that holds if all', '"""Whether all', False),
]


@pytest.mark.parametrize(("name", "old", "new", "counts"), CHANGES)
def test_code_and_texts_count_and_what_is_said_about_them_does_not(
    tmp_path, monkeypatch, name, old, new, counts
):
    package = RULES.parents[1]
    for path in (*rules.CODE, "tables/published/claims.csv"):
        text = (package / path).read_text(encoding="utf-8")
        assert path != name or old in text
        copy = tmp_path / path
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text(text.replace(old, new) if path == name else text, encoding="utf-8")
    monkeypatch.setattr(rules, "_PACKAGE", tmp_path)
    monkeypatch.setattr(rules, "FOLDER", tmp_path / "tables/published")
    assert (digest_of_rules() != frozen_rules().digest) == counts
