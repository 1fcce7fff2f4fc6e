"""What every batch job does around its work: keep a log, and say one line a person can act on."""

from __future__ import annotations

import inspect
import logging
import os
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path, PurePath
from pkgutil import resolve_name
from typing import Any

from pydantic import validate_call

from synfeal.errors import InputError


@contextmanager
def job(log: str | Path) -> Iterator[None]:
    """Send everything the block prints, native libraries included, to the file ``log``.

    What a person can fix becomes one line on the real standard error and exit status 1: an
    :class:`InputError`, a full disk, too little memory. Tracebacks, with the cause
    of an :class:`InputError` that has one, are in the log.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    real_stderr = os.dup(2)
    try:
        with Path(log).open("w", encoding="utf-8") as file:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
        sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]
        logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s")
        yield
    except (InputError, MemoryError, OSError) as error:
        line = f"error: {_sentence(error)}\n"
        os.write(real_stderr, line.encode())
        with suppress(OSError):  # the log may lie on the disk that is full
            if not isinstance(error, InputError) or error.__cause__ is not None:
                traceback.print_exc()
            sys.stderr.write(line)
        sys.exit(1)
    finally:
        os.close(real_stderr)


def call(snakemake: Any) -> None:
    """Call the function that a rule names, ``params.function``, with what it is asked for by name.

    An argument is the rule's parameter, input or wildcard of that name, ``out_<name>`` its output
    ``<name>``, ``files`` its inputs that are one file, by name, ``wildcards`` its wildcards, and
    ``root`` the results directory where this job has it, which with a storage plugin is a copy.
    Texts become paths, numbers and models as annotated; what a rule lacks keeps its default.

    Raises:
        InputError: the output was restored (``synfeal restore``), not made here: the rule has no
            inputs to make it again.
    """
    function = resolve_name(snakemake.params.function)
    wildcards = dict(snakemake.wildcards.items())
    inputs = {name: files for name, files in snakemake.input.items() if files}
    given = {**wildcards, **dict(snakemake.input.items()), **dict(snakemake.params.items())}
    files = {name: path for name, path in inputs.items() if isinstance(path, str)}
    given |= {"files": files, "wildcards": wildcards}
    given |= {f"out_{name}": path for name, path in snakemake.output.items()}
    asked = inspect.signature(function).parameters
    if "root" in asked:
        root = PurePath(snakemake.config["results"], snakemake.config["profile"]).as_posix()
        output = str(snakemake.output[0])
        given["root"] = output[: output.rindex(root) + len(root)]
    bare = {name for name, _ in snakemake.input.items() if name in asked} - {*inputs}
    needed = {name for name, argument in asked.items() if argument.default is argument.empty}
    if not inputs and bare & needed:
        raise InputError(
            f"{snakemake.output[0]}: was restored, not made here; restore it once more, or delete"
            " restored.json to make everything anew"
        )
    left = {name for name in {*asked} - needed if name in bare or name not in given}
    validate_call(function)(**{name: given[name] for name in asked if name not in left})


def _sentence(error: InputError | MemoryError | OSError) -> InputError:
    """The error as a line for people, with what to do."""
    if isinstance(error, InputError):
        return error
    if isinstance(error, MemoryError):
        return InputError(
            f"out of memory ({str(error) or 'no more is to be had'}); start again with fewer jobs"
            " at once (--cores), or on a machine with more"
        )
    where = f"{error.filename}: " if error.filename else ""
    return InputError(f"{where}{error.strerror or error}; fix that and start again")
