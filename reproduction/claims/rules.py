"""The rules that judge claims: their history, and a digest that freezes them.

``rules.csv`` has a row for every set of rules that was ever in force; ``docs/rules.md`` says what
each of them said of the numbers of its time and why it changed. The last row is in force. Its
digest is of the claims' text and of the code that turns errors into verdicts, so that a change of
either is noticed, and takes a new row with its date.
"""

from __future__ import annotations

import ast
import hashlib
from functools import cache
from pathlib import Path
from typing import NamedTuple, TypeGuard

from reproduction.tables.cells import FOLDER
from synfeal.records.tables import read_records

RULES = Path(__file__).with_name("rules.csv")
_PACKAGE = Path(__file__).parents[1]
# What a verdict depends on. Imports, comments, docstrings and white space do not count.
CODE = (
    "claims/verdicts.py",
    "claims/labels.py",
    "claims/training.py",
    "claims/untrained.py",
    "claims/evidence.py",
    "claims/judging.py",
    "statistics/seeds.py",
)
TEXTS = ("id", "group", "statement", "numbers", "test")


class Rules(NamedTuple):
    """One set of rules."""

    tag: str  # its date, and a letter where a day had several
    commit: str  # that put it into force; empty for the present one
    digest: str  # hash of texts and code; empty for rules from before they were frozen
    change: str  # against the one before


@cache
def rules_history() -> tuple[Rules, ...]:
    """Read every set of rules, oldest first."""
    return tuple(Rules(**row) for _, row in read_records(RULES, Rules._fields))


def frozen_rules() -> Rules:
    """Return the rules in force."""
    return rules_history()[-1]


def digest_of_rules() -> str:
    """Hash the rules as they are in the code and the texts of the claims."""
    texts = [row[name] for _, row in read_records(FOLDER / "claims.csv", TEXTS) for name in TEXTS]
    code = [_bare(_PACKAGE / name) for name in CODE]
    return hashlib.sha256("\n".join([*texts, *code]).encode()).hexdigest()[:16]


def _bare(path: Path) -> str:
    """Return the code of a module without imports, comments, docstrings and white space."""
    text = path.read_text(encoding="utf-8")
    lines = text.splitlines()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import | ast.ImportFrom) or _is_text(node):
            first, last = node.lineno, node.end_lineno or node.lineno
            lines[first - 1 : last] = [""] * (last - first + 1)
    code = [line for line in lines if not line.lstrip().startswith("#")]
    return "".join("".join(code).split())


def _is_text(node: ast.AST) -> TypeGuard[ast.Expr]:
    """Tell whether a statement is a string alone, as docstrings are."""
    if not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
        return False
    return isinstance(node.value.value, str)
