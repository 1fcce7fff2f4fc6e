"""``synfeal serve``: a real client and a real server, of a room that is built for it."""

from __future__ import annotations

import base64
import csv
import http.client
import io
import json
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from PIL import ExifTags, Image

pytest.importorskip("fastapi")

from baselines.serving.job import ServeJob
from baselines.serving.place import ServedPlace
from baselines.serving.plan import upright_from_map
from baselines.serving.run import listening
from baselines.serving.server import server_of
from synfeal.camera.photograph import PhotographCamera
from synfeal.cli import main
from synfeal.config.dataset import CameraConfig, RenderConfig
from synfeal.errors import InputError
from synfeal.geometry.poses import pose_error, pose_from_quat
from synfeal.mesh.save import save_glb
from synfeal.render.choose import open_renderer
from tests.support.collected import refused
from tests.support.small_room import SIZE_M, furnished_room, room_poses

PHOTO = CameraConfig(width=320, height=240, horizontal_fov_deg=64.0)
FOCAL_PX = PHOTO.intrinsics.fx
PAINT = (4.0, 12.0, 40.0)
N_PHOTOS = 4
MEGABYTE = 10**6


def photographs(folder, seed, poses):
    """Write photographs of a room of some paint, one of them with a focal length in its EXIF."""
    folder.mkdir()
    with open_renderer(furnished_room(PAINT, seed), PHOTO, RenderConfig()) as renderer:
        for number, pose in enumerate(poses):
            Image.fromarray(renderer.render(pose)).save(folder / f"{number}.png")
    return sorted(folder.iterdir())


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    """A place built of a mesh, photographs of it and of another, and what `localize` says."""
    folder = tmp_path_factory.mktemp("serving")
    save_glb(folder / "room.glb", furnished_room(PAINT))
    build = ["build", folder / "room.glb", "--out", folder / "place"]
    assert main([*map(str, build), "--frames", "40", "--width", "200"]) == 0
    photographs(folder / "photos", 0, room_poses(N_PHOTOS, 5))
    photographs(folder / "elsewhere", 7, room_poses(N_PHOTOS, 6))
    out = folder / "poses.csv"
    words = ["localize", folder / "place", folder / "photos", "--focal", FOCAL_PX, "--out", out]
    assert main(list(map(str, words))) == 0
    return folder


@pytest.fixture(scope="module")
def localized(room):
    """Rows that `synfeal localize` wrote, by the names of the photographs."""
    with (room / "poses.csv").open(newline="") as file:
        return {Path(row["image"]).name: row for row in csv.DictReader(file)}


@contextmanager
def running(place, job):
    """Serve a place in a thread; yield the port."""
    with listening("127.0.0.1", 0) as listener:
        server = server_of(place, job)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        try:
            yield listener.getsockname()[1]
        finally:
            server.should_exit = True
            thread.join()


def job_of(room, **values):
    camera = PhotographCamera(exif=True)
    return ServeJob(room / "place", camera, **{"megabytes": 1, "megapixels": 1, **values})


@pytest.fixture(scope="module")
def opened(room):
    """The room in memory, two photographs at once."""
    with ServedPlace(job_of(room, cores=2)) as place:
        yield place


@pytest.fixture(scope="module")
def served(room, opened):
    """The port at which the room is served."""
    with running(opened, job_of(room, cores=2)) as port:
        yield port


