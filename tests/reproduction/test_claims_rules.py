"""The rules that single runs were judged by are dated, in order, and explained on the page."""

import re
from pathlib import Path

from reproduction.claims.rules import frozen_rules, rules_history

PAGE = Path("docs/rules.md")


def test_every_entry_is_dated_in_order_and_explained_on_the_page():
    tags = [entry.tag for entry in rules_history()]
    assert tags == sorted(set(tags))
    assert frozen_rules().tag == tags[-1]
    assert all(re.fullmatch(r"\d{4}-\d\d-\d\d[a-z]?", tag) for tag in tags)
    headings = re.findall(r"^### (\S+)", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    assert headings == tags
