"""How many deliberate defects the tests notice, after ``mutmut run`` (``make mutate``).

``python -m benchmarks.mutation`` reads what mutmut left in ``mutants/`` and writes
``results/benchmarks/mutation.csv``, one row per module. It fails when the tests notice less than
85 % of all mutants, or when one survives that nobody has looked at: each survivor needs a line with
a reason in ``benchmarks/mutation_survivors.csv``. Lines that no mutant needs any more are named.
"""

from __future__ import annotations

import argparse
import ast
import csv
import difflib
import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from synfeal.report.tables import write_rows

LEAST_SHARE = 0.85
COLUMNS = ("module", "mutants", "killed", "survived", "share", "seconds")
# Exit statuses of mutmut: a failed test, an error within pytest, and time that ran out.
KILLED = frozenset({1, 3, 36, -24, 24, 152, 255})
MUTANTS = Path("mutants")
SURVIVORS = Path(__file__).with_name("mutation_survivors.csv")


class Change(NamedTuple):
    """What a mutant does: the lines it takes from a function, and those it puts there."""

    function: str
    before: str
    after: str


class Module(NamedTuple):
    """What became of the mutants of one module."""

    name: str
    mutants: int
    survivors: tuple[Change, ...]
    seconds: float

    @property
    def killed(self) -> int:
        """Mutants that some test noticed."""
        return self.mutants - len(self.survivors)


def module_of(meta: Path) -> Module | None:
    """The mutants of the module of one of mutmut's records, None if it has none.

    Raises:
        ValueError: a mutant was not run.
    """
    record = json.loads(meta.read_text(encoding="utf-8"))
    status: dict[str, int | None] = record["exit_code_by_key"]
    if not status:
        return None
    if None in status.values():
        raise ValueError(f"{meta}: not all mutants were run; run mutmut again")
    name = next(iter(status)).rpartition(".")[0]
    bodies = functions_of(meta.with_suffix(""))
    survivors = [change_of(key, bodies) for key, code in status.items() if code not in KILLED]
    seconds = sum(record["durations_by_key"].values())
    return Module(name, len(status), tuple(survivors), seconds)


def functions_of(source: Path) -> dict[str, list[str]]:
    """Lines of every function in a file of mutants, by name, from behind the name on."""
    text = source.read_text(encoding="utf-8")
    nodes = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.FunctionDef)]
    lines = text.splitlines()
    return {node.name: _after_name(lines, node) for node in nodes}


def _after_name(lines: Sequence[str], node: ast.FunctionDef) -> list[str]:
    """Parameters, whose defaults a mutant may change, and body."""
    first = lines[node.lineno - 1].partition(node.name)[2]
    return [line.strip() for line in (first, *lines[node.lineno : node.end_lineno])]


def change_of(key: str, bodies: Mapping[str, list[str]]) -> Change:
    """What the mutant ``module.x_function__mutmut_3`` does."""
    module, _, mutant = key.rpartition(".")
    stem = mutant.rpartition("__mutmut_")[0]
    pairs = list(difflib.ndiff(bodies[f"{stem}__mutmut_orig"], bodies[mutant]))
    before, after = (" ".join(p[2:] for p in pairs if p.startswith(sign)) for sign in "-+")
    name = stem.removeprefix("x_").removeprefix("xǁ").replace("ǁ", ".")
    return Change(f"{module}.{name}", before, after)


def reasons_of(path: Path) -> dict[Change, str]:
    """Why each known survivor may live."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    return {Change(row["function"], row["before"], row["after"]): row["reason"] for row in rows}


def rows_of(modules: Iterable[Module]) -> list[dict[str, str | int | float]]:
    """One row per module and one for all of them."""
    listed = sorted(modules)
    survivors = tuple(change for module in listed for change in module.survivors)
    whole = Module("all", sum(m.mutants for m in listed), survivors, sum(m.seconds for m in listed))
    return [
        {
            "module": module.name,
            "mutants": module.mutants,
            "killed": module.killed,
            "survived": len(module.survivors),
            "share": module.killed / module.mutants,
            "seconds": round(module.seconds, 1),
        }
        for module in (*listed, whole)
    ]


def complaints(modules: Sequence[Module], reasons: Mapping[Change, str]) -> list[str]:
    """What is wrong with a run, a line each; lines of the survivors' list that nothing needs."""
    survivors = [change for module in modules for change in module.survivors]
    share = 1 - len(survivors) / sum(module.mutants for module in modules)
    low = [f"{share:.1%} killed, {LEAST_SHARE:.0%} wanted"] if share < LEAST_SHARE else []
    unknown = [f"survived, reason unknown: {c}" for c in survivors if c not in reasons]
    return low + unknown + [f"killed, but listed: {c}" for c in reasons if c not in survivors]


def main(arguments: Sequence[str] | None = None) -> None:
    """Write the table of mutants and name what has to be looked at."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mutation", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("results/benchmarks/mutation.csv"))
    out = parser.parse_args(arguments).out
    found = [module_of(meta) for meta in sorted(MUTANTS.rglob("*.meta"))]
    modules = [module for module in found if module is not None]
    if not modules:
        sys.exit(f"{MUTANTS}: holds no mutants; run mutmut first")
    write_rows(out, COLUMNS, rows_of(modules))
    wrong = complaints(modules, reasons_of(SURVIVORS))
    print(out.read_text(encoding="utf-8"), end="")
    sys.exit("\n".join(wrong) or None)


if __name__ == "__main__":
    main()
