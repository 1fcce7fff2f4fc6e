"""``synfeal serve``: open a place, and answer until told to stop."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from importlib.util import find_spec

from baselines.serving.job import ServeJob
from synfeal.errors import Argument, InputError

INSTALL = "pip install 'synfeal-baselines[serve]'"
MODULES = ("fastapi", "python_multipart", "uvicorn")
# At once, though a pipe or a file takes it.
SAY = partial(print, flush=True)


def serve(job: ServeJob, say: Callable[[str], object] = SAY) -> None:
    """Serve a place until Ctrl-C or SIGTERM; photographs under way are answered.

    Args:
        job: What is served, and where.
        say: Takes a line when it is ready, and one when it has stopped.

    Raises:
        InputError: The place cannot be used, the address cannot be listened on, or the libraries
            that serve are not installed.
    """
    for module in MODULES:
        if find_spec(module) is None:
            raise InputError(f"serving needs {module}", INSTALL)
    from baselines.references.single_thread import single_thread
    from baselines.serving.place import ServedPlace
    from baselines.serving.server import server_of

    with (
        single_thread(),
        listening(job.host, job.port) as listener,
        ServedPlace(job) as place,
    ):
        server = server_of(place, job)
        port = listener.getsockname()[1]
        host = f"[{job.host}]" if ":" in job.host else job.host
        say(
            f"http://{host}:{port}: {place.name}, {len(place.map)} frames,"
            f" {len(place.map.features.slope)} features; Ctrl-C stops"
        )
        with suppress(KeyboardInterrupt):  # uvicorn has stopped, and passes on what stopped it
            server.run(sockets=[listener])
    say("stopped")


def listening(host: str, port: int) -> socket.socket:
    """Open a socket that listens; port 0 is any that is free.

    Raises:
        InputError: The address is not this machine's, or in use.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family)
    except socket.gaierror as error:
        raise InputError(Argument("host"), f"{host}: {error.strerror}") from error
    except OSError as error:
        reason = os.strerror(error.errno) if error.errno else str(error)
        raise InputError(
            Argument("port"), f"cannot listen on {host}:{port} ({reason})", "choose another"
        ) from error
