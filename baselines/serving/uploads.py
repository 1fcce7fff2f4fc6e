"""Requests to localize a photograph, read into memory within limits."""

from __future__ import annotations

import asyncio
import math
from collections.abc import AsyncIterator, Mapping
from contextlib import suppress
from dataclasses import dataclass

from starlette.datastructures import FormData, UploadFile
from starlette.formparsers import MultiPartException, MultiPartParser
from starlette.requests import ClientDisconnect, Request

IMAGE, CAMERA, FOCAL, EXIF, RENDERING = "image", "camera", "focal_px", "exif", "rendering"
FIELDS = (IMAGE, CAMERA, FOCAL, EXIF, RENDERING)
SWITCHES = {"true": True, "1": True, "false": False, "0": False}
FORM, PLAIN = "multipart/form-data", "application/octet-stream"
HOW = f"send it as field `{IMAGE}` of {FORM}, or alone as image/jpeg or image/png"
MOST_CAMERA_BYTES = 2**16  # of a calibration; YAML takes long to parse
# Beginnings of JPEG and PNG files; of HEIF what follows the length of its first box.
JPEG, PNG, HEIF = b"\xff\xd8\xff", b"\x89PNG\r\n\x1a\n", b"ftyp"
# Who sends more than is read is answered once the rest has come, because many clients listen only
# then; not if it is many times as much, or takes long.
DRAINED, DRAIN_S = 4, 10.0
RECEIVE_S = 60.0  # for a request to come in


class Refusal(Exception):  # noqa: N818 (the server is right)
    """A request that is not served.

    Attributes:
        status: Of HTTP.
        reason: One line for whoever asked.
        retry_after_s: Seconds after which the same may be served; None where it never is.
    """

    def __init__(self, status: int, reason: str, retry_after_s: int | None = None) -> None:
        super().__init__(status, reason)
        self.status, self.reason, self.retry_after_s = status, reason, retry_after_s


@dataclass(frozen=True)
class Upload:
    """A photograph to localize.

    Attributes:
        name: Its name in messages.
        content: Its bytes.
        camera: Name and bytes of a calibration file, in place of the server's.
        focal_px: Focal length in its pixels, in place of a calibration.
        exif: Read the focal length from EXIF if neither is given; None: as the server does.
        rendering: Draw what the map shows from the pose that is found.
    """

    name: str
    content: bytes
    camera: tuple[str, bytes] | None = None
    focal_px: float | None = None
    exif: bool | None = None
    rendering: bool = False


class Body:
    """The body of a request, of which no more than a limit is read.

    Args:
        request: The request.
        most_bytes: The limit.
    """

    def __init__(self, request: Request, most_bytes: int) -> None:
        self._chunks = aiter(request.stream())
        self._most_bytes = most_bytes
        self._announced = _length(request)
        self._read = 0

    async def chunks(self) -> AsyncIterator[bytes]:
        """Yield the parts of the body.

        Raises:
            Refusal: It is too large, or does not come.
        """
        if self._announced is not None and self._announced > self._most_bytes:
            raise self._too_large()
        end_s = asyncio.get_running_loop().time() + RECEIVE_S
        try:
            while (chunk := await self._next(end_s)) is not None:
                if self._read > self._most_bytes:
                    raise self._too_large()
                yield chunk
        except TimeoutError as error:
            raise Refusal(408, f"the request did not come in within {RECEIVE_S:g} s") from error

    async def drain(self) -> None:
        """Take in what is left and drop it, within reason."""
        most = DRAINED * self._most_bytes
        if self._announced is not None and self._announced > most:
            return
        end_s = asyncio.get_running_loop().time() + DRAIN_S
        with suppress(TimeoutError, ClientDisconnect):
            while self._read <= most and await self._next(end_s) is not None:
                pass

    async def _next(self, end_s: float) -> bytes | None:
        """Return the next part, None after the last; the loop's clock tells when to give up."""
        async with asyncio.timeout_at(end_s):
            chunk = await anext(self._chunks, None)
        self._read += len(chunk or b"")
        return chunk

    def _too_large(self) -> Refusal:
        return Refusal(413, f"the request is larger than {self._most_bytes / 1e6:g} MB")


def _length(request: Request) -> int | None:
    value = request.headers.get("content-length", "")
    return int(value) if value.isdecimal() else None