def ask(port, method, path, body=None, headers=None):
    """Return status, headers and body of an answer."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    try:
        connection.request(method, path, body, headers or {})
        answer = connection.getresponse()
        return answer.status, answer.headers, answer.read()
    finally:
        connection.close()


def form_of(fields):
    """Encode fields as multipart; files are pairs of a name and bytes."""
    lines = []
    for name, value in fields.items():
        is_file = isinstance(value, tuple)
        file = f'; filename="{value[0]}"' if is_file else ""
        lines.append(
            f'--edge\r\nContent-Disposition: form-data; name="{name}"{file}\r\n\r\n'.encode()
        )
        lines.append((value[1] if is_file else str(value).encode()) + b"\r\n")
    return b"".join([*lines, b"--edge--\r\n"])


FORM = {"Content-Type": "multipart/form-data; boundary=edge"}


def post(port, photo, **fields):
    """Send a photograph; return the status and what the JSON holds."""
    body = form_of({"image": (photo.name, photo.read_bytes()), **fields})
    status, _, answer = ask(port, "POST", "/localize", body, FORM)
    return status, json.loads(answer)


def world_from_cam(answer):
    position, quaternion = answer["pose"]["position"], answer["pose"]["quaternion"]
    return pose_from_quat([position[a] for a in "xyz"], [quaternion[a] for a in "wxyz"])


def check_same(answer, row):
    """An answer has every value that `localize` wrote, to the last digit."""
    assert answer["status"] == row["status"]
    values = {key: row[key] for key in row if key not in ("image", "status")}
    for key in ("tx", "ty", "tz", "qw", "qx", "qy", "qz"):
        cell = values.pop(key)
        part = {"t": "position", "q": "quaternion"}[key[0]]
        found = answer["pose"] and answer["pose"][part][key[1]]
        assert found == (float(cell) if cell else None)
    for key, cell in values.items():
        assert answer[key] == (float(cell) if cell else None), key


def test_answers_are_those_of_localize_and_near_the_truth(room, served, localized):
    found = 0
    for photo, truth in zip(
        sorted((room / "photos").iterdir()), room_poses(N_PHOTOS, 5), strict=True
    ):
        status, answer = post(served, photo, focal_px=FOCAL_PX)
        assert status == 200
        assert answer["image"] == photo.name
        check_same(answer, localized[photo.name])
        if answer["pose"]:
            error_m, error_rad = pose_error(world_from_cam(answer), truth)
            assert error_m < 0.1
            assert np.degrees(error_rad) < 2.0
            found += 1
    assert found >= N_PHOTOS - 1


def first_found(room, localized):
    name = next(name for name, row in localized.items() if row["status"] == "localized")
    return room / "photos" / name, localized[name]


def test_a_pose_is_an_advanced_geopose_in_a_local_frame(room, served, localized):
    photo, row = first_found(room, localized)
    _, answer = post(served, photo, focal_px=FOCAL_PX)
    frame = answer["geopose"]["frameSpecification"]
    assert (frame["authority"], frame["id"]) == ("synfeal", "place/map")
    parameters = dict(pair.split("=") for pair in frame["parameters"].split("&"))
    assert [float(parameters[axis]) for axis in "xyz"] == [float(row[f"t{axis}"]) for axis in "xyz"]
    assert answer["geopose"]["quaternion"] == answer["pose"]["quaternion"]
    assert not {"lat", "lon"} & set(answer["geopose"])
    assert set(answer["geopose"]) == {"frameSpecification", "quaternion"}


def with_exif(photo, focal_mm):
    """Bytes of a photograph whose EXIF tells a focal length in 35 mm equivalent."""
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = 1
    exif.get_ifd(ExifTags.IFD.Exif)[ExifTags.Base.FocalLengthIn35mmFilm] = focal_mm
    stream = io.BytesIO()
    with Image.open(photo) as image:
        image.save(stream, "PNG", exif=exif)
    return stream.getvalue()


@pytest.mark.parametrize("way", ["calibration", "text", "exif", "bare"])
def test_the_camera_comes_in_several_ways(way, room, served, localized):
    photo, row = first_found(room, localized)
    camera = json.dumps(
        {
            "image_width": PHOTO.width,
            "image_height": PHOTO.height,
            "camera_matrix": PHOTO.intrinsics.matrix(-0.5).tolist(),
            "distortion_coefficients": [0.0] * 5,
        }
    )
    if way == "bare":
        status, _, body = ask(
            served,
            "POST",
            f"/localize?focal_px={FOCAL_PX}",
            photo.read_bytes(),
            {"Content-Type": "image/png"},
        )
        answer = json.loads(body)
    elif way == "exif":
        focal_mm = round(FOCAL_PX * np.hypot(36, 24) / np.hypot(PHOTO.width, PHOTO.height))
        image = (photo.name, with_exif(photo, focal_mm))
        status, answer = post(served, photo, image=image)
        assert status == 200, answer
        assert answer["camera"]["fx"] == pytest.approx(FOCAL_PX, rel=0.02)
        error_m, _ = pose_error(world_from_cam(answer), world_from_cam_of(row))
        assert (status, bool(error_m < 0.15)) == (200, True)
        return
    else:
        sent = ("camera.json", camera.encode()) if way == "calibration" else camera
        status, answer = post(served, photo, camera=sent)
    assert status == 200
    check_same(answer, row)


def world_from_cam_of(row):
    return pose_from_quat(
        [float(row[f"t{a}"]) for a in "xyz"], [float(row[f"q{a}"]) for a in "wxyz"]
    )


def test_photographs_of_another_room_are_not_localized(room, served):
    for photo in sorted((room / "elsewhere").iterdir()):
        status, answer = post(served, photo, focal_px=FOCAL_PX)
        assert (status, answer["status"], answer["pose"]) == (200, "not localized", None)
        assert answer["geopose"] is None


def test_what_is_drawn_from_the_pose_looks_like_the_photograph(room, served, localized):
    photo, _ = first_found(room, localized)
    _, answer = post(served, photo, focal_px=FOCAL_PX, rendering="true")
    kind, _, data = answer["rendering"].partition(",")
    assert kind == "data:image/jpeg;base64"
    with Image.open(io.BytesIO(base64.b64decode(data))) as drawn, Image.open(photo) as seen:
        assert drawn.size == (640, 480)
        there = np.asarray(drawn.resize(seen.size), float)
        here = np.asarray(seen.convert("RGB"), float)
    difference = np.abs(there - here).mean()
    # That of the photograph from itself, moved by a tenth of its width, is the scale of it.
    assert difference < 0.4 * np.abs(np.roll(here, 32, axis=1) - here).mean()


def jpeg_bytes(size=(64, 48)):
    stream = io.BytesIO()
    Image.new("RGB", size, (90, 120, 90)).save(stream, "JPEG")
    return stream.getvalue()


DAMAGED = jpeg_bytes((320, 240))[:-200]
GOOD = {"image": ("a.jpg", jpeg_bytes())}


def large():
    """A body of 1.2 MB whose length is not announced."""
    yield form_of({"image": ("a.jpg", jpeg_bytes() + bytes(12 * MEGABYTE // 10))})


@pytest.mark.parametrize(
    ("body", "headers", "status", "said"),
    [
        (b"x", {}, 415, "no photograph: the request is of type ''"),
        (b"{}", {"Content-Type": "application/json"}, 415, "type 'application/json'"),
        (b"hello", {"Content-Type": "image/png"}, 415, "is no JPEG, PNG or HEIC"),
        (b"", {"Content-Type": "image/png"}, 400, "is empty"),
        (form_of({"focal_px": 5}), FORM, 400, "no photograph; send it as field `image`"),
        (form_of({"image": "text"}), FORM, 400, "no photograph"),
        (b"nonsense", FORM, 400, "the form cannot be read"),
        (form_of(GOOD), {"Content-Type": "multipart/form-data"}, 400, "the form cannot be read"),
        (form_of({**GOOD, "fokal": 5}), FORM, 422, "field 'fokal' is not known, only image"),
        (form_of({**GOOD, "focal_px": "x"}), FORM, 422, "focal_px: 'x' is no number"),
        (form_of({**GOOD, "focal_px": -1}), FORM, 422, "focal_px: must be a positive number"),
        (form_of({**GOOD, "exif": "maybe"}), FORM, 422, "exif: must be true or false"),
        (form_of({**GOOD, "camera": "{"}), FORM, 422, "camera.json: cannot be read as a calib"),
        (form_of({**GOOD, "camera": "{}", "focal_px": 9}), FORM, 422, "give one of the two"),
        (form_of(GOOD), FORM, 422, "a.jpg: nothing says what its focal length is"),
        (
            form_of({"image": ("cut.jpg", DAMAGED)}),
            FORM,
            422,
            "cut.jpg: cannot be read as an image",
        ),
        (
            form_of({"image": ("big.jpg", jpeg_bytes((1250, 1000)))}),
            FORM,
            413,
            "big.jpg: has more than 1 megapixels",
        ),
        (
            form_of({"image": ("a.jpg", jpeg_bytes() + bytes(12 * MEGABYTE // 10))}),
            FORM,
            413,
            "the request is larger than 1 MB",
        ),
        (large, FORM, 413, "the request is larger than 1 MB"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(body, headers, status, said, served):
    sent = body() if callable(body) else body
    found, _, answer = ask(served, "POST", "/localize", sent, headers)
    error = json.loads(answer)["error"]
    assert (found, said in error) == (status, True), error
    assert "\n" not in error


@pytest.mark.parametrize(
    ("method", "path", "status"), [("GET", "/nowhere", 404), ("GET", "/localize", 405)]
)
def test_other_addresses_are_refused_as_json(method, path, status, served):
    found, _, answer = ask(served, method, path)
    assert found == status
    assert json.loads(answer)["error"]


def test_pages_of_the_internet_that_point_here_are_refused(served):
    assert ask(served, "GET", "/health", headers={"Host": "evil.example"})[0] == 400
    assert ask(served, "GET", "/health", headers={"Host": f"localhost:{served}"})[0] == 200


def test_eight_clients_at_once_get_the_answers_of_one(room, served, localized):
    photos = sorted((room / "photos").iterdir())
    bad = {"Content-Type": "image/png"}

    def client(number):
        found = []
        for turn in range(2):
            photo = photos[(number + turn) % len(photos)]
            found.append((photo.name, *post(served, photo, focal_px=FOCAL_PX)))
            assert ask(served, "POST", "/localize", b"nonsense", bad)[0] == 415
        return found

    with ThreadPoolExecutor(8) as clients:
        answers = [answer for some in clients.map(client, range(8)) for answer in some]
    assert len(answers) == 16
    for name, status, answer in answers:
        assert status == 200
        check_same(answer, localized[name])
    health = json.loads(ask(served, "GET", "/health")[2])
    assert (health["status"], health["pending"], health["frames"]) == ("ok", 0, 40)


def test_no_file_is_written_for_a_large_upload(served, monkeypatch):
    def written(*_):
        raise AssertionError("an upload went to a file")

    monkeypatch.setattr("tempfile.SpooledTemporaryFile.rollover", written)
    body = form_of({"image": ("a.jpg", jpeg_bytes() + bytes(99 * MEGABYTE // 100)), "focal_px": 9})
    status, _, answer = ask(served, "POST", "/localize", body, FORM)
    assert (status, json.loads(answer)["status"]) == (200, "not localized")


def test_who_does_not_go_on_sending_is_not_waited_for(served, monkeypatch):
    monkeypatch.setattr("baselines.serving.uploads.RECEIVE_S", 0.2)
    monkeypatch.setattr("baselines.serving.uploads.DRAIN_S", 0.2)
    with socket.create_connection(("127.0.0.1", served), timeout=30) as half:
        half.sendall(
            b"POST /localize HTTP/1.1\r\nHost: localhost\r\nContent-Type: image/png\r\n"
            b"Content-Length: 1000\r\n\r\nhalf"
        )
        assert half.recv(100).startswith(b"HTTP/1.1 408")
    until(lambda: json.loads(ask(served, "GET", "/health")[2])["pending"] == 0)


class HeldPlace:
    """A place that answers when the test says so."""

    def __init__(self, place):
        self._place = place
        self.work = []

    def __getattr__(self, name):
        return getattr(self._place, name)

    def submit(self, upload):
        self.work.append(Future())
        return self.work[-1]


@pytest.fixture
def held(room, opened):
    place = HeldPlace(opened)
    with running(place, job_of(room, cores=1, queue=1)) as port:
        yield place, port
        for work in place.work:
            work.cancel()


def until(true):
    end = time.monotonic() + 30
    while not true():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_who_finds_no_room_is_told_to_come_again(held, caplog):
    place, port = held
    body = form_of(GOOD)
    with ThreadPoolExecutor(2) as clients:
        two = [clients.submit(ask, port, "POST", "/localize", body, FORM) for _ in range(2)]
        until(lambda: len(place.work) == 2)
        status, headers, answer = ask(port, "POST", "/localize", body, FORM)
        assert (status, int(headers["Retry-After"]) >= 1) == (503, True)
        assert json.loads(answer)["error"] == "2 photographs wait already"
        assert json.loads(ask(port, "GET", "/health")[2])["pending"] == 2  # meanwhile
        place.work[0].set_exception(InputError("a.jpg", "is spoilt"))
        place.work[1].set_exception(RuntimeError("a secret of the program"))
        answers = [client.result() for client in two]
    by_status = {status: json.loads(body)["error"] for status, _, body in answers}
    assert by_status[422] == "a.jpg: is spoilt"
    assert by_status[500] == "a fault of the server, which is in its log"
    until(lambda: "a secret of the program" in caplog.text)  # for whoever mends it
    until(lambda: json.loads(ask(port, "GET", "/health")[2])["pending"] == 0)


def test_nothing_is_begun_for_those_who_left(held):
    place, port = held
    connection = http.client.HTTPConnection("127.0.0.1", port)
    connection.request("POST", "/localize", form_of(GOOD), FORM)
    until(lambda: len(place.work) == 1)
    connection.close()
    until(place.work[0].cancelled)
    until(lambda: json.loads(ask(port, "GET", "/health")[2])["pending"] == 0)


def test_the_page_needs_no_other_server(served):
    status, headers, body = ask(served, "GET", "/")
    page = body.decode()
    assert status == 200
    assert set(re.findall(r"https?://[^\s\"']+", page)) == {"http://www.w3.org/2000/svg"}
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert "<h1>place</h1>" in page
    assert "/localize" in json.loads(ask(served, "GET", "/openapi.json")[2])["paths"]


def test_the_plan_shows_the_walls_where_they_are(opened):
    plan = opened.plan
    centre = plan.plan_from_world @ [*SIZE_M / 2, 1.0]
    dark = np.asarray(Image.open(io.BytesIO(plan.png)))[..., 1].astype(float)
    px_per_m = dark.shape[1] / plan.width_m
    column, row = (px_per_m * centre[:2]).astype(int)
    half = (px_per_m * SIZE_M[:2] / 2).astype(int)
    walls = [
        dark[row - 5 : row + 5, column - half[0] - 3 : column - half[0] + 3],
        dark[row - 5 : row + 5, column + half[0] - 3 : column + half[0] + 3],
        dark[row - half[1] - 3 : row - half[1] + 3, column - 5 : column + 5],
        dark[row + half[1] - 3 : row + half[1] + 3, column - 5 : column + 5],
    ]
    middle = dark[row - 8 : row + 8, column - 8 : column + 8]
    assert min(wall.max() for wall in walls) > 200
    assert middle.max() < 20


def test_the_way_up_is_that_of_the_cameras():
    level = room_poses(12, 1)
    np.testing.assert_array_equal(upright_from_map(level), np.eye(3))
    y_up = np.eye(4)
    y_up[:3, :3] = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]  # z goes to y
    turn = upright_from_map(y_up @ level)
    np.testing.assert_allclose(turn @ [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], atol=1e-9)


def test_what_cannot_be_served_is_refused_before_anything_is_loaded(
    room, tmp_path, capsys, monkeypatch
):
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = str(other.getsockname()[1])
        line = refused(capsys, "serve", room / "place", "--port", port)
        assert f"--port: cannot listen on 127.0.0.1:{port}" in line
    assert "holds no map.json" in refused(capsys, "serve", tmp_path, "--port", "0")
    assert "is a file" in refused(capsys, "serve", room / "room.glb")
    assert "--cores: must be at least 1" in refused(capsys, "serve", room, "--cores", "0")
    assert "--port: must be 0 to 65535" in refused(capsys, "serve", room, "--port", "70000")
    monkeypatch.setattr("baselines.serving.run.find_spec", lambda name: None)
    line = refused(capsys, "serve", room / "place")
    assert line.endswith("serving needs fastapi: pip install 'synfeal-baselines[serve]'")


def test_told_to_stop_it_answers_what_is_under_way_and_ends_well(room, localized):
    command = [sys.executable, "-m", "synfeal.cli", "serve", str(room / "place"), "--port", "0"]
    before = sorted(path for path in room.rglob("*"))
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ
    ) as process:
        line = process.stdout.readline()
        port = int(re.match(r"http://127\.0\.0\.1:(\d+): place, 40 frames", line)[1])
        photo, row = first_found(room, localized)
        with ThreadPoolExecutor(4) as clients:
            some = [clients.submit(post, port, photo, focal_px=FOCAL_PX) for _ in range(4)]
            until(lambda: json.loads(ask(port, "GET", "/health")[2])["pending"] == 4)
            process.send_signal(signal.SIGTERM)
            for status, answer in (each.result() for each in some):
                assert status == 200
                check_same(answer, row)
        out, errors = process.communicate(timeout=60)
    assert (process.returncode, out, errors) == (0, "stopped\n", "")
    assert sorted(path for path in room.rglob("*")) == before
