"""Choice of the backend: failures are injected, and one process really cannot load EGL."""

import importlib
import logging
import os
import subprocess
import sys

import numpy as np
import pytest

from synfeal.config.dataset import RenderConfig
from synfeal.errors import InputError
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.render import choose, open_renderer
from synfeal.render.base import UnavailableError, pieces
from tests.support.small_room import (
    BACKENDS,
    LOOK_ALONG_X,
    PYOPENGL_WARNS,
    camera_of,
    colored,
    facing_quad,
)

pytestmark = pytest.mark.filterwarnings(PYOPENGL_WARNS)

GREEN = TexturedMesh((facing_quad(2.0, 9.0, base_color=colored((0, 255, 0))),))


@pytest.fixture(autouse=True)
def forget():
    """Forget after each test what worked in this process."""
    yield
    choose.why_not.cache_clear()
    choose.fastest_working.cache_clear()


@pytest.fixture
def fresh(forget):
    choose.why_not.cache_clear()
    choose.fastest_working.cache_clear()


def seen(backend="auto"):
    with open_renderer(GREEN, camera_of(), RenderConfig(backend=backend)) as renderer:
        assert (renderer.render(LOOK_ALONG_X) == [0, 255, 0]).all()
        return type(renderer).__name__


@pytest.mark.parametrize("name", BACKENDS)
def test_a_backend_may_be_named(name):
    assert seen(name).lower() == f"{name}renderer"


@pytest.mark.usefixtures("fresh")
def test_auto_takes_the_first_and_says_so_once(caplog):
    caplog.set_level(logging.INFO, "synfeal")
    assert seen().lower() == f"{BACKENDS[0]}renderer"
    seen()
    told = [record for record in caplog.records if record.levelno == logging.INFO]
    assert len(told) == 1
    assert BACKENDS[0] in told[0].getMessage()
    if BACKENDS[0] == "opengl":
        assert len(caplog.records) == 1


def no_library(*_, **__):
    raise ImportError("libEGL.so.1 not loaded")


def no_device(*_, **__):
    raise UnavailableError("requested device index 0,\nbut found 0 devices")


def black(*_, **__):
    class Black:
        def render_rgbd(self, _):
            return np.zeros((16, 16, 3), np.uint8), np.ones((16, 16), np.float32)

        def __enter__(self):
            return self

        def __exit__(self, *_): ...

    return Black()


@pytest.mark.usefixtures("fresh")
@pytest.mark.parametrize(
    ("broken", "said"),
    [
        (no_library, "here: libEGL.so.1 not loaded; pip install moderngl"),
        (no_device, "here: requested device index 0, but found 0 devices; pip"),
        (black, "it draws a red square wrongly"),
    ],
)
def test_auto_falls_back_with_one_warning(broken, said, monkeypatch, caplog):
    monkeypatch.setitem(choose.BACKENDS, "opengl", broken)
    assert seen() != "OpenglRenderer"
    seen()
    warnings = [r.getMessage() for r in caplog.records if r.levelno == logging.WARNING]
    opengl_warnings = [line for line in warnings if "opengl does not work here" in line]
    assert len(opengl_warnings) == 1
    assert said in opengl_warnings[0]
    assert "\n" not in opengl_warnings[0]


@pytest.mark.usefixtures("fresh")
@pytest.mark.parametrize("broken", [MemoryError, AttributeError, TypeError])
def test_a_lack_of_memory_and_faults_of_the_program_are_no_missing_driver(broken, monkeypatch):
    def fail(*_, **__):
        raise broken("of something else")

    monkeypatch.setitem(choose.BACKENDS, "opengl", fail)
    with pytest.raises(broken, match="of something else"):
        seen()


CONTEXTS = {
    "opengl": ("shared_context", "moderngl.create_context", Exception),  # as glcontext raises it
    "pyrender": ("_context", "egl.get_device_by_index", ValueError),
}


