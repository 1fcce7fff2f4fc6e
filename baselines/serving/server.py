"""The server that the application runs in."""

from __future__ import annotations

import logging

import uvicorn

from baselines.serving.app import build_app
from baselines.serving.job import ServeJob
from baselines.serving.place import ServedPlace

# Seconds that photographs under way have, once the server is told to stop.
GRACE_S = 30


def server_of(place: ServedPlace, job: ServeJob) -> uvicorn.Server:
    """Return a server that is not started.

    Args:
        place: The place, open.
        job: The settings.
    """
    # It warns of every form that cannot be read, of which whoever sent it is told.
    logging.getLogger("python_multipart").setLevel(logging.ERROR)
    config = uvicorn.Config(
        build_app(place, job),
        log_config=None,
        access_log=False,
        server_header=False,
        lifespan="off",
        ws="none",
        timeout_graceful_shutdown=GRACE_S,
    )
    return uvicorn.Server(config)
