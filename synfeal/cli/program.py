"""The program ``synfeal``, which answers Ctrl-C from its first moment."""

import os
import signal
from types import FrameType


def _leave(_: int, __: FrameType | None) -> None:
    os.write(2, b"error: interrupted; nothing was begun\n")
    os._exit(130)


# Here and not in a function: until libraries are imported, which takes a second and more, the usual
# KeyboardInterrupt would be a traceback, or be lost in the import system.
if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, _leave)


def main() -> int:
    """Run the command that was typed; see :func:`synfeal.cli.main`."""
    from synfeal.cli import main as run
    from synfeal.cli import parser  # noqa: F401 (imports what takes long)

    if signal.getsignal(signal.SIGINT) is _leave:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    return run()
