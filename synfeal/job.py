"""What every batch job does around its work: keep a log, and say one line a person can act on."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from synfeal.errors import InputError


@contextmanager
def job(log: str | Path) -> Iterator[None]:
    """Send everything the block prints, native libraries included, to the file ``log``.

    An :class:`InputError` becomes one line on the real standard error and exit status 1; any other
    exception keeps its traceback, in the log.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    real_stderr = os.dup(2)
    with Path(log).open("w", encoding="utf-8") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    sys.stdout.reconfigure(line_buffering=True)  # type: ignore[union-attr]
    logging.basicConfig(level=logging.INFO, format="%(levelname)s %(name)s: %(message)s")
    try:
        yield
    except InputError as error:
        line = f"error: {error}\n"
        sys.stderr.write(line)
        os.write(real_stderr, line.encode())
        sys.exit(1)
    finally:
        os.close(real_stderr)