class _InMemory(MultiPartParser):
    """A parser that writes no file: the body's limit is that of its parts, too."""

    spool_max_size = 2**62


async def read_upload(request: Request, body: Body) -> Upload:
    """Read a photograph, and what is said of it, from a request.

    Args:
        request: Multipart with the fields of ``FIELDS``, or the bytes of a photograph with the
            fields that are no files as parameters of the address.
        body: Its body.

    Raises:
        Refusal: It is none of these.
    """
    kind = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    if kind == FORM:
        return await _from_form(request, body)
    if not (kind == PLAIN or kind.startswith("image/")):
        raise Refusal(415, f"no photograph: the request is of type '{kind}'; {HOW}")
    fields = _known(request.query_params, FIELDS[2:])
    content = bytearray()
    async for chunk in body.chunks():
        content += chunk
    return _upload("photograph", bytes(content), None, fields)


async def _from_form(request: Request, body: Body) -> Upload:
    # The parser is declared to take a generator, of which it uses what every iterator has.
    parser = _InMemory(
        request.headers,
        body.chunks(),  # type: ignore[arg-type]
        max_files=2,
        max_fields=len(FIELDS),
        max_part_size=MOST_CAMERA_BYTES,
    )
    try:
        form = await parser.parse()
    except MultiPartException as error:
        raise Refusal(400, f"the form cannot be read ({error.message})") from error
    async with _closing(form):
        fields = _known(form, FIELDS)
        image = fields.pop(IMAGE, None)
        if not isinstance(image, UploadFile):
            raise Refusal(400, f"no photograph; {HOW}")
        camera = await _camera_of(fields.pop(CAMERA, None))
        name = image.filename or "photograph"
        return _upload(name, await image.read(), camera, fields)


class _closing:  # noqa: N801 (as contextlib's)
    """Closes the files of a form."""

    def __init__(self, form: FormData) -> None:
        self._form = form

    async def __aenter__(self) -> None:
        return None

    async def __aexit__(self, *_: object) -> None:
        await self._form.close()


def _known(given: Mapping[str, object], fields: tuple[str, ...]) -> dict[str, object]:
    """Return fields by name; refuse those that would have no effect."""
    for name in given:
        if name not in fields:
            raise Refusal(422, f"field '{name}' is not known, only {', '.join(fields)}")
    return dict(given)


async def _camera_of(field: object) -> tuple[str, bytes] | None:
    """Read a calibration that was sent as a file, or as the text of a JSON file."""
    if isinstance(field, UploadFile):
        content = await field.read(MOST_CAMERA_BYTES + 1)
        if len(content) > MOST_CAMERA_BYTES:
            raise Refusal(413, f"`{CAMERA}` is larger than {MOST_CAMERA_BYTES} bytes")
        return (field.filename or "camera.json", content) if content else None
    text = str(field or "").strip()
    return ("camera.json", text.encode()) if text else None


def _upload(
    name: str, content: bytes, camera: tuple[str, bytes] | None, fields: Mapping[str, object]
) -> Upload:
    _refuse_other_format(name, content)
    focal_px = _number(fields.get(FOCAL))
    if camera is not None and focal_px is not None:
        raise Refusal(422, f"{FOCAL}: the calibration of `{CAMERA}` has one; give one of the two")
    return Upload(
        name=name,
        content=content,
        camera=camera,
        focal_px=focal_px,
        exif=_switch(EXIF, fields.get(EXIF)),
        rendering=bool(_switch(RENDERING, fields.get(RENDERING))),
    )


def _refuse_other_format(name: str, content: bytes) -> None:
    if not content:
        raise Refusal(400, f"{name}: is empty; {HOW}")
    if not (content.startswith((JPEG, PNG)) or content[4:8] == HEIF):
        raise Refusal(415, f"{name}: is no JPEG, PNG or HEIC")


def _number(field: object) -> float | None:
    text = str(field or "").strip()
    if not text:
        return None
    try:
        value = float(text)
    except ValueError as error:
        raise Refusal(422, f"{FOCAL}: '{text}' is no number") from error
    if not (math.isfinite(value) and value > 0):
        raise Refusal(422, f"{FOCAL}: must be a positive number of pixels, found {text}")
    return value


def _switch(name: str, field: object) -> bool | None:
    text = str(field or "").strip().lower()
    if text and text not in SWITCHES:
        raise Refusal(422, f"{name}: must be true or false, found '{text}'")
    return SWITCHES.get(text)
