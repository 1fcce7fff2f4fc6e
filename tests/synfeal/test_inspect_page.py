"""The mesh in the page: small, in place, in its colours; the page: one file that draws."""

import base64
import json
import re
import shutil
import subprocess
from http.server import BaseHTTPRequestHandler, HTTPServer

import numpy as np
import pytest
import trimesh

from synfeal.inspection.surface import SurfacePoints, split_longest_edges, viewer_mesh
from synfeal.inspection.text import page_html
from synfeal.mesh.model import MeshPart, TexturedMesh
from tests.support.collected import painted

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
FLAGS = (
    *("--headless", "--no-sandbox", "--no-first-run", "--disable-quic"),
    "--disable-background-networking",
    *("--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
    *("--window-size=600,800", "--enable-logging=stderr", "--remote-debugging-port=0"),
)
# Carries out actions one by one; after each, the shares of colours on the canvas.
PROBE = """
function shares() {
  const copy = document.createElement("canvas");
  [copy.width, copy.height] = [canvas.width, canvas.height];
  const context = copy.getContext("2d"), found = { red: 0, green: 0, blue: 0 };
  if (viewer) context.drawImage(canvas, 0, 0);
  const data = context.getImageData(0, 0, copy.width, copy.height).data;
  for (let i = 0; i < data.length; i += 4) {
    const [r, g, b] = data.slice(i, i + 3);
    const name = r > 2 * g && r > 2 * b ? "red" : g > 2 * r ? "green" : b > 2 * r ? "blue" : null;
    if (name) found[name] += 1 / (copy.width * copy.height);
  }
  return found;
}
function set(name, property, value, event) {
  document.getElementById(name)[property] = value;
  document.getElementById(name).dispatchEvent(new Event(event));
}
function key(name) {
  for (let i = 0; i < 60; i++) canvas.dispatchEvent(new KeyboardEvent("keydown", { key: name }));
}
function drag(dy) {
  canvas.setPointerCapture = () => {};  // refuses pointers that no hand moves
  for (const [name, clientY] of [["pointerdown", 0], ["pointermove", dy], ["pointerup", dy]]) {
    canvas.dispatchEvent(new PointerEvent(name, { pointerId: 1, clientX: 0, clientY, buttons: 1 }));
  }
}
(async () => {
  // A headless window may change its size once after loading; what was drawn before is gone then.
  await new Promise((done) => setTimeout(done, 1000));
  const found = [];
  for (const act of [ACTIONS]) {
    act();
    viewer?.setBackFaces(document.getElementById("backs").checked);  // draws anew
    await new Promise((done) => requestAnimationFrame(done));
    found.push(shares());
  }
  fetch("REPLY", { method: "POST", mode: "no-cors", body: JSON.stringify(found) });
})();
"""


def colored_box(rgb, *, inwards):
    box = trimesh.creation.box((4.0, 3.0, 2.0)).apply_translation([100.0] * 3)
    return painted(box, rgb, inwards=inwards)


def small_copy(mesh):
    return viewer_mesh(mesh, SurfacePoints.of(mesh, np.random.default_rng(0), 20_000))


def corners_m(copy):
    return (copy.offset_m + copy.step_m * copy.positions)[copy.faces]


def area_m2(corners):
    a, b, c = np.moveaxis(corners, 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2.0)


def test_the_copy_lies_where_the_mesh_does_in_its_colours_without_what_is_cut_out():
    mesh = colored_box((200, 10, 20), inwards=False)
    copy = small_copy(mesh)
    corners = corners_m(copy)
    np.testing.assert_allclose(corners.min(axis=(0, 1)), mesh.bounds_m[0], atol=1e-3)
    np.testing.assert_allclose(corners.max(axis=(0, 1)), mesh.bounds_m[1], atol=1e-3)
    assert area_m2(corners) == pytest.approx(2 * (12 + 8 + 6), rel=1e-3)
    assert 1000 < len(copy.faces) <= 60_000
    assert (copy.rgb == [200, 10, 20]).all()
    front = trimesh.creation.box((4.0, 0.02, 3.0))
    side = np.asarray(front.face_normals)[:, 1]
    parts = []
    for sign, rgb in ((1, (255, 0, 0)), (-1, (0, 0, 255))):
        faces, color = front.faces[side * sign > 0.5], np.array([*rgb, 255], np.uint8)
        parts.append(MeshPart("side", np.asarray(front.vertices), faces, base_color=color))
    copy = small_copy(TexturedMesh(tuple(parts)))
    y = copy.positions[:, 1]
    assert (copy.rgb[y > 0] == [255, 0, 0]).all()
    assert (copy.rgb[y < 0] == [0, 0, 255]).all()
    uv = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    texture = np.full((8, 8, 4), 255, np.uint8)
    texture[:, 4:, 3] = 0
    corners = np.column_stack([4.0 * uv, np.zeros(4)])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    part = MeshPart("leaf", corners, faces, uv, texture, alpha_cutoff=0.5)
    assert area_m2(corners_m(small_copy(TexturedMesh((part,))))) == pytest.approx(8.0, rel=0.02)


def test_corners_that_simplification_moves_out_of_the_mesh_stay_where_they_are(monkeypatch):
    monkeypatch.setattr("synfeal.inspection.surface.SIMPLIFY_ABOVE", 16)
    sphere = trimesh.creation.icosphere(3, radius=2.0)
    part = MeshPart("ball", np.asarray(sphere.vertices), np.asarray(sphere.faces))
    reach_m = np.abs(corners_m(small_copy(TexturedMesh((part,))))).max(axis=(0, 1))
    assert reach_m.max() > 2.05  # farther out than whole numbers of 16 bits were made to reach
    # As much volume as the ball needs a polyhedron of few sides to stick out, but not far.
    assert reach_m.max() < 3.0


def test_large_meshes_keep_their_shape():
    sphere = trimesh.creation.icosphere(6, radius=2.0)  # 81,920 faces
    rgb = np.where(sphere.vertices[:, 2:] > 0, [255, 0, 0], [0, 0, 255]).astype(np.uint8)
    part = MeshPart("ball", np.asarray(sphere.vertices), np.asarray(sphere.faces), vertex_rgb=rgb)
    copy = small_copy(TexturedMesh((part,)))
    assert len(copy.faces) <= 60_000
    points = copy.offset_m + copy.step_m * copy.positions
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 2.0, atol=0.01)
    assert (copy.rgb[points[:, 2] > 0.2] == [255, 0, 0]).all()
    assert (copy.rgb[points[:, 2] < -0.2] == [0, 0, 255]).all()


