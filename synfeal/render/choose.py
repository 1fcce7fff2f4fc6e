"""Choice of the backend: the one named, or the fastest that works on this machine.

A backend works when it draws a red square red; libraries that load and draw nothing do not count.
"""

from __future__ import annotations

import functools
import logging
import sys
from collections.abc import Callable
from pkgutil import resolve_name

import numpy as np

from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.errors import Argument, InputError
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.render.base import Renderer, UnavailableError

log = logging.getLogger("synfeal")
Opener = Callable[[TexturedMesh, CameraConfig, RenderConfig], Renderer]
EGL_PACKAGES = "on Debian and Ubuntu: apt install libegl1 libgl1 libgl1-mesa-dri"


def _opener(place: str) -> Opener:
    """Return the class at ``module:name``, loaded when called: backends take up to a second."""
    return lambda mesh, camera, render: resolve_name(place)(mesh, camera, render)


# Fastest first; results/benchmarks/rendering.md says by how much.
BACKENDS: dict[str, Opener] = {
    "opengl": _opener("synfeal.render.opengl_backend:OpenglRenderer"),
    "pyrender": _opener("synfeal.render.pyrender_backend:PyrenderRenderer"),
    "raycast": _opener("synfeal.render.raycast_backend:RaycastRenderer"),
}
INSTALL = {
    "opengl": f"pip install moderngl; {EGL_PACKAGES}",
    "pyrender": f"pip install pyrender; {EGL_PACKAGES}",
    "raycast": "pip install embreex",
}


def open_renderer(
    mesh: TexturedMesh, camera: CameraConfig, render: RenderConfig | None = None
) -> Renderer:
    """Open a renderer as a context manager.

    Args:
        mesh: What is drawn.
        camera: Camera of any model, with or without distortion.
        render: Backend and settings; None for the defaults.

    Raises:
        InputError: The backend named in ``render`` does not work on this machine, or none does.
    """
    if camera.projection is not None:
        from synfeal.render.cube import CubeRenderer  # loads SciPy: only when needed

        background = (render or RenderConfig()).background_rgb
        return CubeRenderer(lambda face: open_renderer(mesh, face, render), camera, background)
    if any(camera.distortion):
        from synfeal.render.distorted import DistortedRenderer  # loads SciPy: only when needed

        return DistortedRenderer(lambda pinhole: open_renderer(mesh, pinhole, render), camera)
    render = render or RenderConfig()
    name = fastest_working() if render.backend == "auto" else render.backend
    failure = why_not(name)
    if failure is not None:
        raise InputError(
            Argument("backend"), f"{render.backend} does not work here: {failure}", "or choose auto"
        )
    return BACKENDS[name](mesh, camera, render)


@functools.cache
def fastest_working() -> str:
    """Return the fastest backend that works here; log its name, and warn of faster ones that fail.

    Raises:
        InputError: none works.
    """
    failures = []
    for name in BACKENDS:
        failure = why_not(name)
        if failure is None:
            log.info("rendering with %s, the fastest backend that works here", name)
            return name
        log.warning("backend: %s does not work here: %s", name, failure)
        failures.append(f"{name}: {failure}")
    raise InputError(Argument("backend"), f"no renderer works here: {'; '.join(failures)}")


@functools.cache
def why_not(name: str) -> str | None:
    """Say why a backend does not draw on this machine and what to install; None if it does."""
    try:
        with BACKENDS[name](_red_square(), CameraConfig(width=16, height=16), RenderConfig()) as r:
            rgb, depth_m = r.render_rgbd(_FACING)
    except InputError as error:
        return str(error)
    except _errors_of_a_machine() as error:
        log.debug("backend: %s does not work here", name, exc_info=True)
        return " ".join(f"{error}; {INSTALL[name]}".split())
    if (rgb != [255, 0, 0]).any() or not np.allclose(depth_m, 1.0, atol=1e-3):
        return "it draws a red square wrongly"
    return None


def _errors_of_a_machine() -> tuple[type[Exception], ...]:
    """List what is raised where a library, driver or device is missing, or refuses to draw."""
    libraries = [sys.modules[name] for name in ("moderngl", "OpenGL.error") if name in sys.modules]
    return (ImportError, OSError, UnavailableError, *(library.Error for library in libraries))


def graphics(backend: str) -> dict[str, str]:
    """Describe what draws on this machine, for the records of frames.

    Args:
        backend: Name of a backend, or ``auto``.

    Returns:
        ``backend``, never ``auto``; where it draws with OpenGL, ``gl_vendor``, ``gl_renderer`` and
        ``gl_version`` of the driver as it names them.
    """
    name = fastest_working() if backend == "auto" else backend
    if name == "raycast" or why_not("opengl") is not None:
        return {"backend": name}
    from synfeal.render.opengl_backend import shared_context

    with shared_context() as context:
        info = context.info
    keys = ("GL_VENDOR", "GL_RENDERER", "GL_VERSION")
    return {"backend": name, **{key.lower(): str(info[key]) for key in keys}}


# Looks along world x, upright.
_FACING = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])


def _red_square() -> TexturedMesh:
    """Build a square that fills the image of a camera at the origin, 1 m ahead along x."""
    corners = np.array([[1.0, 9, -9], [1, -9, -9], [1, -9, 9], [1, 9, 9]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    red = np.array([255, 0, 0, 255], np.uint8)
    return TexturedMesh((MeshPart("square", corners, faces, base_color=red),))
