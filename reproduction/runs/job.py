"""Frame of every batch job: a log, and failures in one line a person can act on."""

from __future__ import annotations

import gc
import logging
import os
import re
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from pydantic import validate_call

from synfeal.errors import Argument, InputError


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
        handler = logging.StreamHandler()
        handler.setFormatter(_Formatter("%(levelname)s %(name)s: %(message)s"))
        logging.basicConfig(level=logging.INFO, handlers=[handler])
        yield
    except (InputError, MemoryError, OSError) as error:
        line = f"error: {in_keys(str(_sentence(error)))}\n"
        os.write(real_stderr, line.encode())
        with suppress(OSError):  # the log may lie on the disk that is full
            if not isinstance(error, InputError) or error.__cause__ is not None:
                traceback.print_exc()
            sys.stderr.write(line)
        sys.exit(1)
    finally:
        os.close(real_stderr)


@contextmanager
def uncollected() -> Iterator[None]:
    """Import what is named inside without looking for garbage, of which imports make none.

    Importing torch makes a quarter of a million objects. Looking through them, again and again
    while there are more of them and once more at the end of the process, takes half as long as
    making them. So all objects alive when the block ends are left out of later searches for good.
    A collector that was off before the block stays off.
    """
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        if was_on:
            gc.enable()


def run_job(log: str, function: Callable[..., object], /, **arguments: object) -> None:
    """Call the function of a rule inside :func:`job`.

    Args:
        log: The job's log file.
        function: What the rule does.
        arguments: Its arguments as Snakemake has them: texts become paths, numbers and
            configuration models as the function annotates them.
    """
    gc.freeze()  # what is imported stays, and is not looked through for garbage, nor at the exit
    with job(log):
        validate_call(function)(**arguments)


def in_keys(text: str) -> str:
    """Write the arguments that a text names as a configuration file has them.

    Functions name their arguments as Python has them, ``box`` between backticks, for example. Who
    runs the workflow gives no arguments, but the keys they come from: ``sampling_box``.

    Args:
        text: An error or a log line.
    """
    if "`" not in text:
        return text
    from synfeal.cli.wording import MARKED  # loads the models, which few jobs would need to do

    def written(found: re.Match[str]) -> str:
        argument, value = found.groups()
        if value is None:
            return f"`{_key_of(argument)}`"
        in_yaml = {"True": "true", "False": "false"}.get(value, value)
        return f"`{_key_of(argument)}: {in_yaml}`"

    return MARKED.sub(written, text)


def _key_of(argument: str) -> str:
    """Return the key of a configuration file that an argument comes from."""
    from synfeal.config.collect import KEYS

    # Of several keys that are one argument, the first stands for all.
    return {name: key for key, name in reversed(KEYS.items())}.get(argument, argument)


class _Formatter(logging.Formatter):
    """Formatter of log lines in the words of configuration files."""

    def format(self, record: logging.LogRecord) -> str:
        return in_keys(super().format(record))


def _sentence(error: InputError | MemoryError | OSError) -> InputError:
    """Reword the error as a line for people, with what to do."""
    if isinstance(error, InputError):
        if isinstance(error.where, Argument):
            return InputError(_key_of(error.where.name), error.problem, error.remedy)
        return error
    if isinstance(error, MemoryError):
        return InputError(
            f"out of memory ({str(error) or 'no more is to be had'}); start again with fewer jobs"
            " at once (--cores), or on a machine with more"
        )
    where = f"{error.filename}: " if error.filename else ""
    return InputError(f"{where}{error.strerror or error}; fix that and start again")