def test_splitting_keeps_the_surface_and_the_limits():
    corners = np.random.default_rng(0).normal(size=(7, 3, 3))
    split = split_longest_edges(corners, 500, 0.0)
    assert len(split) == 500
    assert area_m2(split) == pytest.approx(area_m2(corners))
    coarse = split_longest_edges(corners, 10**6, 1.0)
    edges = np.linalg.norm(np.roll(coarse, -1, axis=1) - coarse, axis=2)
    assert edges.max() <= 1.0
    total = [np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0]).sum(axis=0) for t in (corners, coarse)]
    np.testing.assert_allclose(*total, atol=1e-12)  # every triangle still faces the same way


def page_of(mesh, lines):
    sections = [("<b>", [("a & b", "</script><script>alert(1)</script>")])]
    scene = small_copy(mesh).scene(lines)
    return page_html("a <mesh>", ["look & see"], sections, "x: {y: [1, 2]}", b"png", scene)


def test_the_page_needs_nothing_else_and_escapes_what_it_shows():
    line = np.array([[99.0, 100, 100], [101, 100, 100]])
    page = page_of(colored_box((1, 2, 3), inwards=True), [(line, (0, 255, 0))])
    assert not re.findall(r"https?://|@import|url\(|<link|src=\"(?!data:)", page)
    assert "default-src 'none'" in page
    assert "a &lt;mesh&gt;" in page
    assert page.count("</script>") == 2  # the mesh and the viewer
    found = re.search(r'<script id="scene" type="application/json">(.*?)</script>', page)
    scene = json.loads(found[1])
    assert scene["polylines"] == [{"points": line.tolist(), "color": [0, 255, 0]}]
    positions = np.frombuffer(base64.b64decode(scene["positions"]), "<i2").reshape(-1, 3)
    faces = np.frombuffer(base64.b64decode(scene["faces"]), "<u4")
    assert faces.max() == len(positions) - 1
    assert len(base64.b64decode(scene["colors"])) == 3 * len(positions)