def break_context(name, broken, monkeypatch):
    """Have the context of a backend made anew, which raises ``broken``."""
    if name not in BACKENDS:
        pytest.skip(f"{name} does not work here anyway")

    def fail(*_, **__):
        raise broken("requested device index 0,\nbut found 0 devices")

    context, opens, _ = CONTEXTS[name]
    module = importlib.import_module(f"synfeal.render.{name}_backend")
    monkeypatch.setattr(f"{module.__name__}.{opens}", fail)
    monkeypatch.setattr(module, context, getattr(module, context).__wrapped__)


@pytest.mark.usefixtures("fresh")
@pytest.mark.parametrize("name", CONTEXTS)
@pytest.mark.parametrize("broken", [MemoryError, AttributeError])
def test_what_breaks_while_a_context_is_made_is_raised_as_what_it_is(name, broken, monkeypatch):
    break_context(name, broken, monkeypatch)
    with pytest.raises(broken):
        seen(name)


@pytest.mark.usefixtures("fresh")
@pytest.mark.parametrize("name", CONTEXTS)
def test_a_context_that_cannot_be_made_names_the_packages(name, monkeypatch):
    break_context(name, CONTEXTS[name][2], monkeypatch)
    assert seen() == ("OpenglRenderer" if name == "pyrender" else "PyrenderRenderer")
    with pytest.raises(
        InputError, match=rf"backend: {name} does not .*found 0 devices.*libegl1 libgl1 libgl1-mesa"
    ):
        seen(name)


@pytest.mark.usefixtures("fresh")
def test_when_nothing_works_all_of_it_is_named(monkeypatch):
    for name in choose.BACKENDS:
        monkeypatch.setitem(choose.BACKENDS, name, no_device)
    with pytest.raises(InputError) as raised:
        seen()
    for name in choose.BACKENDS:
        assert f"{name}: requested device" in str(raised.value)


DRAW = """
import logging
logging.basicConfig(format="%(levelname)s %(message)s")
from tests.synfeal.test_render_choose import seen, InputError
print(seen())
for name in ("opengl", "pyrender"):
    try:
        seen(name)
    except InputError as error:
        print(error)
"""


@pytest.mark.parametrize("lacking", ["library", "driver"])
def test_a_process_without_egl_still_draws(lacking, tmp_path):
    """Once libEGL cannot be loaded, once it finds no driver."""
    (tmp_path / "libEGL.so.1").write_bytes(b"no library")
    places = {
        "library": {"LD_LIBRARY_PATH": str(tmp_path)},
        "driver": {"__EGL_VENDOR_LIBRARY_DIRS": str(tmp_path)},
    }
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", DRAW],
        env={**os.environ, **places[lacking]},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    name, opengl_error, pyrender_error = done.stdout.splitlines()
    assert name == "RaycastRenderer"
    for backend, error in (("opengl", opengl_error), ("pyrender", pyrender_error)):
        assert f"backend: {backend} does not work here" in error
        assert "libegl1" in error
        assert f"WARNING backend: {backend} does not work here" in done.stderr


def test_parts_with_too_many_vertices_are_drawn_in_pieces():
    rng = np.random.default_rng(0)
    vertices = rng.normal(size=(300, 3))
    faces = rng.integers(0, 300, (500, 3))
    uv, rgb = rng.random((300, 2)), rng.integers(0, 255, (300, 3), np.uint8)
    part = MeshPart("part", vertices, faces, uv, vertex_rgb=rgb)
    split = list(pieces(part, most_vertices=90))
    assert max(len(piece.vertices_m) for piece in split) <= 90
    for name, whole in (("vertices_m", vertices), ("uv", uv), ("vertex_rgb", rgb)):
        corners = np.concatenate([getattr(piece, name)[piece.faces] for piece in split])
        np.testing.assert_array_equal(corners, whole[faces])
    assert list(pieces(part, most_vertices=300)) == [part]


WITHOUT_X = """
import sys
sys.modules["pyglet"] = None  # as where X's libraries are missing: it does not load
from synfeal.render.choose import why_not
failure = why_not("pyrender")
assert failure is None, failure
assert "pyrender.viewer" not in sys.modules
"""


def test_pyrender_draws_without_the_libraries_of_its_viewer():
    command = [sys.executable, "-c", WITHOUT_X]
    process = subprocess.run(command, env=os.environ, check=False, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
