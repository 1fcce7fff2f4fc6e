"""The application: what is asked at which address, and how it is answered."""

from __future__ import annotations

import asyncio
import math
from concurrent.futures import Future
from functools import partial
from typing import Any

from fastapi import FastAPI
from fastapi.responses import HTMLResponse, JSONResponse, Response
from starlette.exceptions import HTTPException
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.requests import ClientDisconnect, Request

import synfeal
from baselines.serving import uploads
from baselines.serving.answers import Answer, Health, Problem, answer_of
from baselines.serving.job import ServeJob
from baselines.serving.page import page_of
from baselines.serving.place import Found, ServedPlace
from baselines.serving.uploads import Body, Refusal, read_upload
from synfeal.errors import InputError

# Names that a browser on this machine has for it. Any other is a page of the internet that has its
# own name point here, to read what this machine shows to nobody else.
LOOPBACK = ("127.0.0.1", "localhost")
GONE = 499  # nobody reads the answer
# The page needs nothing from anywhere else, and may not ask for it.
PAGE_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; img-src 'self' blob: data:; connect-src 'self';"
    " style-src 'unsafe-inline'; script-src 'unsafe-inline'; base-uri 'none'; form-action 'none';"
    " frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
}
REFUSALS: dict[int | str, dict[str, Any]] = {
    400: {"model": Problem, "description": "no photograph, or a form that cannot be read"},
    413: {"model": Problem, "description": "too many bytes or pixels"},
    415: {"model": Problem, "description": "no JPEG, PNG or HEIC"},
    422: {"model": Problem, "description": "damaged, or of an unknown camera"},
    503: {"model": Problem, "description": "too many wait; come again after Retry-After seconds"},
}
_FIELDS = {
    uploads.IMAGE: {"type": "string", "format": "binary", "description": "JPEG, PNG or HEIC"},
    uploads.CAMERA: {
        "type": "string",
        "format": "binary",
        "description": "calibration: a file that synfeal reads, or the text of a JSON file",
    },
    uploads.FOCAL: {"type": "number", "description": "focal length in pixels of the photograph"},
    uploads.EXIF: {"type": "boolean", "description": "read the focal length from EXIF"},
    uploads.RENDERING: {"type": "boolean", "description": "draw the place from the pose found"},
}
REQUEST = {
    "requestBody": {
        "required": True,
        "content": {
            uploads.FORM: {
                "schema": {
                    "type": "object",
                    "properties": _FIELDS,
                    "required": [uploads.IMAGE],
                }
            },
            "image/jpeg": {"schema": {"type": "string", "format": "binary"}},
            "image/png": {"schema": {"type": "string", "format": "binary"}},
        },
    }
}


class Slots:
    """Room for photographs that come in, wait or are localized.

    Args:
        place: What localizes them.
        job: Says how much room there is.
    """

    def __init__(self, place: ServedPlace, job: ServeJob) -> None:
        self._place, self._cores = place, job.cores
        self._room = job.cores + job.queue
        self.pending = 0

    def take(self) -> None:
        """Take room for one.

        Raises:
            Refusal: There is none.
        """
        if self.pending >= self._room:
            after_s = max(1, math.ceil(self.pending * self._place.seconds / self._cores))
            raise Refusal(503, f"{self.pending} photographs wait already", retry_after_s=after_s)
        self.pending += 1

    def give(self) -> None:
        """Give the room of one back."""
        self.pending -= 1


def build_app(place: ServedPlace, job: ServeJob) -> FastAPI:
    """Build the application.

    Args:
        place: The place, open.
        job: The settings of the server.
    """
    app = FastAPI(
        title=f"synfeal: {place.name}", version=synfeal.__version__, docs_url=None, redoc_url=None
    )
    if job.host in LOOPBACK:
        app.add_middleware(TrustedHostMiddleware, allowed_hosts=list(LOOPBACK))
    slots = Slots(place, job)
    page = page_of(place)
    answered = 0

    @app.get("/", response_class=HTMLResponse, include_in_schema=False)
    async def show_page() -> HTMLResponse:
        return HTMLResponse(page, headers=PAGE_HEADERS)

    @app.get("/health")
    async def health() -> Health:
        return Health(
            status="ok",
            place=place.name,
            world=place.world,
            frames=len(place.map),
            features=len(place.map.features.slope),
            renderings=place.has_renderings,
            answered=answered,
            pending=slots.pending,
        )

    @app.post("/localize", response_model=Answer, responses=REFUSALS, openapi_extra=REQUEST)
    async def localize(request: Request) -> Response:
        nonlocal answered
        body = Body(request, job.most_bytes)
        try:
            name, found = await _found(request, body, slots, place)
        except (Refusal, InputError) as error:
            await body.drain()
            return _refused(error)
        except ClientDisconnect:
            return Response(status_code=GONE)
        answered += 1
        return JSONResponse(answer_of(found, name, place))

    @app.exception_handler(HTTPException)
    async def refuse(_: Request, error: HTTPException) -> Response:
        return _problem(error.status_code, str(error.detail), dict(error.headers or {}))

    @app.exception_handler(Exception)
    async def fail(_: Request, __: Exception) -> Response:  # uvicorn logs it with its traceback
        return _problem(500, "a fault of the server, which is in its log")

    return app


async def _found(
    request: Request, body: Body, slots: Slots, place: ServedPlace
) -> tuple[str, Found]:
    """Localize the photograph of a request; return its name and where it was taken.

    Raises:
        Refusal: It is not served.
        InputError: The photograph cannot be used.
        ClientDisconnect: Whoever asked is gone.
    """
    slots.take()
    try:
        upload = await read_upload(request, body)
        work = place.submit(upload)
    except BaseException:
        slots.give()
        raise
    name = upload.name
    del upload  # a photograph that waits is kept once
    answer = asyncio.wrap_future(work)
    answer.add_done_callback(partial(_done, slots))
    return name, await _unless_gone(request, work, answer)


def _done(slots: Slots, answer: asyncio.Future[Found]) -> None:
    slots.give()
    if not answer.cancelled():
        answer.exception()  # asked for, so that asyncio reports none that nobody waits for


async def _unless_gone(
    request: Request, work: Future[Found], answer: asyncio.Future[Found]
) -> Found:
    """Wait for an answer; do not begin the work if whoever asked has gone meanwhile.

    Raises:
        ClientDisconnect: They have.
    """
    gone = asyncio.ensure_future(_disconnected(request))
    try:
        either: set[asyncio.Future[Any]] = {answer, gone}
        await asyncio.wait(either, return_when=asyncio.FIRST_COMPLETED)
        if not answer.done():
            work.cancel()
            raise ClientDisconnect
        return answer.result()
    finally:
        gone.cancel()


async def _disconnected(request: Request) -> None:
    while (await request.receive())["type"] != "http.disconnect":
        pass


def _refused(error: Refusal | InputError) -> Response:
    if isinstance(error, InputError):
        return _problem(422, str(error))
    headers = {} if error.retry_after_s is None else {"Retry-After": str(error.retry_after_s)}
    return _problem(error.status, error.reason, headers)


def _problem(status: int, reason: str, headers: dict[str, str] | None = None) -> Response:
    line = str(InputError(reason))  # one line of what can be printed
    return JSONResponse({"error": line}, status, headers)