class Reply(HTTPServer):
    """Waits for what one page has to say, however long its browser takes."""

    body, timeout = None, 200.0  # seconds, on a machine with much else to do

    class RequestHandlerClass(BaseHTTPRequestHandler):
        def do_POST(self):
            length = int(self.headers["Content-Length"])
            self.server.body = self.rfile.read(length)
            self.send_response(204)
            self.end_headers()

        def log_message(self, *_):
            pass

    def __init__(self):
        super().__init__(("127.0.0.1", 0), self.RequestHandlerClass)


def answer(page, folder, script):
    """Return what a script at the end of a page sends to ``REPLY``, and the console's lines."""
    head, _, tail = page.rpartition("</script>")
    path, profile = folder / "page.html", f"--user-data-dir={folder / 'profile'}"
    with Reply() as reply:
        address = f"http://127.0.0.1:{reply.server_port}/"
        head = head.replace("default-src 'none'", f"default-src 'none'; connect-src {address}")
        text = f"{head}{script.replace('REPLY', address)}</script>{tail}"
        path.write_text(text, encoding="utf-8")
        command = [CHROMIUM, *FLAGS, profile, path.as_uri()]
        pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
        browser = subprocess.Popen(command, **pipes, text=True)
        reply.handle_request()
        browser.terminate()
        _, said = browser.communicate(timeout=100)
    assert reply.body is not None, said
    return json.loads(reply.body), [line for line in said.splitlines() if "CONSOLE" in line]


def drawn(page, folder, *actions):
    """Shares of colours on the canvas after each action."""
    named = ", ".join(f"() => {{ {action} }}" for action in actions)
    found, console = answer(page, folder, PROBE.replace("ACTIONS", named))
    assert "rror" not in "\n".join(console)
    return found


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_a_room_is_looked_into_through_its_near_walls(tmp_path):
    line = np.array([[98.5, 98.8, 99.6], [101.5, 101.2, 99.6]])
    page = page_of(colored_box((255, 0, 0), inwards=True), [(line, (0, 255, 0))])
    culled, whole = drawn(page, tmp_path, "", "set('backs', 'checked', true, 'change')")
    assert culled["red"] > 0.1
    assert culled["green"] > 1e-4  # the line inside is seen: the near walls are not drawn
    assert whole["red"] >= culled["red"]
    assert whole["green"] == 0.0


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_the_view_is_turned_zoomed_and_cut(tmp_path):
    box = trimesh.creation.box((4.0, 4.0, 1.0))
    rgb = np.where(box.vertices[:, 2:] > 0, [0, 0, 255], [255, 0, 0]).astype(np.uint8)
    inwards = np.asarray(box.faces)[:, ::-1]
    mesh = TexturedMesh((MeshPart("room", np.asarray(box.vertices), inwards, vertex_rgb=rgb),))
    zoom_out = "canvas.dispatchEvent(new WheelEvent('wheel', { deltaY: 900 }))"
    above, below, top, dragged, home, far, cut = drawn(
        page_of(mesh, []),
        tmp_path,
        *("", "key('ArrowDown')", "key('ArrowUp')", "drag(-900)", "key('Home')", zoom_out),
        "set('cut', 'value', 0, 'input')",
    )
    assert above["red"] > above["blue"]  # a red floor, a blue ceiling
    assert below["blue"] > below["red"]
    assert top["red"] > top["blue"]
    assert dragged["blue"] > dragged["red"]
    assert home == above
    assert 0.05 < far["red"] < home["red"]
    assert cut["red"] + cut["blue"] < far["red"] + far["blue"]


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium")
def test_without_webgl_the_page_says_so(tmp_path):
    page = page_of(colored_box((255, 0, 0), inwards=True), [])
    page = page.replace('getContext("webgl2"', 'getContext("none"')
    check = "if (!{}('fallback').offsetHeight || {}('view').offsetHeight) throw new Error('hidden')"
    check = check.replace("{}", "document.getElementById")
    (shares,) = drawn(page, tmp_path, check)
    assert shares == {"red": 0, "green": 0, "blue": 0}
