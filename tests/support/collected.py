"""Small collections, and what is on disk after them."""

import hashlib

import numpy as np
import trimesh

from synfeal.cli import main
from synfeal.mesh.model import MeshPart, TexturedMesh
from synfeal.mesh.save import save_glb

SMALL = ("--width", "40", "--height", "33", "--spacing", "0.2", "--sequence-frames", "10")


def painted(mesh, rgb=None, seed=0, inwards=False):
    """A mesh of trimesh's whose corners all have one colour, or each another."""
    n = len(mesh.vertices)
    random = np.random.default_rng(seed).integers(0, 256, (n, 3), np.uint8)
    colors = random if rgb is None else np.tile(np.array(rgb, np.uint8), (n, 1))
    faces = np.asarray(mesh.faces)[:, :: -1 if inwards else 1]
    return TexturedMesh((MeshPart("mesh", np.asarray(mesh.vertices), faces, vertex_rgb=colors),))


def save_room(path, seed=0):
    """A closed room of 6 x 5 x 3 m with coloured corners."""
    save_glb(path, painted(trimesh.creation.box((6.0, 5.0, 3.0)), seed=seed))
    return path


def command(mesh, out, *more):
    """24 training and 8 test frames, in four sequences."""
    frames = ("--frames", "24", "--test-frames", "8")
    return ["collect", str(mesh), "--out", str(out), *frames, *SMALL, *more]


def collect(mesh, out, *more):
    """Exit status of :func:`command`."""
    return main(command(mesh, out, *more))


def tree_of(directory):
    """SHA-256 of every file below a directory, by its path there."""
    return {
        path.relative_to(directory).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in sorted(directory.rglob("*"))
        if path.is_file()
    }


def refused(capfd, *arguments):
    """Return a command's refusal, on one line and with status 1."""
    capfd.readouterr()
    assert main([str(argument) for argument in arguments]) == 1
    return only_error(capfd)


def only_error(capfd):
    """The message; before it nothing but lines of progress, and no traceback of any process."""
    *before, last = capfd.readouterr().err.strip().splitlines()
    assert not [line for line in before if not line.startswith("seq-")], before
    assert last.startswith("error: ")
    return last
