"""The one OpenGL context of this process.

Renderers share it and hold it current only while they draw, so that other users of OpenGL in the
process, such as pyrender, find their own.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable, Iterator
from typing import Any

from synfeal.errors import InputError

# Named in full: searching for them starts a compiler or ldconfig, which a container may lack.
EGL_LIBRARY = "libEGL.so.1"
GL_LIBRARIES = ("libGL.so.1", "libOpenGL.so.0")
MOST_DEVICES = 8
GL_VERSION = 330


@functools.cache
def shared_context() -> Any:
    """A moderngl context on the first EGL device that gives one; not current on return.

    Raises:
        InputError: moderngl or EGL is missing, or no device works.
    """
    try:
        context = _first_that_opens(list(_attempts()))
    except Exception as error:  # what is missing decides what is raised
        raise InputError(
            f"opengl needs moderngl and EGL ({type(error).__name__}: {error});"
            " pip install moderngl, and on Debian and Ubuntu: apt install libegl1 libgl1"
            " libgl1-mesa-dri"
        ) from error
    context.__exit__(None, None, None)
    return context


def _attempts() -> Iterator[Callable[[], Any]]:
    """Ways to make a context, in the order in which they are tried."""
    import moderngl

    for device in range(MOST_DEVICES):
        for library in GL_LIBRARIES:
            egl: dict[str, Any] = {"backend": "egl", "libegl": EGL_LIBRARY, "libgl": library}
            egl |= {"device_index": device, "require": GL_VERSION, "standalone": True}
            yield functools.partial(moderngl.create_context, **egl)


def _first_that_opens(attempts: list[Callable[[], Any]]) -> Any:
    """What the first attempt that does not raise returns; the first error where all raise."""
    errors = []
    for attempt in attempts:
        try:
            return attempt()
        except Exception as error:
            errors.append(error)
    raise errors[0]


@functools.cache
def finish() -> Callable[[], None]:
    """``glFinish`` of the current context, which lets other Python threads run while it waits.

    moderngl's own calls hold the interpreter for the whole frame, and threads that compress images
    starve meanwhile.
    """
    address_of = ctypes.CDLL(EGL_LIBRARY).eglGetProcAddress
    address_of.restype = ctypes.c_void_p
    return ctypes.CFUNCTYPE(None)(address_of(b"glFinish"))
